"""Left and right edge of a dark body in every row of a patch, to a fraction of a pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]

THIN_WALL_PX = (1.6, 2.6)  # thinner than that the blur of its two sides overlaps, thicker it does not
REFERENCE_ROWS = 12
WIDEST_FAINT_PX = 12  # a faint row wider than that is blur between two dark things, not a thin neck


@compiled
def _span(body: NDArray[np.uint8], row: int) -> tuple[int, int]:
    """First and last column of the body in ``row``, −1 where there is none."""
    columns = body.shape[1]
    first, last = -1, -1
    for column in range(columns):
        if body[row, column]:
            first = column
            break
    if first >= 0:
        for column in range(columns - 1, -1, -1):
            if body[row, column]:
                last = column
                break
    return first, last


@compiled
def _crossing(values: NDArray[np.float32], row: int, start: int, stop: int, level: float) -> tuple[float, int]:
    """Where the row first falls below ``level`` from ``start`` on, walking towards ``stop``, and that pixel."""
    step = 1 if stop > start else -1
    for column in range(start, stop + step, step):
        outside, inside = values[row, column - step], values[row, column]
        if inside < level <= outside:
            return column - step * (level - inside) / (outside - inside), column
    return np.nan, -1


@compiled
def _wall_thickness(values: NDArray[np.float32], row: int, start: int, stop: int, level: float) -> float:
    """Pixels from ``start`` towards ``stop`` until the row rises above ``level``."""
    step = 1 if stop > start else -1
    for column in range(start, stop + step, step):
        if values[row, column] >= level:
            return float(abs(column - start))
    return float(abs(stop - start) + 1)


@compiled
def find_edges(
    values: NDArray[np.float32], body: NDArray[np.uint8], level: float, rim: int
) -> tuple[Floats, Floats, Floats]:
    """Outermost half-level crossings per row, at most four pixels inside the outermost dark pixel; the thinner wall."""
    rows, columns = body.shape
    left, right, wall = np.full(rows, np.nan), np.full(rows, np.nan), np.zeros(rows)
    for row in range(rows):
        first, last = _span(body, row)
        if first < rim or last > columns - 1 - rim:
            continue
        left[row], left_dark = _crossing(values, row, first, min(first + 4, last), level)
        right[row], right_dark = _crossing(values, row, last, max(last - 4, first), level)
        if left_dark >= 0 and right_dark >= left_dark:
            left_wall = _wall_thickness(values, row, left_dark, right_dark, level)
            right_wall = _wall_thickness(values, row, right_dark, left_dark, level)
            wall[row] = min(left_wall, right_wall)
    return left, right, wall


@compiled
def find_missing_light(
    values: NDArray[np.float32], body: NDArray[np.uint8], ground: float, dark: float, rim: int
) -> tuple[Floats, Floats]:
    """Width of a fully dark bar that takes away as much light as each row does, and the centre of what is missing."""
    rows, columns = body.shape
    width, centre = np.full(rows, np.nan), np.full(rows, np.nan)
    for row in range(rows):
        first, last = _span(body, row)
        if first < rim or last > columns - 1 - rim:
            continue
        total, moment = 0.0, 0.0
        for column in range(max(first - 5, 0), min(last + 6, columns)):
            missing = (ground - values[row, column]) / (ground - dark)
            if np.isfinite(missing):
                total += missing
                moment += missing * column
        if total > 0.3:
            width[row], centre[row] = total, moment / total
    return width, centre


def mend_thin_walls(left: Floats, right: Floats, wall: Floats, missing: Floats, centre: Floats) -> None:
    """Replace the edges of rows whose walls are thinner than the blur by those from the missing light.

    What a row takes away is its width times a share that depends on how much of it the bright core fills; the share is
    read from the nearest rows whose walls are thick enough. Blur does not change the sum.
    """
    width = right - left
    thin = np.flatnonzero(np.isfinite(missing) & ((wall < THIN_WALL_PX[1]) | ~np.isfinite(width)))
    thick = np.flatnonzero((wall >= THIN_WALL_PX[1] + 0.5) & np.isfinite(missing) & np.isfinite(width))
    if thin.size == 0 or thick.size < 5:
        return
    share = missing[thick] / width[thick]
    for row in thin:
        half = 0.5 * missing[row] / max(float(np.median(share[_nearest(thick, int(row))])), 0.05)
        trust = (THIN_WALL_PX[1] - wall[row]) / (THIN_WALL_PX[1] - THIN_WALL_PX[0])
        trust = float(np.clip(trust, 0.0, 1.0)) if np.isfinite(width[row]) else 1.0
        left[row] = trust * (centre[row] - half) + (1.0 - trust) * np.nan_to_num(left[row])
        right[row] = trust * (centre[row] + half) + (1.0 - trust) * np.nan_to_num(right[row])


def _nearest(thick: NDArray[np.int64], row: int) -> slice:
    """The slice of the increasing rows ``thick`` that lie nearest to ``row``."""
    first = int(np.clip(np.searchsorted(thick, row) - REFERENCE_ROWS // 2, 0, max(thick.size - REFERENCE_ROWS, 0)))
    return slice(first, first + REFERENCE_ROWS)


@compiled
def find_closed_rows(values: NDArray[np.float32], body: NDArray[np.uint8], level: float) -> NDArray[np.bool_]:
    """Rows between the first and the last of the body in which nothing is left of it."""
    rows, columns = body.shape
    open_rows = np.zeros(rows, np.bool_)
    top, bottom = rows, -1
    for row in range(rows):
        first, last = _span(body, row)
        if first < 0:
            continue
        dark = last - first < WIDEST_FAINT_PX
        for column in range(columns):
            if body[row, column] and values[row, column] < level:
                dark = True
                break
        if dark:
            open_rows[row] = True
            top, bottom = min(top, row), row
    closed = np.zeros(rows, np.bool_)
    for row in range(top, bottom):
        closed[row] = not open_rows[row]
    return closed
