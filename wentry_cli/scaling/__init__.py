"""Dimensionless numbers and regressions over a campaign; nothing is imported here."""
