"""Synthetic drops: physics, light and noise, with their truth. Shares no formula with the estimators."""
