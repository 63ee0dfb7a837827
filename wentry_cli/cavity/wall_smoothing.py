"""A wall without the bubbles and droplets that stick out of it, smoothed along the rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]

SMOOTHING_ROWS = 3
BUMP_ROWS = 17  # what sticks out of a wall over fewer rows is a bubble or a droplet
BUMP_PX = 2.0
LEDGE_ROWS = 9
HOLE_PX = -1e6  # an edge that was not seen
JUMP_PX = 3.0  # between two rows; a wall is not smoothed across it


@compiled
def smooth_wall(edge: Floats, ledges: Floats) -> tuple[Floats, float]:
    """Return the edge (outward positive) without bumps, smoothed by local parabolas, and its scatter between rows.

    A row is NaN where no edge was seen, and infinite where it is hidden: that is neither a hole nor a bump. Right below
    ``ledges`` (rows) a bulge of the cavity is as short as a bubble, and nothing is left out, and the first rows stay as
    they are: they are continued to the ledge.
    """
    clean = edge.copy()
    _leave_out_bumps(edge, clean)
    for ledge in ledges:
        below = slice(max(int(ledge), 0), int(ledge) + BUMP_ROWS)
        clean[below] = edge[below]
    smooth = np.empty_like(clean)
    _local_parabola(clean, SMOOTHING_ROWS, JUMP_PX, smooth)
    for ledge in ledges:
        for row in range(max(int(ledge), 0), min(int(ledge) + LEDGE_ROWS, edge.size)):
            smooth[row] = edge[row] if np.isfinite(edge[row]) else np.nan
    rest = np.empty_like(clean)
    count = 0
    for row in range(clean.size):
        if np.isfinite(smooth[row]):
            rest[count] = abs(clean[row] - smooth[row])
            count += 1
    return smooth, 1.4826 * median_of(rest, count)


@compiled
def _leave_out_bumps(edge: Floats, clean: Floats) -> None:
    """Make those rows of ``clean`` NaN that stand out of the morphological opening of ``edge``."""
    rows, half = edge.size, BUMP_ROWS // 2
    lowest = np.empty(rows)
    for row in range(rows):
        lowest[row] = np.inf
        for other in range(max(row - half, 0), min(row + half + 1, rows)):
            lowest[row] = min(lowest[row], HOLE_PX if np.isnan(edge[other]) else edge[other])
    for row in range(rows):
        opened = -np.inf
        for other in range(max(row - half, 0), min(row + half + 1, rows)):
            opened = max(opened, lowest[other])
        if edge[row] - opened > BUMP_PX:
            clean[row] = np.nan


@compiled
def _local_parabola(edge: Floats, half: int, jump: float, smooth: Floats) -> None:
    for row in range(edge.size):
        smooth[row] = np.nan
        if not np.isfinite(edge[row]):
            continue
        low = row
        while low > max(row - half, 0) and abs(edge[low - 1] - edge[low]) <= jump:
            low -= 1
        high = row
        while high < min(row + half, edge.size - 1) and abs(edge[high + 1] - edge[high]) <= jump:
            high += 1
        n, s1, s2, s3, s4, t0, t1, t2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for other in range(low, high + 1):
            d = float(other - row)
            n += 1.0
            s1 += d
            s2 += d * d
            s3 += d * d * d
            s4 += d * d * d * d
            t0 += edge[other]
            t1 += edge[other] * d
            t2 += edge[other] * d * d
        if n < 5.0:
            smooth[row] = t0 / n if n < 3.0 else (t0 * s2 - t1 * s1) / (n * s2 - s1 * s1)
            continue
        determinant = n * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
        value = t0 * (s2 * s4 - s3 * s3) - s1 * (t1 * s4 - s3 * t2) + s2 * (t1 * s3 - s2 * t2)
        smooth[row] = value / determinant
