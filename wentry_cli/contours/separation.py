"""The separation line: where the outline of the silhouette leaves the sphere."""

from __future__ import annotations

from dataclasses import dataclass

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.patch import Patch


@dataclass(frozen=True)
class SeparationFit:
    """Row of the separation line (full-frame px), both sides and their mean; NaN where it cannot be seen."""

    y_px: float
    y_unc_px: float
    left_y_px: float
    right_y_px: float
    status: str


def find_separation(patch: Patch, fit: SilhouetteFit) -> SeparationFit:
    """Find the first sustained departure of the outward edge from the fitted ellipse."""
    raise NotImplementedError
