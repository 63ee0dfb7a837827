"""Sequences of frames turned into arrays: where the sphere is, how it is stretched, how large a pixel is."""
