"""Scan lines and where they cross outlines: the geometry below the rasteriser."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Crossings = tuple[Ints, Floats, Ints, Ints]

LINES_PER_FINE_ROW = 4
LINES_AT_TURNS = 64
NARROW_PX = 20.0


@compiled
def place_lines(points, starts, first, n_fine, grid_rows) -> tuple[Floats, Floats, Ints]:  # type: ignore[no-untyped-def]
    """Heights and weights of the scan lines and the first line of each fine row.

    Where a wide outline turns around there are many more, and where it has a level edge a boundary between two lines
    lies on that edge, so that the edge is drawn where it is. Weights are shares of a fine row.
    """
    lines = np.full(n_fine, LINES_PER_FINE_ROW)
    level = np.full(n_fine, 0.5)
    for p in range(starts.size - 1):
        a, b = starts[p], starts[p + 1]
        if points[a:b, 0].max() - points[a:b, 0].min() < NARROW_PX:
            continue
        for i in range(a, b):
            before = points[i - 1 if i > a else b - 1, 1]
            after = points[i + 1 if i + 1 < b else a, 1]
            y = points[i, 1]
            if (y - before) * (after - y) <= 0.0:
                place = (y - first) * grid_rows
                row = int(np.floor(place))
                for m in range(max(row - 1, 0), min(row + 2, n_fine)):
                    lines[m] = LINES_AT_TURNS
                if y in (before, after) and 0 <= row < n_fine:
                    level[row] = place - row
    begin = np.zeros(n_fine + 1, np.int64)
    for m in range(n_fine):
        begin[m + 1] = begin[m] + lines[m]
    heights = np.empty(begin[-1])
    weights = np.empty(begin[-1])
    for m in range(n_fine):
        n, edge = lines[m], level[m]
        over = min(max(int(np.round(edge * n)), 1), n - 1)
        for k in range(n):
            upper = k < over
            step = edge / over if upper else (1.0 - edge) / (n - over)
            at = (k + 0.5) * step if upper else edge + (k - over + 0.5) * step
            heights[begin[m] + k] = first + (m + at) / grid_rows
            weights[begin[m] + k] = step
    return heights, weights, begin


@compiled
def find_crossings(points, starts, heights) -> Crossings:  # type: ignore[no-untyped-def]
    """Crossings of the outlines with the scan lines: first crossing of each line, abscissa, polygon, sense."""
    count = np.zeros(heights.size + 1, np.int64)
    for stage in range(2):
        if stage == 1:
            for k in range(heights.size):
                count[k + 1] += count[k]
            cursor = count[:-1].copy()
            xs = np.empty(count[-1], np.float64)
            who = np.empty(count[-1], np.int64)
            sense = np.empty(count[-1], np.int64)
        for p in range(starts.size - 1):
            a, b = starts[p], starts[p + 1]
            for i in range(a, b):
                j = i + 1 if i + 1 < b else a
                ya, yb = points[i, 1], points[j, 1]
                if ya == yb:
                    continue
                direction = 1 if yb > ya else -1
                low, high = (ya, yb) if yb > ya else (yb, ya)
                slope = (points[j, 0] - points[i, 0]) / (yb - ya)
                for k in range(np.searchsorted(heights, low), np.searchsorted(heights, high)):
                    if stage == 0:
                        count[k + 1] += 1
                    else:
                        c = cursor[k]
                        xs[c] = points[i, 0] + slope * (heights[k] - ya)
                        who[c] = p
                        sense[c] = direction
                        cursor[k] = c + 1
    return count, xs, who, sense


@compiled
def sort_line(crossings, a, b) -> None:  # type: ignore[no-untyped-def]
    """Put the crossings a to b of one scan line into the order of their abscissae, in place."""
    _, xs, who, sense = crossings
    for i in range(a + 1, b):
        x, w, s = xs[i], who[i], sense[i]
        j = i - 1
        while j >= a and xs[j] > x:
            xs[j + 1], who[j + 1], sense[j + 1] = xs[j], who[j], sense[j]
            j -= 1
        xs[j + 1], who[j + 1], sense[j + 1] = x, w, s
