"""The stages: each reads tables, calls numerics and writes tables."""
