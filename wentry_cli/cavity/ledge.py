"""Ledges of the wall: the underside of a cavity in which a narrower one starts, and the rows that its blur darkens."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.body import SURFACE_ROWS
from wentry_cli.cavity.region import Region, transmission
from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

STEP_PX = 5  # of the outermost dark pixel on either side, between two rows
SEARCHED_ROWS = 3  # above the step and below it: blur, and an underside that leans
COLUMNS, FEWEST_COLUMNS = 16, 5
LEDGE_RATIO = 3  # of the step to what the wall leans in the row below: less is a wall that bends
CLEAR_BLURS = 4.0  # so high the gap beside a ledge must be for its edge to be its own
SPOILED_BLURS, HIDDEN_BLURS = 2.5, 0.5  # so far its blur reaches into the narrower wall, and so far it hides it
OUTSIDE_BLURS = 3.0  # so far outside of the narrower wall an edge is looked for
WALL_ROWS = 4  # behind these, from which its lean is taken
SHARE_STEPS = 40
DARKEST = 0.15  # of the contrast
STEEPEST_LEAN, SCATTER_PX = 0.25, 0.25  # of a ledge: row per column, and about its line


@compiled
def find_ledges(region: Region, spans: tuple[Ints, Ints], light: tuple[float, float], blur: float) -> Floats:
    """Return the rows (m,) of the ledges, to a fraction of a pixel, from the top down; rows of ``region``.

    ``spans`` are the first and the last column of the dark body per row, -1 where there is none, ``light`` the level
    of the ground and of the dark, ``blur`` the standard deviation of the blur, px. A ledge ends where both sides have
    stepped inward. Its row is read down the columns beside the narrower wall, where the gap is high enough, and
    continued to that wall. What is so near the surface that its band may hide it is left out.
    """
    first, last = spans
    found, count = np.empty(first.size), 0
    for row in range(SURFACE_ROWS, first.size - 1):
        if min(first[row - 1], first[row], first[row + 1]) < 0:
            continue
        if _is_ledge(spans, row):
            left = _side_of(region, (first[row], first[row - 1]), row, (*light, blur))
            right = _side_of(region, (last[row], last[row - 1]), row, (*light, blur))
            at = 0.5 * (left + right) if math.isfinite(left + right) else left if math.isfinite(left) else right
            if math.isfinite(at):
                found[count] = at
                count += 1
    return found[:count]


@compiled
def _is_ledge(spans: tuple[Ints, Ints], row: int) -> bool:
    """Whether both sides step inward in ``row``, by far more than they lean in the row below."""
    first, last = spans
    step = min(first[row] - first[row - 1], last[row - 1] - last[row])
    lean = max(abs(first[row + 1] - first[row]), abs(last[row] - last[row + 1]))
    return bool(step >= max(STEP_PX, LEDGE_RATIO * lean))


@compiled
def mend_beside(
    region: Region, walls: tuple[Floats, Floats], ledges: Floats, light: tuple[float, float], blur: float
) -> None:
    """Find the edges anew in the rows that the blur of a ledge darkens; infinite, left and right, where it hides them.

    A point of the wall below a ledge receives the light of the wedge between both: of a blur that is normal, the share
    that falls below the ledge and beside the wall. ``walls`` are the edges (n,) at half of the ``light`` (of the ground
    and of the dark), from which the lean of the wall is taken.
    """
    (ground, dark), (left, right) = light, walls
    for ledge in ledges:
        clear = math.floor(ledge + SPOILED_BLURS * blur) + 1
        if clear + WALL_ROWS >= left.size:
            continue
        away = math.ceil(OUTSIDE_BLURS * blur)
        start = left[clear] - away, right[clear] + away
        lean = 0.5 * (right[clear + WALL_ROWS] - left[clear + WALL_ROWS] - right[clear] + left[clear]) / WALL_ROWS
        for row in range(max(math.ceil(ledge - HIDDEN_BLURS * blur), 0), clear):
            left[row], right[row] = -np.inf, np.inf
            if row - ledge > HIDDEN_BLURS * blur and math.isfinite(lean):
                level = dark + (ground - dark) * _share((row - ledge) / blur, lean)
                _edges_at(region, walls, row, (int(start[0]), int(start[1]) + 1), level)


@compiled
def _edges_at(region: Region, walls: tuple[Floats, Floats], row: int, start: tuple[int, int], level: float) -> None:
    """The edges of a row at ``level``, looked for inwards from the columns ``start``; both or none."""
    found = np.full(2, np.nan)
    middle = (start[0] + start[1]) // 2
    for side in range(2):
        step = 1 if side == 0 else -1
        for column in range(start[side], middle, step):
            if min(column, column + step) < 0 or max(column, column + step) >= region.columns:
                break
            outside, inside = transmission(region, row, column), transmission(region, row, column + step)
            if inside < level <= outside:
                found[side] = column + step * (outside - level) / (outside - inside)
                break
    if np.isfinite(found).all():
        walls[0][row], walls[1][row] = found[0], found[1]


@compiled
def _share(below: float, lean: float) -> float:
    """Share of a normal blur that falls below a ledge and beside a wall through a point, ``below`` of it.

    The wall leans by ``lean`` columns a row; ``below`` is in standard deviations.
    """
    step = (below + 4.0) / SHARE_STEPS
    total = 0.0
    for k in range(SHARE_STEPS):
        away = (k + 0.5) * step - below
        total += math.exp(-0.5 * away * away) * 0.5 * math.erfc(lean * away / math.sqrt(2.0))
    return total * step / math.sqrt(2.0 * math.pi)


@compiled
def _side_of(region: Region, columns: tuple[int, int], row: int, light: tuple[float, float, float]) -> float:
    """Row of one side of a ledge at the narrower wall, by a line through its rows in the nearest columns that tell.

    ``columns`` are that of the narrower wall in ``row``, the first below the ledge, and that of the wider above it.
    """
    inner, outer = columns
    step = 1 if outer > inner else -1
    n, s1, s2, t0, t1, t2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for away in range(1, abs(outer - inner)):
        at = _edge_down(region, inner + step * away, row, light)
        if math.isnan(at):
            continue
        n, s1, s2 = n + 1.0, s1 + away, s2 + away * away
        t0, t1, t2 = t0 + at, t1 + at * away, t2 + at * at
        if n >= COLUMNS:
            break
    if n < FEWEST_COLUMNS:
        return math.nan
    lean = (n * t1 - s1 * t0) / (n * s2 - s1 * s1)
    level = (t0 - lean * s1) / n
    scatter = math.sqrt(max((t2 - level * t0 - lean * t1) / n, 0.0))
    return level if abs(lean) <= STEEPEST_LEAN and scatter <= SCATTER_PX else math.nan


@compiled
def _edge_down(region: Region, column: int, near: int, light: tuple[float, float, float]) -> float:
    """Where a column rises to the half level about the row ``near``; NaN where that is not clear.

    It is clear where the column stays bright for as many rows as blur would fill from the other side, and where the
    wall above is dark beyond the blur: no edge of the bright core.
    """
    ground, dark, blur = light
    half, darkest = 0.5 * (ground + dark), dark + DARKEST * (ground - dark)
    clear, above = math.ceil(CLEAR_BLURS * blur), math.ceil(2.0 * blur)
    for row in range(max(near - SEARCHED_ROWS, 0), min(near + SEARCHED_ROWS, region.levels.shape[0] - 1 - clear)):
        inside, outside = transmission(region, row, column), transmission(region, row + 1, column)
        if inside < half <= outside:
            if row < above or not transmission(region, row - above, column) <= darkest:
                return math.nan
            for beyond in range(row + 2, row + 2 + clear):
                if beyond >= region.levels.shape[0] or not transmission(region, beyond, column) >= half:
                    return math.nan
            return row + (half - inside) / (outside - inside)
    return math.nan
