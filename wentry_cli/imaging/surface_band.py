"""How far the dark band of a free surface reaches: the ground beside it is clear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.free_surface import SMOOTHED_PX, WIDEST_BAND, SurfaceRow, depth_of_dips

# A ground that is a tenth darker moves the edge by a quarter of a pixel: no more than a trace of the band is wanted.
CLEAR = 0.03
NEARLY_ALL, BLUR_PX, LEAST_COLUMNS = 0.98, 6.0, 8


def clear_of_band(level: NDArray[np.float32], row: SurfaceRow, columns: tuple[float, float]) -> tuple[float, float]:
    """How far above and below a surface its dark band reaches between two columns, px.

    ``level`` is the empty scene. A band is uneven, and the blur of the camera widens it: the reach is where the ground
    is clear in nearly all of the columns, at most the thickness and a few pixels.
    """
    half, most = 0.5 * row.thickness_px, row.thickness_px + BLUR_PX
    first, last = max(0, round(columns[0])), min(level.shape[1], round(columns[1]) + 1)
    middle = round(row.y_px)
    if last - first < LEAST_COLUMNS or not most < middle < level.shape[0] - most - 1:
        return half + 1.0, half + 1.0
    # what lies farther than these from the band and the columns does not tell on them
    upper, left = max(0, middle - math.ceil(most) - 2 * WIDEST_BAND), max(0, first - 2 * SMOOTHED_PX)
    lower, right = middle + math.ceil(most) + 2 * WIDEST_BAND + 1, last + 2 * SMOOTHED_PX
    dip = depth_of_dips(level[upper:lower, left:right])[:, first - left : last - left]
    reach = []
    for step in (-1, 1):
        lines = (dip > CLEAR)[middle - upper + step * np.arange(math.ceil(most) + 1)]
        clear = np.where((~lines).any(axis=0), np.argmin(lines, axis=0), len(lines))
        reach.append(min(most, max(half + 1.0, float(np.quantile(clear, NEARLY_ALL)))))
    return reach[0], reach[1]
