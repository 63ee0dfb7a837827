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
    filled = edge.copy()
    for row in range(edge.size):
        if np.isnan(edge[row]):
            filled[row] = HOLE_PX
    opened = -_lowest_near(-_lowest_near(filled))
    for row in range(edge.size):
        if edge[row] - opened[row] > BUMP_PX:
            clean[row] = np.nan


@compiled
def _lowest_near(values: Floats) -> Floats:
    """The lowest of the values over ``BUMP_ROWS`` rows about each one, by minima over twice as many rows each time."""
    half = BUMP_ROWS // 2
    lowest = np.full(values.size + 2 * half, np.inf)
    lowest[half : half + values.size] = values
    over = 1
    while 2 * over <= BUMP_ROWS:
        for row in range(lowest.size - over):
            lowest[row] = min(lowest[row], lowest[row + over])
        over *= 2
    least: Floats = np.minimum(lowest[: values.size], lowest[BUMP_ROWS - over :][: values.size])
    return least


@compiled
def _local_parabola(edge: Floats, half: int, jump: float, smooth: Floats) -> None:
    """Fill ``smooth`` with the parabolas through up to ``half`` rows on either side, as far as the edge does not jump.

    Without a jump or an end these are constant weights (Savitzky and Golay 1964).
    """
    rows = edge.size
    steady = np.zeros(rows, np.int64)  # rows before this one without a jump
    for row in range(1, rows):
        steady[row] = steady[row - 1] + 1 if abs(edge[row] - edge[row - 1]) <= jump else 0
    weights = _weights(half)
    for row in range(rows):
        if not np.isfinite(edge[row]):
            smooth[row] = np.nan
        elif row >= half and row + half < rows and steady[row + half] >= 2 * half:
            smooth[row] = 0.0
            for k in range(2 * half + 1):
                smooth[row] += weights[k] * edge[row - half + k]
        else:
            high = row
            while high < min(row + half, rows - 1) and steady[high + 1] > 0:
                high += 1
            smooth[row] = _parabola_at(edge, row, row - min(half, steady[row]), high)


@compiled
def _weights(half: int) -> Floats:
    """What each row counts in the middle of the least-squares parabola through ``half`` rows on either side."""
    weights, unit = np.empty(2 * half + 1), np.zeros(2 * half + 1)
    for k in range(unit.size):
        unit[:] = 0.0
        unit[k] = 1.0
        weights[k] = _parabola_at(unit, half, 0, 2 * half)
    return weights


@compiled
def _parabola_at(edge: Floats, row: int, low: int, high: int) -> float:
    """The least-squares parabola through the rows from ``low`` to ``high`` at ``row``; of few rows a line or a mean."""
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
        return t0 / n if n < 3.0 else (t0 * s2 - t1 * s1) / (n * s2 - s1 * s1)
    determinant = n * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
    return (t0 * (s2 * s4 - s3 * s3) - s1 * (t1 * s4 - s3 * t2) + s2 * (t1 * s3 - s2 * t2)) / determinant
