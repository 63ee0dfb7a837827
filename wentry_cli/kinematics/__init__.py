"""Position, velocity, acceleration, oscillation and force from tracked positions; nothing is imported here."""
