"""What the stages read: a recording as a clip of frames, and the tables of earlier stages by column."""
