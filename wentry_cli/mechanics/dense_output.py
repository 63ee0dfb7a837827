"""The solution inside a step: the polynomial of order 7 of Dormand–Prince 8(5,3), and where it passes a level."""

from __future__ import annotations

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import FloatArray, IntArray
from wentry_cli.mechanics.tableau import DENSE_WEIGHTS, STAGES

MOST_ITERATIONS = 60
DENSE_COLUMN = np.nonzero(DENSE_WEIGHTS.any(axis=0))[0].astype(np.uint64)
DENSE_ENTRY = DENSE_WEIGHTS[:, DENSE_COLUMN]


@compiled
def prepare_dense(
    ends: tuple[FloatArray, FloatArray], h: float, slopes: FloatArray, read: IntArray, dense: FloatArray
) -> None:
    """Coefficients for the components ``read`` of a step of length ``h`` between the states ``ends``."""
    y, y_new = ends
    for k in range(read.size):
        c = read[k]
        change = y_new[c] - y[c]
        dense[0, c] = change
        dense[1, c] = h * slopes[0, c] - change
        dense[2, c] = 2.0 * change - h * (slopes[STAGES, c] + slopes[0, c])
        w0, w1, w2, w3 = 0.0, 0.0, 0.0, 0.0
        for j in range(DENSE_COLUMN.size):
            slope = slopes[DENSE_COLUMN[j], c]
            w0 += DENSE_ENTRY[0, j] * slope
            w1 += DENSE_ENTRY[1, j] * slope
            w2 += DENSE_ENTRY[2, j] * slope
            w3 += DENSE_ENTRY[3, j] * slope
        dense[3, c], dense[4, c], dense[5, c], dense[6, c] = h * w0, h * w1, h * w2, h * w3


@compiled
def interpolate(y: FloatArray, dense: FloatArray, c: int, theta: float) -> float:
    """Component ``c`` of the solution at the fraction ``theta`` of the step that starts at ``y``."""
    rest = 1.0 - theta
    value = dense[6, c] * theta
    value = (value + dense[5, c]) * rest
    value = (value + dense[4, c]) * theta
    value = (value + dense[3, c]) * rest
    value = (value + dense[2, c]) * theta
    value = (value + dense[1, c]) * rest
    return float((value + dense[0, c]) * theta + y[c])


@compiled
def _interpolate_with_slope(y: FloatArray, dense: FloatArray, c: int, theta: float) -> tuple[float, float]:
    """As ``interpolate``, with the derivative by the fraction; it costs no time beside the value."""
    rest = 1.0 - theta
    value, slope = dense[6, c] * theta, dense[6, c]
    for k in range(5, 0, -2):
        value += dense[k, c]
        value, slope = value * rest, slope * rest - value
        value += dense[k - 1, c]
        value, slope = value * theta, slope * theta + value
    return value + y[c], slope


@compiled
def find_passage(
    y: FloatArray, dense: FloatArray, c: int, level: float, span: tuple[float, float], accuracy: float
) -> float:
    """Fraction of the step, within ``span``, where component ``c`` passes ``level``; Newton within a bracket."""
    low, high = span
    f_low = interpolate(y, dense, c, low) - level
    f_high = interpolate(y, dense, c, high) - level
    if f_low == 0.0 or f_low * f_high > 0.0:
        return low
    theta = low + (high - low) * f_low / (f_low - f_high)
    for _ in range(MOST_ITERATIONS):
        value, slope = _interpolate_with_slope(y, dense, c, theta)
        if (value - level) * f_low > 0.0:
            low = theta
        else:
            high = theta
        better = theta - (value - level) / slope
        if not low <= better <= high:
            better = 0.5 * (low + high)
        if abs(better - theta) < accuracy:
            return better
        theta = better
    return theta
