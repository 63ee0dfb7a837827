"""Runs the stages: what is stale and why, one drop after another or side by side, locked and resumable."""
