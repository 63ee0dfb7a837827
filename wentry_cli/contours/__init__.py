"""Sub-pixel contours: ellipse of revolution, circle, bottom cap, separation line, and their Cramér–Rao bounds."""
