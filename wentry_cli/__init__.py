"""wentry: measurement and analysis of the water entry of deformable spheres."""

__version__ = "0.1.0"
