"""The neck at a ledge: the wall beside it, continued to its row."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.polynomial import fit_polynomial, value_of
from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]

BLURRED_ROWS = 2  # about a minimum: within them a kink is blurred, and a ledge lies
LEDGE_PX = 6.0  # a step of the width between two rows
LEDGE_UNC_PX = 0.7
LEDGE_ROWS, FEWEST_LEDGE_ROWS = 8, 4  # of the wall beside it, from which it is continued
FORETOLD_PX = 0.5  # so far the width may lie off what the rows before foretell
STEP_TO_LEAN = 1.5  # of a ledge whose row was not measured
LEDGE_DOUBT = 0.3  # of the width in the first row: what is continued with a greater one tells nothing
LEDGE_ROW_UNC_PX = 0.2  # of a row that was read down the columns, with what its blur hides of the wall

Vertex = tuple[float, float, float]
"""Row and width of a minimum and half of the misfit, px; a row of NaN where there is none of that kind."""


@compiled
def continue_to_ledge(y: Floats, width: Floats, index: int, ledges: Floats) -> Vertex:
    """Continue the side without a step to the step; a row without a width where there is none, NaN where it cannot be.

    The step lies within the blurred rows of the minimum. What is continued is the square of the width, which is smooth
    where the width runs to zero. Its uncertainty holds that of the row of the step.
    """
    for step in (-1, 1):
        for near in range(BLURRED_ROWS + 1):
            here, there = index + step * near, index + step * (near + 1)
            if not 0 <= there < width.size or width[there] - width[here] < LEDGE_PX:
                continue
            row, row_unc = _row_of_ledge(ledges, y[there], y[here])
            beyond = there + step
            if row_unc > LEDGE_ROW_UNC_PX and 0 <= beyond < width.size:
                leans = (width[beyond] - width[there]) / abs(y[beyond] - y[there])
                if (width[there] - width[here]) / abs(y[there] - y[here]) < STEP_TO_LEAN * leans:
                    continue  # a wall that bends
            value, slope, misfit = _continued(y, width, here, -step, row)
            unc = math.hypot(0.5 * slope / max(value, 2.0) * row_unc, misfit)
            if row_unc > LEDGE_ROW_UNC_PX:
                unc = math.hypot(unc, 2.0 * LEDGE_UNC_PX)  # nor were the rows cleared of its blur
            if not unc < LEDGE_DOUBT * width[here]:
                return math.nan, math.nan, math.nan
            return row, value, 0.5 * unc
    return y[index], math.nan, math.nan


@compiled
def _continued(y: Floats, width: Floats, here: int, step: int, row: float) -> Vertex:
    """Width continued from the rows from ``here`` on in direction ``step`` to ``row``, slope of its square, its misfit.

    A parabola takes in row after row while it foretells the next one: the wall has a kink where it meets the sphere.
    The misfit is the change by the last row.
    """
    seen = _rows_beside(y, here, step)
    if seen < FEWEST_LEDGE_ROWS:
        return math.nan, math.nan, math.nan
    side = _side_from(y, width, (here, step, FEWEST_LEDGE_ROWS - 1), row)
    before, value = math.nan, math.sqrt(max(side[0], 0.0))
    for count in range(FEWEST_LEDGE_ROWS, seen + 1):
        before, side = value, _side_from(y, width, (here, step, count), row)
        value = math.sqrt(max(side[0], 0.0))
        following = here + step * count
        if count < seen:
            foretold = math.sqrt(max(value_of(side, y[following] - row), 0.0))
            if abs(foretold - width[following]) > FORETOLD_PX:
                break
    return value, side[1], abs(value - before)


@compiled
def _side_from(y: Floats, width: Floats, rows: tuple[int, int, int], row: float) -> Floats:
    """Parabola in rows from ``row`` through the squared widths; ``rows`` are the first, the direction and how many."""
    here, step, count = rows
    first, stop = (here, here + count) if step > 0 else (here - count + 1, here + 1)
    return fit_polynomial(y[first:stop] - row, width[first:stop] ** 2, 2)


@compiled
def _rows_beside(y: Floats, here: int, step: int) -> int:
    """How many rows follow each other from ``here`` on in direction ``step``, of as many as are continued."""
    count = 1
    while count < LEDGE_ROWS and 0 <= here + step * count < y.size:
        if abs(y[here + step * count] - y[here + step * (count - 1)]) > 1.5:
            break
        count += 1
    return count


@compiled
def _row_of_ledge(ledges: Floats, wide: float, narrow: float) -> tuple[float, float]:
    """Row of the ledge between two rows and its uncertainty; midway where none was measured there."""
    for ledge in ledges:
        if min(wide, narrow) - 1.0 <= ledge <= max(wide, narrow) + 1.0:
            return ledge, LEDGE_ROW_UNC_PX
    return 0.5 * (wide + narrow), abs(wide - narrow) / math.sqrt(12.0)
