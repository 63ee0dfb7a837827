"""Flat field, patches, edge samples, detection and the free surface: arrays in, frozen results out."""
