"""Left and right edge of a dark body in every row of a patch, to a fraction of a pixel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.region import Region, transmission, transmission_of_row
from wentry_cli.compiled import compiled, reordered
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Edges = tuple[Floats, Floats, Floats]
"""Left and right edge of every row, px, NaN where not seen, and how thick the thinner of its two walls is."""

THIN_WALL = (1.6, 2.6)  # in units of the blur: thinner than that its two sides overlap, thicker they do not
REFERENCE_WALL = 3.1  # in the same units: a wall that tells what light the rows take away
MEASURED_PX, THICK_PX = 5, 12  # what is thicker is not measured out: where walls are sharp, and where they are not
REFERENCE_ROWS, FEWEST_REFERENCES = 12, 5


@compiled
def _crossing(region: Region, row: int, start: int, stop: int, level: float) -> tuple[float, int]:
    """Where the row first falls below ``level`` from ``start`` on, walking towards ``stop``, and that pixel."""
    step = 1 if stop > start else -1
    outside = transmission(region, row, start - step)
    for column in range(start, stop + step, step):
        inside = transmission(region, row, column)
        if inside < level <= outside:
            return column - step * (level - inside) / (outside - inside), column
        outside = inside
    return np.nan, -1


@compiled
def _wall_thickness(region: Region, row: int, ends: tuple[int, int], level: float, most: int) -> int:
    """Pixels between ``ends``, from the first on, until the row rises above ``level``; ``most`` where it is thicker."""
    start, stop = ends
    step = 1 if stop > start else -1
    most = min(abs(stop - start) + 1, most)
    for away in range(most):
        if transmission(region, row, start + step * away) >= level:
            return away
    return most


@compiled
def _clear_of_rim(first: int, last: int, columns: int, rim: int) -> bool:
    return first >= rim and last <= columns - 1 - rim


@compiled
def find_edges(region: Region, spans: tuple[Ints, Ints], level: float, rim: int, thick_px: int) -> Edges:
    """Outermost half-level crossings per row, at most four pixels inside the outermost dark pixel; the thinner wall.

    ``spans`` are the first and the last column of the body per row, -1 where there is none; a wall is measured up to
    ``thick_px``.
    """
    rows, columns = spans[0].size, region.columns
    left, right, wall = np.full(rows, np.nan), np.full(rows, np.nan), np.zeros(rows)
    for row in range(rows):
        first, last = spans[0][row], spans[1][row]
        if not _clear_of_rim(first, last, columns, rim):
            continue
        left[row], left_dark = _crossing(region, row, first, min(first + 4, last), level)
        right[row], right_dark = _crossing(region, row, last, max(last - 4, first), level)
        if left_dark >= 0 and right_dark >= left_dark:
            left_wall = _wall_thickness(region, row, (left_dark, right_dark), level, thick_px)
            wall[row] = _wall_thickness(region, row, (right_dark, left_dark), level, left_wall)
    return left, right, wall


@compiled
def _missing_light(region: Region, row: int, span: tuple[int, int], light: tuple[float, float]) -> tuple[float, float]:
    """Width of a fully dark bar that takes away as much light as the row does, and the centre of what is missing."""
    first = max(span[0] - 5, 0)
    values = transmission_of_row(region, row, first, min(span[1] + 6, region.columns))
    total, moment = _add_up(values, light)
    return (total, first + moment / total) if total > 0.3 else (np.nan, np.nan)


@reordered
def _add_up(values: NDArray[np.float32], light: tuple[float, float]) -> tuple[float, float]:
    """Sum of what is missing in ``values``, in units of the contrast, and its moment about the first."""
    total, moment = 0.0, 0.0
    for column in range(values.size):
        missing = light[0] - values[column]
        missing = 0.0 if math.isnan(missing) else missing  # masked
        total += missing
        moment += missing * column
    return total / (light[0] - light[1]), moment / (light[0] - light[1])


class _Shares(NamedTuple):
    """Share of its width that a row with thick walls takes away of the light, measured where it is asked for.

    ``rows`` are those with thick walls, ``known`` what each takes away if it is not ``waiting`` to be measured.
    """

    rows: NDArray[np.int64]
    waiting: NDArray[np.bool_]
    known: Floats
    width: Floats


@compiled
def _collect_shares(
    region: Region, spans: tuple[Ints, Ints], light: tuple[float, float], shares: _Shares, way: tuple[int, int]
) -> tuple[Floats, int]:
    """The shares of the nearest rows on the ``way`` (place among those with thick walls, step), and how many these are.

    They are no more than may be of use.
    """
    found, count = np.empty(REFERENCE_ROWS), 0
    place, step = way
    while 0 <= place < shares.rows.size and count < REFERENCE_ROWS:
        if shares.waiting[place]:
            row = shares.rows[place]
            span = spans[0][row], spans[1][row]
            shares.known[place] = _missing_light(region, row, span, light)[0] / shares.width[row]
            shares.waiting[place] = False
        if np.isfinite(shares.known[place]):
            found[count] = shares.known[place]
            count += 1
        place += step
    return found, count


@compiled
def _usual_share(above: tuple[Floats, int], below: tuple[Floats, int]) -> float:
    """Median share of the nearest rows with thick walls, half of them above where there are; NaN where too few."""
    up, down = above[1], below[1]
    if up + down < FEWEST_REFERENCES:
        return np.nan
    half = REFERENCE_ROWS // 2
    use_up = min(up, max(half, REFERENCE_ROWS - down))
    use_down = min(down, REFERENCE_ROWS - use_up)
    near = np.empty(REFERENCE_ROWS)
    near[:use_up] = above[0][:use_up]
    near[use_up : use_up + use_down] = below[0][:use_down]
    return median_of(near, use_up + use_down)


@compiled
def mend_thin_walls(
    region: Region,
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
    rows, columns = left.size, region.columns
    width = right - left
    thin, thick = np.zeros(rows, np.bool_), np.zeros(rows, np.bool_)
    for row in range(rows):
        if _clear_of_rim(spans[0][row], spans[1][row], columns, rim):
            thin[row] = wall[row] < thickest or np.isnan(width[row])
        thick[row] = wall[row] >= REFERENCE_WALL * blur and np.isfinite(width[row])
    references = np.flatnonzero(thick)
    shares = _Shares(references, np.ones(references.size, np.bool_), np.empty(references.size), width)
    after = 0  # the place of the first reference behind the row
    for row in range(rows):
        after += 1 if thick[row] else 0
        if not thin[row]:
            continue
        missing, centre = _missing_light(region, row, (spans[0][row], spans[1][row]), light)
        above = _collect_shares(region, spans, light, shares, (after - 1, -1))
        usual = _usual_share(above, _collect_shares(region, spans, light, shares, (after, 1)))
        if np.isnan(missing) or np.isnan(usual):
            continue
        half = 0.5 * missing / max(usual, 0.05)
        trust = min(max((thickest - wall[row]) / (thickest - thinnest), 0.0), 1.0)
        if np.isnan(width[row]):
            left[row], right[row] = centre - half, centre + half
        else:
            left[row] = trust * (centre - half) + (1.0 - trust) * left[row]
            right[row] = trust * (centre + half) + (1.0 - trust) * right[row]
