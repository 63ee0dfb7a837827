"""The solution inside a step: the polynomial of order 7 of Dormand–Prince 8(5,3), and where it passes a level."""

from __future__ import annotations

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import STATE_SIZE, FloatArray
from wentry_cli.mechanics.stages import DENSE, NEW, SLOPES, STATE
from wentry_cli.mechanics.tableau import DENSE_WEIGHTS, STAGES

MOST_ITERATIONS = 60
SAMPLED = 3  # λ, its rate and x: what events need, and what every trajectory is sampled for
_COLUMNS = np.nonzero(DENSE_WEIGHTS.any(axis=0))[0]
DENSE_ROW = (SLOPES + _COLUMNS).astype(np.uint64)
DENSE_ENTRY = np.ascontiguousarray(DENSE_WEIGHTS[:, _COLUMNS])
FIRST, LAST = SLOPES, SLOPES + STAGES


@compiled
def component(k: int) -> int:
    """The ``k``-th component that is sampled: the first three of the state, then the λ of each sensitivity."""
    return k if k < SAMPLED else STATE_SIZE + SAMPLED * (k - SAMPLED)


@compiled
def prepare_dense(work: FloatArray, h: float, count: int) -> None:
    """Coefficients inside a step of length ``h`` for the first ``count`` components that are sampled."""
    for k in range(count):
        c = component(k)
        change = work[NEW, c] - work[STATE, c]
        w0, w1, w2, w3 = 0.0, 0.0, 0.0, 0.0
        for j in range(DENSE_ROW.size):
            slope = work[DENSE_ROW[j], c]
            w0 += DENSE_ENTRY[0, j] * slope
            w1 += DENSE_ENTRY[1, j] * slope
            w2 += DENSE_ENTRY[2, j] * slope
            w3 += DENSE_ENTRY[3, j] * slope
        work[DENSE, c] = change
        work[DENSE + 1, c] = h * work[FIRST, c] - change
        work[DENSE + 2, c] = 2.0 * change - h * (work[LAST, c] + work[FIRST, c])
        work[DENSE + 3, c], work[DENSE + 4, c], work[DENSE + 5, c], work[DENSE + 6, c] = h * w0, h * w1, h * w2, h * w3


@compiled
def interpolate(work: FloatArray, c: int, theta: float) -> float:
    """Component ``c`` of the solution at the fraction ``theta`` of the step."""
    rest = 1.0 - theta
    value = work[DENSE + 6, c] * theta
    value = (value + work[DENSE + 5, c]) * rest
    value = (value + work[DENSE + 4, c]) * theta
    value = (value + work[DENSE + 3, c]) * rest
    value = (value + work[DENSE + 2, c]) * theta
    value = (value + work[DENSE + 1, c]) * rest
    return float((value + work[DENSE, c]) * theta + work[STATE, c])


@compiled
def _interpolate_with_slope(work: FloatArray, c: int, theta: float) -> tuple[float, float]:
    """As ``interpolate``, with the derivative by the fraction; it costs no time beside the value."""
    rest = 1.0 - theta
    value, slope = work[DENSE + 6, c] * theta, work[DENSE + 6, c]
    for k in range(5, 0, -2):
        value += work[DENSE + k, c]
        value, slope = value * rest, slope * rest - value
        value += work[DENSE + k - 1, c]
        value, slope = value * theta, slope * theta + value
    return value + work[STATE, c], slope


@compiled
def find_passage(work: FloatArray, c: int, level: float, low: float, high: float, accuracy: float) -> float:
    """Fraction of the step, from ``low`` to ``high``, where component ``c`` passes ``level``; Newton in a bracket."""
    f_low = interpolate(work, c, low) - level
    f_high = interpolate(work, c, high) - level
    if f_low == 0.0 or f_low * f_high > 0.0:
        return low
    theta = low + (high - low) * f_low / (f_low - f_high)
    for _ in range(MOST_ITERATIONS):
        value, slope = _interpolate_with_slope(work, c, theta)
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
