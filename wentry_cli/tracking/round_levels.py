"""Levels on circles about a point of the top view: how dark the sphere is within, and where it ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.patch import Patch

RAYS = 72
# The gap between sphere and ring is looked for from the first, in radii, to the second, in px, within a circle.
HOLLOW_FROM, HOLLOW_TO_PX = 0.6, 3.0


def median_levels(patch: Patch, x: float, y: float, away_px: ArrayLike) -> NDArray[np.float64]:
    """Median transmission on each of the circles of radii ``away_px`` (n,) about a point, in full-frame pixels.

    What lies outside of the patch or is not known counts as dark.
    """
    angle = np.linspace(0.0, 2.0 * math.pi, RAYS, endpoint=False)
    away = np.asarray(away_px, np.float64)[:, None]
    column = np.rint(x - patch.x0 + away * np.cos(angle)).astype(np.intp)
    row = np.rint(y - patch.y0 + away * np.sin(angle)).astype(np.intp)
    height, width = patch.values.shape
    seen = (row >= 0) & (column >= 0) & (row < height) & (column < width)
    levels = np.where(seen, patch.values[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], 0.0)
    return np.asarray(np.median(np.nan_to_num(levels), axis=1), np.float64)


def lightest_within(patch: Patch, fit: SilhouetteFit) -> float:
    """Highest of the median transmissions on the circles within a fitted one, from 0.6 of its radius outwards.

    The sphere is as dark there as ever; the outer edge of a splash ring has the bright gap between sphere and ring
    within, where that has opened. The last pixels are left to the blur of the edge.
    """
    start = HOLLOW_FROM * fit.radius_px
    away = np.arange(start, max(start, fit.radius_px - HOLLOW_TO_PX) + 0.25, 0.5)
    return float(median_levels(patch, fit.center_x_px, fit.center_y_px, away).max())
