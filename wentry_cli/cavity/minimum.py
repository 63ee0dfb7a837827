"""Minima of a width profile: where they are, how deep, and their vertex when they are smooth, kinked or a ledge."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.ledge_vertex import BLURRED_ROWS, LEDGE_PX, Vertex, continue_to_ledge
from wentry_cli.cavity.polynomial import fit_polynomial, slope_of, value_of
from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]

HALF_WINDOW, LONGEST_WINDOW = 4, 25  # rows on either side of a minimum that a smooth vertex is taken from
RISE_PX = 1.0
CUBIC_PX = 0.15  # a greater misfit of a radius: the wall bends more than a cubic
SIDE_ROWS = 9  # up to which each side of a kink is read, beyond the blurred ones
BLUR_PX = 1.2  # of the image and of the smoothing along the wall
BLUR_DOUBT = 0.25  # of what blur adds: it and the curvature are known to a tenth each, and blur has no sharp bounds
CLEAR_KINK, LEAST_ROUNDING_PX = 2.0, 0.15  # in units of the noise, and in pixels: less is no kink
KINK_TRIALS = 81  # places within the blurred rows


@compiled
def interior_minima(width: Floats) -> NDArray[np.int64]:
    """Return the middle of every lowest run of equal widths that is lower than both of its neighbours."""
    found = np.empty(width.size, np.int64)
    count, start = 0, 0
    for index in range(1, width.size - 1 if width.size >= 5 else 0):
        if width[index] != width[index - 1]:
            start = index
        if start > 0 and width[start - 1] > width[index] < width[index + 1]:
            found[count] = (start + index) // 2
            count += 1
    return found[:count]


@compiled
def prominence_of(width: Floats, index: int) -> float:
    """Return how far the width rises on the lower of both sides before it falls below ``width[index]``."""
    lower = math.inf
    for step in (-1, 1):
        rise = 0.0
        at = index + step
        while 0 <= at < width.size and not width[at] < width[index]:
            rise = max(rise, width[at] - width[index])
            at += step
        lower = min(lower, rise)
    return lower


@compiled
def find_vertex(y: Floats, width: Floats, index: int, ledges: Floats, doubts: tuple[float, float]) -> Vertex:
    """Return row and width of the minimum at ``index`` of ``width`` (n,) at the rows ``y``, and half of the misfit.

    Smooth minima are the vertex of a cubic. Where one cavity starts inside another the wall has a kink, which blur
    rounds off: there both sides are continued to where they meet; at a ledge the side without the step is continued
    to it; ``ledges`` (m,) are the rows of steps that were measured. ``doubts`` are the standard deviation of one width
    and that of the blur along the wall, px.
    """
    noise, blur = doubts
    if width[index] == 0.0:
        return y[index], 0.0, 0.0
    ledge = continue_to_ledge(y, width, index, ledges)
    if not math.isnan(ledge[1]) or math.isnan(ledge[0]):
        return ledge
    kink = _kink(y, width, index, max(CLEAR_KINK * noise, LEAST_ROUNDING_PX))
    if not math.isnan(kink[0]):
        return kink
    return _smooth_vertex(y, width, index, blur)


@compiled
def _smooth_vertex(y: Floats, width: Floats, index: int, blur: float) -> Vertex:
    """Vertex of a cubic as far as the width rises by ``RISE_PX``: a minimum is seldom symmetric, a flat one needs rows.

    The cubic describes the square of the width: near its closure a neck is a hyperboloid. The misfit is 0 where there
    are too few rows.
    """
    low, high = _reach(width, index, -1), _reach(width, index, 1)
    if high - low < 6:
        return y[index], width[index], 0.0
    while True:
        rows, values = y[low : high + 1] - y[index], width[low : high + 1]
        cubic = fit_polynomial(rows, values**2, 3)
        squares = 0.0
        for n in range(rows.size):
            squares += (math.sqrt(max(value_of(cubic, rows[n]), 0.0)) - values[n]) ** 2
        misfit = 0.5 * math.sqrt(squares / rows.size)
        if misfit < CUBIC_PX or high - low < 6:
            break
        if width[low] > width[high]:  # a steep end is no part of the vertex
            low += 1
        else:
            high -= 1
    # of the two places where the slope vanishes, the one with the upward bend
    inside = cubic[2] ** 2 - 3.0 * cubic[1] * cubic[3]
    root = math.sqrt(inside) if inside > 0.0 else math.nan
    turning = -cubic[1] / (cubic[2] + root) if cubic[2] > 0.0 else (root - cubic[2]) / (3.0 * cubic[3])
    if not abs(turning) <= HALF_WINDOW:
        return y[index], width[index], misfit
    square = max(value_of(cubic, turning), 0.0)
    sharp = _sharpened(square, 2.0 * cubic[2] + 6.0 * cubic[3] * turning, blur)
    return y[index] + turning, sharp, math.hypot(misfit, 0.5 * BLUR_DOUBT * (math.sqrt(square) - sharp))


@compiled
def _sharpened(square: float, bend: float, blur: float) -> float:
    """Width without what blur adds where the wall is curved, from its square and the second derivative of that.

    Blur draws each wall outward by half of its curvature times the variance along it. At a vertex the curvature of the
    radius R is (R²)″/2R: in R² that is half of (R²)″ times the variance, which stays finite as the neck closes. Where
    the wall curves within the blur it is less: the half level is the median of a normal deviate and c times the square
    of another, c half of curvature times blur, and lies below the mean (Cornish and Fisher, to the third moment).
    """
    half = 0.125 * max(bend, 0.0) * blur / max(0.5 * math.sqrt(square), blur)
    share = 1.0 - 4.0 / 3.0 * half**2 / (1.0 + 2.0 * half**2)
    return math.sqrt(max(square - 0.5 * bend * blur * blur * share, 0.0))


@compiled
def _reach(width: Floats, index: int, step: int) -> int:
    """Return the last index from ``index`` on in direction ``step`` that the cubic takes in."""
    at = index
    while 0 <= at + step < width.size and abs(at + step - index) <= LONGEST_WINDOW:
        near = abs(at + step - index) <= HALF_WINDOW
        if not near and width[at + step] - width[index] > RISE_PX:
            break
        at += step
    return at


@compiled
def _side(y: Floats, width: Floats, index: int, step: int) -> Floats:
    """Parabola through the squared width of one side of a minimum beyond the blurred rows, NaN if it is too short.

    It is in rows from ``index``.
    """
    if step > 0:
        first, stop = index + BLURRED_ROWS, min(index + SIDE_ROWS + 1, width.size)
    else:
        first, stop = max(index - SIDE_ROWS, 0), index - BLURRED_ROWS + 1
    if stop - first < 5:
        return np.full(3, np.nan)
    rows, values = y[first:stop] - y[index], width[first:stop]
    if np.abs(values[1:] - values[:-1]).max() > LEDGE_PX or rows[-1] - rows[0] > 2 * SIDE_ROWS:
        return np.full(3, np.nan)
    return fit_polynomial(rows, values**2, 2)


@compiled
def _crossing_of(above: Floats, below: Floats) -> float:
    """The first row within the blurred ones behind which ``above`` falls under ``below``; NaN where there is none."""
    step = 2.0 * BLURRED_ROWS / (KINK_TRIALS - 1)
    for trial in range(KINK_TRIALS - 1):
        row, following = trial * step - BLURRED_ROWS, (trial + 1) * step - BLURRED_ROWS
        if value_of(above, row) >= value_of(below, row) and value_of(above, following) < value_of(below, following):
            return row
    return math.nan


@compiled
def _kink(y: Floats, width: Floats, index: int, least: float) -> Vertex:
    """Where the continued sides meet, with the width there; NaN where blur would round off less than ``least``."""
    above, below = _side(y, width, index, -1), _side(y, width, index, 1)
    row = _crossing_of(above, below)
    if math.isnan(row):
        return math.nan, math.nan, math.nan
    value = math.sqrt(max(value_of(below, row), 0.0))
    scale = 2.0 * max(value, 1.0)
    falls, rises = slope_of(above, row) / scale, slope_of(below, row) / scale
    # A kink of that strength is rounded off by so much; a minimum that is rounder is no kink.
    rounding = (rises - falls) * BLUR_PX / math.sqrt(2.0 * math.pi)
    if not falls < 0.0 < rises or rounding < least or not -0.5 < width[index] - value < 1.5 * rounding:
        return math.nan, math.nan, math.nan
    return y[index] + row, value, 0.05
