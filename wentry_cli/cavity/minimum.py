"""Minima of a width profile: where they are, how deep, and their vertex when they are smooth, kinked or a ledge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HALF_WINDOW, LONGEST_WINDOW = 4, 25  # rows on either side of a minimum that a smooth vertex is taken from
RISE_PX = 1.0
BLURRED_ROWS, SIDE_ROWS = 2, 9  # a kink is blurred within the first; each side is read up to the second
BLUR_PX = 1.2  # of the image and of the smoothing along the wall
LEDGE_PX = 6.0  # a step of the width between two rows
LEDGE_UNC_PX = 0.7
CLEAR_KINK, LEAST_ROUNDING_PX = 2.0, 0.15  # in units of the noise, and in pixels: less is no kink


def interior_minima(width: Floats) -> list[int]:
    """Return the middle of every lowest run of equal widths that is lower than both of its neighbours."""
    if width.size < 5:
        return []
    change = np.flatnonzero(np.diff(width))
    starts = np.concatenate([[0], change + 1])
    ends = np.concatenate([change, [width.size - 1]])
    level = width[starts]
    inner = np.flatnonzero((level[1:-1] < level[:-2]) & (level[1:-1] < level[2:])) + 1
    return [int((starts[i] + ends[i]) // 2) for i in inner]


def prominence_of(width: Floats, index: int) -> float:
    """Return how far the width rises on the lower of both sides before it falls below ``width[index]``."""
    rises = []
    for side in (width[:index][::-1], width[index + 1 :]):
        deeper = np.flatnonzero(side < width[index])
        reach = side[: deeper[0]] if deeper.size else side
        rises.append(float(reach.max() - width[index]) if reach.size else 0.0)
    return min(rises)


def find_vertex(y: Floats, width: Floats, index: int, *, noise: float) -> tuple[float, float, float]:
    """Return row and width of the minimum at ``index`` of ``width`` (n,) at the rows ``y``, and half of the misfit.

    Smooth minima are the vertex of a cubic. Where one cavity starts inside another the wall has a kink, which blur
    rounds off: there both sides are continued to where they meet; at a ledge the side without the step is continued
    to it. ``noise`` is the standard deviation of one width.
    """
    if width[index] == 0.0:
        return float(y[index]), 0.0, 0.0
    ledge = _ledge(y, width, index)
    if ledge is not None:
        return ledge
    kink = _kink(y, width, index, max(CLEAR_KINK * noise, LEAST_ROUNDING_PX))
    if kink is not None:
        return kink
    row, narrowest, misfit = _smooth_vertex(y, width, index)
    return row, narrowest, float(np.nan_to_num(misfit))


def _smooth_vertex(y: Floats, width: Floats, index: int) -> tuple[float, float, float]:
    """Vertex of a cubic as far as the width rises by ``RISE_PX``: a minimum is seldom symmetric, a flat one needs rows.

    The cubic describes the square of the width: near its closure a neck is a hyperboloid. The misfit is NaN where
    there are too few rows.
    """
    low, high = _reach(width, index, -1), _reach(width, index, 1)
    rows, values = y[low : high + 1] - y[index], width[low : high + 1]
    if rows.size < 7:
        return float(y[index]), float(width[index]), float("nan")
    cubic = np.polyfit(rows, values**2, 3)
    fitted = np.sqrt(np.maximum(np.polyval(cubic, rows), 0.0))
    misfit = 0.5 * float(np.sqrt(np.mean((fitted - values) ** 2)))
    slope = np.polyder(cubic)
    roots = np.roots(slope)
    level = np.asarray(roots[np.isreal(roots)].real, dtype=np.float64)
    turning: Floats = level[np.polyval(np.polyder(slope), level) > 0.0]
    if turning.size == 0 or abs(turning[0]) > HALF_WINDOW:
        return float(y[index]), float(width[index]), misfit
    narrowest = float(np.sqrt(max(float(np.polyval(cubic, turning[0])), 0.0)))
    return float(y[index] + turning[0]), narrowest, misfit


def _reach(width: Floats, index: int, step: int) -> int:
    """Return the last index from ``index`` on in direction ``step`` that the cubic takes in."""
    at = index
    while 0 <= at + step < width.size and abs(at + step - index) <= LONGEST_WINDOW:
        near = abs(at + step - index) <= HALF_WINDOW
        if not near and width[at + step] - width[index] > RISE_PX:
            break
        at += step
    return at


def _side(y: Floats, width: Floats, index: int, step: int) -> Floats | None:
    """Parabola through the squared width of one side of a minimum beyond the blurred rows, None if it is too short.

    It is in rows from ``index``.
    """
    far = index + step * SIDE_ROWS
    part = slice(index + BLURRED_ROWS, far + 1) if step > 0 else slice(max(far, 0), max(index - BLURRED_ROWS + 1, 0))
    rows, values = y[part] - y[index], width[part]
    if rows.size < 5 or np.abs(np.diff(values)).max() > LEDGE_PX or np.ptp(rows) > 2 * SIDE_ROWS:
        return None
    return np.asarray(np.polyfit(rows, values**2, 2))


def _kink(y: Floats, width: Floats, index: int, least: float) -> tuple[float, float, float] | None:
    """Where the continued sides meet, with the width there; None where blur would round off less than ``least``."""
    above, below = _side(y, width, index, -1), _side(y, width, index, 1)
    if above is None or below is None:
        return None
    rows = np.linspace(-BLURRED_ROWS, BLURRED_ROWS, 81)
    gap = np.polyval(above, rows) - np.polyval(below, rows)
    meets = np.flatnonzero((gap[:-1] >= 0.0) & (gap[1:] < 0.0))
    if meets.size == 0:
        return None
    row = float(rows[meets[0]])
    value = float(np.sqrt(max(float(np.polyval(below, row)), 0.0)))
    scale = 2.0 * max(value, 1.0)
    falls = float(np.polyval(np.polyder(above), row)) / scale
    rises = float(np.polyval(np.polyder(below), row)) / scale
    # A kink of that strength is rounded off by so much; a minimum that is rounder is no kink.
    rounding = (rises - falls) * BLUR_PX / np.sqrt(2.0 * np.pi)
    if not falls < 0.0 < rises or rounding < least or not -0.5 < width[index] - value < 1.5 * rounding:
        return None
    return float(y[index] + row), value, 0.05


def _ledge(y: Floats, width: Floats, index: int) -> tuple[float, float, float] | None:
    """Continue the side without a step to the step, where one lies within the blurred rows of the minimum.

    Blur hides how the wall bends right below the step, hence the large uncertainty.
    """
    for step in (-1, 1):
        for near in range(BLURRED_ROWS + 1):
            here, there = index + step * near, index + step * (near + 1)
            if not 0 <= there < width.size or width[there] - width[here] < LEDGE_PX:
                continue
            part = slice(index + 1, index + 7) if step < 0 else slice(max(index - 6, 0), index)
            if width[part].size < 5:
                return None
            row = 0.5 * float(y[here] + y[there] - 2.0 * y[index])
            value = float(np.polyval(np.polyfit(y[part] - y[index], width[part], 2), row))
            return float(y[index] + row), float(np.clip(value, 0.0, width[index])), LEDGE_UNC_PX
    return None
