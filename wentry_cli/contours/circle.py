"""The top view: a circle fitted to the outline of the sphere, with the splash ring kept out."""

from __future__ import annotations

from dataclasses import dataclass

from wentry_cli.contours.ellipse import SilhouetteFit
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
    *,
    one_sided: bool = False,
    motion_px: tuple[float, float] = (0.0, 0.0),
    level: str = "accurate",
) -> SilhouetteFit:
    """Fit a circle (stretch 1, radius free)."""
    raise NotImplementedError
