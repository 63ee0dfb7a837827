"""The stages of a step of Dormand–Prince 8(5,3) for the oscillating sphere, and the error of the step."""

from __future__ import annotations

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import (
    MOBILITY,
    STATE_SIZE,
    FloatArray,
    GroupValues,
    mobility,
    sensitivity_derivatives,
    state_rates,
)
from wentry_cli.mechanics.tableau import ERROR_WEIGHTS, STAGE_WEIGHTS, STAGES, STAGES_DENSE

Work = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # new state, slopes, dense coefficients, marks

# The weights that are not zero, row by row; unsigned columns spare the compiled code a test for negative indices. That
# of the stage just before stands apart, since its slope is still in registers and need not be waited for.
_ROWS, _COLUMNS = np.nonzero(STAGE_WEIGHTS - np.diag(np.diag(STAGE_WEIGHTS, -1), -1))
ENTRY_COLUMN = _COLUMNS.astype(np.uint64)
ENTRY_WEIGHT = STAGE_WEIGHTS[_ROWS, _COLUMNS]
ROW_START = np.searchsorted(_ROWS, np.arange(STAGES_DENSE + 1))
LAST_WEIGHT = np.concatenate([[0.0], np.diag(STAGE_WEIGHTS, -1)])
ERROR_COLUMN = np.nonzero(ERROR_WEIGHTS.any(axis=0))[0].astype(np.uint64)
ERROR_ENTRY = ERROR_WEIGHTS[:, ERROR_COLUMN]


@compiled
def right_side(state: FloatArray, groups: GroupValues, out: FloatArray) -> bool:
    """Time derivative of the whole ``state``, sensitivities too where it has them; False outside λ > 0, x > −1."""
    a, v, x = state[0], state[1], state[2]
    if not (a > 0.0 and x > -1.0):
        return False
    out[0] = v
    out[1], out[2], out[3], out[4] = state_rates(a, v, x, state[MOBILITY], groups)
    if state.size > STATE_SIZE:
        sensitivity_derivatives(state, groups, out)
    return True


@compiled
def _state_stages(
    y: FloatArray, h: float, groups: GroupValues, rows: tuple[int, int], work: FloatArray, slopes: FloatArray
) -> bool:
    """``evaluate_stages`` without sensitivities: the state stays in registers, which halves the time."""
    y0, y1, y2, y3, y4 = y[0], y[1], y[2], y[3], y[4]
    last = slopes[rows[0] - 1]
    k0, k1, k2, k3, k4 = last[0], last[1], last[2], last[3], last[4]
    for i in range(rows[0], rows[1]):
        w0, w1, w2, w3, w4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(ROW_START[i], ROW_START[i + 1]):
            j, weight = ENTRY_COLUMN[k], ENTRY_WEIGHT[k]
            w0 += weight * slopes[j, 0]
            w1 += weight * slopes[j, 1]
            w2 += weight * slopes[j, 2]
            w3 += weight * slopes[j, 3]
            w4 += weight * slopes[j, 4]
        weight = LAST_WEIGHT[i]
        a, v, x = y0 + h * (w0 + weight * k0), y1 + h * (w1 + weight * k1), y2 + h * (w2 + weight * k2)
        if not (a > 0.0 and x > -1.0):
            return False
        mobile = mobility(x, groups) if i == STAGES else y4 + h * (w4 + weight * k4)
        work[0], work[1], work[2], work[3], work[4] = a, v, x, y3 + h * (w3 + weight * k3), mobile
        k0 = v
        k1, k2, k3, k4 = state_rates(a, v, x, mobile, groups)
        slopes[i, 0], slopes[i, 1], slopes[i, 2], slopes[i, 3], slopes[i, 4] = k0, k1, k2, k3, k4
    return True


@compiled
def evaluate_stages(
    y: FloatArray, h: float, groups: GroupValues, rows: tuple[int, int], work: FloatArray, slopes: FloatArray
) -> bool:
    """Evaluate the stages ``rows[0]`` to ``rows[1]`` − 1 of a step of length ``h``.

    The argument of the last stage stays in ``work``. Four components at a time stay in registers. At the end of the
    step A* cⁿ is taken from x anew, so that its error does not add up.
    """
    if y.size == STATE_SIZE:
        return _state_stages(y, h, groups, rows, work, slopes)
    for i in range(rows[0], rows[1]):
        newest = slopes[i - 1]
        for c in range(0, y.size, 4):
            w0, w1, w2, w3 = 0.0, 0.0, 0.0, 0.0
            for k in range(ROW_START[i], ROW_START[i + 1]):
                j, weight = ENTRY_COLUMN[k], ENTRY_WEIGHT[k]
                w0 += weight * slopes[j, c]
                w1 += weight * slopes[j, c + 1]
                w2 += weight * slopes[j, c + 2]
                w3 += weight * slopes[j, c + 3]
            weight = LAST_WEIGHT[i]
            work[c] = y[c] + h * (w0 + weight * newest[c])
            work[c + 1] = y[c + 1] + h * (w1 + weight * newest[c + 1])
            work[c + 2] = y[c + 2] + h * (w2 + weight * newest[c + 2])
            work[c + 3] = y[c + 3] + h * (w3 + weight * newest[c + 3])
        if i == STAGES and work[2] > -1.0:
            work[MOBILITY] = mobility(work[2], groups)
        if not right_side(work, groups, slopes[i]):
            return False
    return True


@compiled
def _error(y: FloatArray, y_new: FloatArray, h: float, tolerance: float, slopes: FloatArray) -> float:
    """Scaled error of a step, 1 at the tolerance; may be inf or nan, which the caller reads as too large."""
    third, fifth = 0.0, 0.0
    for c in range(y.size):
        e3, e5 = 0.0, 0.0
        for k in range(ERROR_COLUMN.size):
            slope = slopes[ERROR_COLUMN[k], c]
            e3 += ERROR_ENTRY[0, k] * slope
            e5 += ERROR_ENTRY[1, k] * slope
        over = 1.0 / (tolerance * (1.0 + max(abs(y[c]), abs(y_new[c]))))
        third += (e3 * over) ** 2
        fifth += (e5 * over) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return float(abs(h) * fifth / np.sqrt((fifth + 0.01 * third) * y.size))


@compiled
def attempt(y: FloatArray, h: float, groups: GroupValues, tolerance: float, work: Work) -> float:
    """Try one step into ``work[0]``; its scaled error, infinite where a stage left λ > 0, λ_p > 0."""
    if not evaluate_stages(y, h, groups, (1, STAGES + 1), work[0], work[1]):
        return np.inf
    return _error(y, work[0], h, tolerance, work[1])
