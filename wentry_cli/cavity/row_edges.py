"""Left and right edge of a dark body in every row of a patch, to a fraction of a pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.components import DarkParts
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Edges = tuple[Floats, Floats, Floats]
"""Left and right edge of every row, px, NaN where not seen, and how thick the thinner of its two walls is."""

THIN_WALL = (1.6, 2.6)  # in units of the blur: thinner than that its two sides overlap, thicker they do not
REFERENCE_WALL = 3.1  # in the same units: a wall that tells what light the rows take away
THICK_PX = 12
REFERENCE_ROWS, FEWEST_REFERENCES = 12, 5
WIDEST_FAINT_PX = 12  # a faint row wider than that is blur between two dark things, not a thin neck


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
    """Pixels from ``start`` towards ``stop`` until the row rises above ``level``; what is thick is not measured out."""
    step = 1 if stop > start else -1
    most = min(abs(stop - start) + 1, THICK_PX)
    for away in range(most):
        if values[row, start + step * away] >= level:
            return float(away)
    return float(most)


@compiled
def _clear_of_rim(first: int, last: int, columns: int, rim: int) -> bool:
    return first >= rim and last <= columns - 1 - rim


@compiled
def find_edges(values: NDArray[np.float32], spans: tuple[Ints, Ints], level: float, rim: int) -> Edges:
    """Outermost half-level crossings per row, at most four pixels inside the outermost dark pixel; the thinner wall.

    ``spans`` are the first and the last column of the body per row, -1 where there is none.
    """
    rows, columns = spans[0].size, values.shape[1]
    left, right, wall = np.full(rows, np.nan), np.full(rows, np.nan), np.zeros(rows)
    for row in range(rows):
        first, last = spans[0][row], spans[1][row]
        if not _clear_of_rim(first, last, columns, rim):
            continue
        left[row], left_dark = _crossing(values, row, first, min(first + 4, last), level)
        right[row], right_dark = _crossing(values, row, last, max(last - 4, first), level)
        if left_dark >= 0 and right_dark >= left_dark:
            left_wall = _wall_thickness(values, row, left_dark, right_dark, level)
            right_wall = _wall_thickness(values, row, right_dark, left_dark, level)
            wall[row] = min(left_wall, right_wall)
    return left, right, wall


@compiled
def _missing_light(
    values: NDArray[np.float32], row: int, span: tuple[int, int], light: tuple[float, float]
) -> tuple[float, float]:
    """Width of a fully dark bar that takes away as much light as the row does, and the centre of what is missing."""
    ground, dark = light
    total, moment = 0.0, 0.0
    for column in range(max(span[0] - 5, 0), min(span[1] + 6, values.shape[1])):
        missing = (ground - values[row, column]) / (ground - dark)
        if np.isfinite(missing):
            total += missing
            moment += missing * column
    return (total, moment / total) if total > 0.3 else (np.nan, np.nan)


@compiled
def _collect_shares(share: Floats, row: int, step: int, found: Floats) -> int:
    """Put the shares of the rows from ``row`` on into ``found`` as long as there is room; their number."""
    count = 0
    other = row + step
    while 0 <= other < share.size and count < found.size:
        if np.isfinite(share[other]):
            found[count] = share[other]
            count += 1
        other += step
    return count


@compiled
def _usual_share(share: Floats, row: int, above: Floats, below: Floats) -> float:
    """Median share of the nearest rows with thick walls, half of them above where there are; NaN where too few."""
    up, down = _collect_shares(share, row, -1, above), _collect_shares(share, row, 1, below)
    if up + down < FEWEST_REFERENCES:
        return np.nan
    half = REFERENCE_ROWS // 2
    use_up = min(up, max(half, REFERENCE_ROWS - down))
    use_down = min(down, REFERENCE_ROWS - use_up)
    near = np.empty(REFERENCE_ROWS)
    near[:use_up] = above[:use_up]
    near[use_up : use_up + use_down] = below[:use_down]
    return median_of(near, use_up + use_down)


@compiled
def mend_thin_walls(
    values: NDArray[np.float32],
    spans: tuple[Ints, Ints],
    edges: Edges,
    light: tuple[float, float],
    blur: float,
    rim: int,
) -> None:
    """Replace the edges of rows whose walls are thinner than the blur by those from the missing light.

    What a row takes away is its width times a share that depends on how much of it the bright core fills; the share is
    read from the nearest rows whose walls are thick enough. Blur does not change the sum. ``light`` is the level of
    the ground and that of the dark, ``blur`` the standard deviation of the blur, px.
    """
    left, right, wall = edges
    thinnest, thickest = THIN_WALL[0] * blur, THIN_WALL[1] * blur
    rows, columns = left.size, values.shape[1]
    width = right - left
    thin, share = np.zeros(rows, np.bool_), np.full(rows, np.nan)
    for row in range(rows):
        if _clear_of_rim(spans[0][row], spans[1][row], columns, rim):
            thin[row] = wall[row] < thickest or np.isnan(width[row])
    if not thin.any():
        return
    for row in range(rows):
        if wall[row] >= REFERENCE_WALL * blur and np.isfinite(width[row]):
            share[row] = _missing_light(values, row, (spans[0][row], spans[1][row]), light)[0] / width[row]
    above, below = np.empty(REFERENCE_ROWS), np.empty(REFERENCE_ROWS)
    for row in range(rows):
        if not thin[row]:
            continue
        missing, centre = _missing_light(values, row, (spans[0][row], spans[1][row]), light)
        usual = _usual_share(share, row, above, below)
        if np.isnan(missing) or np.isnan(usual):
            continue
        half = 0.5 * missing / max(usual, 0.05)
        trust = min(max((thickest - wall[row]) / (thickest - thinnest), 0.0), 1.0)
        if np.isnan(width[row]):
            left[row], right[row] = centre - half, centre + half
        else:
            left[row] = trust * (centre - half) + (1.0 - trust) * left[row]
            right[row] = trust * (centre + half) + (1.0 - trust) * right[row]


def find_closed_rows(
    values: NDArray[np.float32], parts: DarkParts, keep: NDArray[np.bool_], rows: int, level: float
) -> NDArray[np.bool_]:
    """Which of the first ``rows`` rows lie between the first and the last of the body but show nothing of it."""
    first, last = parts.spans(keep)
    open_rows = (first >= 0) & (last - first < WIDEST_FAINT_PX)
    _open_dark_rows(values, (parts.row, parts.first, parts.last), keep[parts.label], level, open_rows)
    seen = np.flatnonzero(open_rows[:rows])
    closed = np.zeros(rows, np.bool_)
    if seen.size:
        closed[seen[0] : seen[-1]] = ~open_rows[seen[0] : seen[-1]]
    return closed


@compiled
def _open_dark_rows(
    values: NDArray[np.float32],
    runs: tuple[Ints, Ints, Ints],
    keep: NDArray[np.bool_],
    level: float,
    open_rows: NDArray[np.bool_],
) -> None:
    """Mark the rows in which a kept run has a pixel below ``level``."""
    for run in range(keep.size):
        row = runs[0][run]
        if not keep[run] or open_rows[row]:
            continue
        for column in range(runs[1][run], runs[2][run] + 1):
            if values[row, column] < level:
                open_rows[row] = True
                break
