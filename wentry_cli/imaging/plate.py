"""The upper edge of a rigid plate in the empty scene."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.free_surface import BLOCKS, SurfaceRow, line_across


def find_plate(level: NDArray[np.float32], *, x_px: float | None = None) -> SurfaceRow:
    """Find the upper edge of a rigid plate in the empty scene: ground above, dark below, across the whole picture.

    Arguments and result as for ``find_free_surface``; the edge is where the level falls to half of that above it.
    """
    strips = np.array_split(np.arange(level.shape[1]), BLOCKS)
    edges = np.array([_falling_edge(np.median(level[:, strip], axis=1)) for strip in strips])
    middle = np.array([float(strip.mean()) for strip in strips])
    return line_across(middle, edges, x_px if x_px is not None else level.shape[1] / 2, 0.0, 1.0)


def _falling_edge(profile: NDArray[np.float32]) -> float:
    ground = float(np.percentile(profile, 75))
    dark = profile < 0.5 * ground
    if not dark[-3:].all() or dark.all():
        return math.nan
    row = int(np.flatnonzero(~dark)[-1])
    above = float(np.median(profile[max(0, row - 12) : max(1, row - 4)]))
    below = float(np.median(profile[row + 5 : row + 13])) if row + 6 < profile.size else 0.0
    window = profile[max(0, row - 4) : row + 6].astype(np.float64)
    above_edge = np.clip((window - below) / max(above - below, 1e-6), 0.0, 1.0)
    return max(0, row - 4) - 0.5 + float(np.sum(above_edge))
