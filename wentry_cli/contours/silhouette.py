"""The side view: an ellipse of revolution fitted to the wetted arc of the silhouette."""

from __future__ import annotations

from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.imaging.patch import Patch


def fit_silhouette(
    patch: Patch,
    guess: EllipseShape,
    *,
    free: str = "x y stretch",
    top_y_px: float = float("-inf"),
    motion_px: tuple[float, float] = (0.0, 0.0),
    level: str = "accurate",
) -> SilhouetteFit:
    """Fit the ellipse of revolution to the edge of a dark silhouette."""
    raise NotImplementedError
