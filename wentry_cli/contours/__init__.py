"""Sub-pixel contours: ellipse of revolution, circle, bottom cap, separation line, Cramér–Rao bounds."""
