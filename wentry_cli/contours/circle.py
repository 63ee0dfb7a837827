"""The top view: a circle fitted to the outline of the sphere, with the splash ring kept out."""

from __future__ import annotations

from dataclasses import dataclass

from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.fitting import FitRequest, fit_shape
from wentry_cli.imaging.patch import Patch


@dataclass(frozen=True)
class Circle:
    """A circle in full-frame pixels."""

    x: float
    y: float
    radius: float


def fit_circle(
    patch: Patch,
    guess: Circle,
    one_sided: bool = False,
    motion_px: tuple[float, float] = (0.0, 0.0),
    level: str = "accurate",
    *,
    followed: bool = False,
) -> SilhouetteFit:
    """Fit a circle (stretch 1, radius free) to the outline of a dark disc.

    With ``one_sided`` what disagrees is taken to lie outside (a splash ring that merges with the outline) and is
    gated more tightly on that side. ``motion_px`` is the displacement during the exposure; ``level`` as in
    `fit_silhouette`, ``followed`` as in `FitRequest`. The result is to be trusted while less than half of it is gated.
    """
    shape = EllipseShape(guess.x, guess.y, guess.radius)
    free = ("x", "y", "R")
    request = FitRequest(free, motion_px=motion_px, level=level, one_sided=one_sided, followed=followed)
    return fit_shape(patch, shape, request)
