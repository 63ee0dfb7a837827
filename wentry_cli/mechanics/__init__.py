"""Mechanics of an elastomer sphere: viscoelastic oscillation, its calibration, compression and added mass."""
