"""The lowest point of the silhouette from its bottom cap alone, free of the ellipse."""

from __future__ import annotations

from dataclasses import dataclass

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.patch import Patch


@dataclass(frozen=True)
class BottomFit:
    """The lowest point of the outline, full-frame px, NaN where it could not be measured."""

    x_px: float
    y_px: float
    y_unc_px: float
    residual_rms_px: float
    status: str


def fit_local_bottom(
    patch: Patch,
    fit: SilhouetteFit,
    *,
    half_angle_deg: float = 30.0,
    motion_px: tuple[float, float] = (0.0, 0.0),
) -> BottomFit:
    """Locate the lowest point from the edge within ``half_angle_deg`` of the bottom."""
    raise NotImplementedError
