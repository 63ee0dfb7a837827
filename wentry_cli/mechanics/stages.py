"""The stages of a step of Dormand–Prince 8(5,3) for the oscillating sphere, and the error of the step.

What a step works with are the rows of one array, because each array that a compiled function takes out of a tuple or
cuts out of another costs two locked counts of its references, as much time as half a stage.
"""

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
from wentry_cli.mechanics.tableau import DENSE_ORDER, ERROR_WEIGHTS, STAGE_WEIGHTS, STAGES, STAGES_DENSE

# Rows of the work of a step: state, state at its end, slopes, coefficients inside it, argument of a stage, marks.
STATE, NEW, SLOPES = 0, 1, 2
DENSE = SLOPES + STAGES_DENSE
ARGUMENT = DENSE + DENSE_ORDER
MARKS = ARGUMENT + 1
MOST_MARKS = 4  # the most events of a step, and one more
WORK_ROWS = MARKS + MOST_MARKS

# The weights that are not zero, row by row; unsigned numbers spare the compiled code a test for negative indices. That
# of the stage just before stands apart, since its slope is still in registers and need not be waited for.
_ROWS, _COLUMNS = np.nonzero(STAGE_WEIGHTS - np.diag(np.diag(STAGE_WEIGHTS, -1), -1))
ENTRY_ROW = (SLOPES + _COLUMNS).astype(np.uint64)
ENTRY_WEIGHT = STAGE_WEIGHTS[_ROWS, _COLUMNS]
ROW_START = np.searchsorted(_ROWS, np.arange(STAGES_DENSE + 1))
LAST_WEIGHT = np.concatenate([[0.0], np.diag(STAGE_WEIGHTS, -1)])
_COLUMNS = np.nonzero(ERROR_WEIGHTS.any(axis=0))[0]
ERROR_ROW = (SLOPES + _COLUMNS).astype(np.uint64)
ERROR_ENTRY = np.ascontiguousarray(ERROR_WEIGHTS[:, _COLUMNS])


@compiled
def right_side(work: FloatArray, at: int, to: int, groups: GroupValues) -> bool:
    """Time derivative of the whole state in row ``at`` into row ``to``; False outside λ > 0, x > −1.

    Sensitivities are among it where the rows hold them.
    """
    a, v, x = work[at, 0], work[at, 1], work[at, 2]
    sound = a > 0.0 and x > -1.0
    if sound:
        work[to, 0] = v
        work[to, 1], work[to, 2], work[to, 3], work[to, 4] = state_rates(a, v, x, work[at, MOBILITY], groups)
        if work.shape[1] > STATE_SIZE:
            sensitivity_derivatives(work, at, to, groups)
    return bool(sound)


@compiled
def _state_stages(work: FloatArray, h: float, groups: GroupValues, first: int, stop: int) -> bool:
    """``evaluate_stages`` without sensitivities: the state stays in registers, which halves the time."""
    y0, y1, y2, y3, y4 = work[STATE, 0], work[STATE, 1], work[STATE, 2], work[STATE, 3], work[STATE, 4]
    j, sound = SLOPES + first - 1, True
    k0, k1, k2, k3, k4 = work[j, 0], work[j, 1], work[j, 2], work[j, 3], work[j, 4]
    for i in range(first, stop):
        w0, w1, w2, w3, w4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(ROW_START[i], ROW_START[i + 1]):
            row, weight = ENTRY_ROW[k], ENTRY_WEIGHT[k]
            w0 += weight * work[row, 0]
            w1 += weight * work[row, 1]
            w2 += weight * work[row, 2]
            w3 += weight * work[row, 3]
            w4 += weight * work[row, 4]
        weight = LAST_WEIGHT[i]
        a, v, x = y0 + h * (w0 + weight * k0), y1 + h * (w1 + weight * k1), y2 + h * (w2 + weight * k2)
        sound = a > 0.0 and x > -1.0
        if not sound:
            break
        if i == STAGES:
            mobile = mobility(x, groups)
            work[NEW, 0], work[NEW, 1], work[NEW, 2], work[NEW, 4] = a, v, x, mobile
            work[NEW, 3] = y3 + h * (w3 + weight * k3)
        else:
            mobile = y4 + h * (w4 + weight * k4)
        k0 = v
        k1, k2, k3, k4 = state_rates(a, v, x, mobile, groups)
        j = SLOPES + i
        work[j, 0], work[j, 1], work[j, 2], work[j, 3], work[j, 4] = k0, k1, k2, k3, k4
    return sound


@compiled
def evaluate_stages(work: FloatArray, h: float, groups: GroupValues, first: int, stop: int) -> bool:
    """Evaluate the stages ``first`` to ``stop`` − 1 of a step of length ``h``; False where one leaves λ > 0, x > −1.

    The argument of the stage that is the step itself is the row ``NEW``. Four components at a time stay in registers.
    At the end of the step A* cⁿ is taken from x anew, so that its error does not add up.
    """
    size = work.shape[1]
    if size == STATE_SIZE:
        return _state_stages(work, h, groups, first, stop)
    for i in range(first, stop):
        newest, to = SLOPES + i - 1, NEW if i == STAGES else ARGUMENT
        for c in range(0, size, 4):
            w0, w1, w2, w3 = 0.0, 0.0, 0.0, 0.0
            for k in range(ROW_START[i], ROW_START[i + 1]):
                row, weight = ENTRY_ROW[k], ENTRY_WEIGHT[k]
                w0 += weight * work[row, c]
                w1 += weight * work[row, c + 1]
                w2 += weight * work[row, c + 2]
                w3 += weight * work[row, c + 3]
            weight = LAST_WEIGHT[i]
            work[to, c] = work[STATE, c] + h * (w0 + weight * work[newest, c])
            work[to, c + 1] = work[STATE, c + 1] + h * (w1 + weight * work[newest, c + 1])
            work[to, c + 2] = work[STATE, c + 2] + h * (w2 + weight * work[newest, c + 2])
            work[to, c + 3] = work[STATE, c + 3] + h * (w3 + weight * work[newest, c + 3])
        if i == STAGES and work[to, 2] > -1.0:
            work[to, MOBILITY] = mobility(work[to, 2], groups)
        if not right_side(work, to, SLOPES + i, groups):
            return False
    return True


@compiled
def _error(work: FloatArray, h: float, tolerance: float) -> float:
    """Scaled error of a step, 1 at the tolerance; may be inf or nan, which the caller reads as too large."""
    third, fifth, size = 0.0, 0.0, work.shape[1]
    for c in range(size):
        e3, e5 = 0.0, 0.0
        for k in range(ERROR_ROW.size):
            slope = work[ERROR_ROW[k], c]
            e3 += ERROR_ENTRY[0, k] * slope
            e5 += ERROR_ENTRY[1, k] * slope
        over = 1.0 / (tolerance * (1.0 + max(abs(work[STATE, c]), abs(work[NEW, c]))))
        third += (e3 * over) ** 2
        fifth += (e5 * over) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return float(abs(h) * fifth / np.sqrt((fifth + 0.01 * third) * size))


@compiled
def attempt(work: FloatArray, h: float, groups: GroupValues, tolerance: float) -> float:
    """Try one step into the row ``NEW``; its scaled error, infinite where a stage left λ > 0, λ_p > 0."""
    return _error(work, h, tolerance) if evaluate_stages(work, h, groups, 1, STAGES + 1) else np.inf
