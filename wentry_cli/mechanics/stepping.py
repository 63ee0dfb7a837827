"""Compiled adaptive integration of the oscillating sphere: Dormand–Prince 8(5,3), dense output, located events."""

from __future__ import annotations

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import (
    MOBILITY,
    STATE_SIZE,
    FloatArray,
    IntArray,
    energy,
    mobility,
    sensitivity_derivatives,
    state_rates,
)
from wentry_cli.mechanics.dense_output import interpolate, prepare_dense
from wentry_cli.mechanics.events import (
    ACCEPTED,
    MARKS,
    PEAKS,
    REJECTED,
    SIDE,
    VALLEY,
    WRITTEN,
    mark_events,
    note_crossing,
    note_extremum,
    settle_crossing,
)
from wentry_cli.mechanics.tableau import DENSE_ORDER, ERROR_WEIGHTS, STAGE_WEIGHTS, STAGES, STAGES_DENSE

DONE, TOO_MANY_STEPS, STEP_TOO_SMALL, TOO_MANY_EVENTS = 0, 1, 2, 3
SAFETY, SHRINK_MOST, GROW_MOST = 0.9, 0.2, 5.0
SMALLEST_STEP = 1e-14  # of the time reached
TINY_ERROR = 1e-12
NEGLIGIBLE = 30.0  # times the tolerance
ROOT_ACCURACY = 1e-4  # of the tolerance

Work = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # new state, slopes, dense coefficients, marks
Output = tuple[FloatArray, FloatArray, FloatArray, IntArray]  # times to sample, samples, events, components to sample

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
def _right_side(state: FloatArray, groups: FloatArray, out: FloatArray) -> bool:
    a, v, x = state[0], state[1], state[2]
    if not (a > 0.0 and x > -1.0):
        return False
    values = (groups[0], groups[1], groups[2], groups[3], groups[4])
    out[0] = v
    out[1], out[2], out[3], out[4] = state_rates(a, v, x, state[MOBILITY], values)
    if state.size > STATE_SIZE:
        sensitivity_derivatives(state, groups, out)
    return True


@compiled
def _state_stages(
    y: FloatArray, h: float, groups: FloatArray, rows: tuple[int, int], work: FloatArray, slopes: FloatArray
) -> bool:
    """``_stages`` without sensitivities: the state stays in registers, which halves the time."""
    values = (groups[0], groups[1], groups[2], groups[3], groups[4])
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
        mobile = mobility(x, values) if i == STAGES else y4 + h * (w4 + weight * k4)
        work[0], work[1], work[2], work[3], work[4] = a, v, x, y3 + h * (w3 + weight * k3), mobile
        k0 = v
        k1, k2, k3, k4 = state_rates(a, v, x, mobile, values)
        slopes[i, 0], slopes[i, 1], slopes[i, 2], slopes[i, 3], slopes[i, 4] = k0, k1, k2, k3, k4
    return True


@compiled
def _stages(
    y: FloatArray, h: float, groups: FloatArray, rows: tuple[int, int], work: FloatArray, slopes: FloatArray
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
            work[MOBILITY] = mobility(work[2], (groups[0], groups[1], groups[2], groups[3], groups[4]))
        if not _right_side(work, groups, slopes[i]):
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
def _attempt(y: FloatArray, h: float, groups: FloatArray, tolerance: float, work: Work) -> float:
    """Try one step into ``work[0]``; its scaled error, infinite where a stage left λ > 0, λ_p > 0."""
    if not _stages(y, h, groups, (1, STAGES + 1), work[0], work[1]):
        return np.inf
    return _error(y, work[0], h, tolerance, work[1])


@compiled
def _elastic_excess(stretch: float, x: float) -> float:
    """λ² − λ_p², which has the sign of the stress of the relaxing network."""
    return (stretch - 1.0) * (stretch + 1.0) - x


@compiled
def _has_kink(y: FloatArray, y_new: FloatArray, groups: FloatArray, tolerance: float) -> bool:
    """Whether λ_e passes 1 inside a step, where |s|ᵐ with m ≠ 1 is not smooth.

    The error of a step across it does not follow the tolerance. Ends that lie on it are not across.
    """
    if groups[3] == 1.0 or groups[1] == 0.0:
        return False
    before, after = _elastic_excess(y[0], y[2]), _elastic_excess(y_new[0], y_new[2])
    return before * after < 0.0 and min(abs(before), abs(after)) > 10.0 * tolerance


@compiled
def _find_kink(y: FloatArray, y_new: FloatArray, dense: FloatArray) -> float:
    """Fraction of the step at which λ_e passes 1, by bisection and a last secant."""
    low, high = 0.0, 1.0
    f_low, f_high = _elastic_excess(y[0], y[2]), _elastic_excess(y_new[0], y_new[2])
    for _ in range(12):
        middle = 0.5 * (low + high)
        f_middle = _elastic_excess(interpolate(y, dense, 0, middle), interpolate(y, dense, 2, middle))
        if f_middle * f_low > 0.0:
            low, f_low = middle, f_middle
        else:
            high, f_high = middle, f_middle
    return low + (high - low) * f_low / (f_low - f_high)


@compiled
def _read_step(
    y: FloatArray, span: tuple[float, float], work: Work, output: Output, counts: IntArray, limits: FloatArray
) -> bool:
    """Write the events and samples inside one accepted step between the times ``span``; False if events are full."""
    y_new, _, dense, marks = work
    samples, sampled, events, read = output
    h, negligible = span[1] - span[0], NEGLIGIBLE * limits[0]
    sharp = abs(y_new[1] - y[1]) >= negligible * h * limits[4]  # λ̈ over ω², the height of the turn
    for k in range(mark_events((y, y_new), dense, max(1e-16, ROOT_ACCURACY * limits[0]), marks)):
        theta, kind = marks[k, 0], marks[k, 1]
        at = interpolate(y, dense, 0, theta), interpolate(y, dense, 1, theta), interpolate(y, dense, 2, theta)
        found = (span[0] + theta * h, kind, at[0], at[1], at[2])
        if kind > VALLEY:
            note_crossing(found, events, counts)
        elif sharp and not note_extremum(found, events, counts, negligible):
            return False
    while counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= span[1]:
        theta = (samples[counts[WRITTEN]] - span[0]) / h
        for k in range(read.size):
            sampled[k, counts[WRITTEN]] = interpolate(y, dense, read[k], theta)
        counts[WRITTEN] += 1
    return True


@compiled
def are_rising(times: FloatArray) -> bool:
    """Whether ``times`` are finite and do not fall; quick, since a fit asks some thousand times."""
    before = -np.inf
    for k in range(times.size):
        if not before <= times[k] < np.inf:
            return False
        before = times[k]
    return times.size > 0 and times[0] > -np.inf


@compiled
def integrate(
    groups: FloatArray, initial: FloatArray, limits: FloatArray, output: Output, counts: IntArray
) -> tuple[int, float, float]:
    """Integrate from ``initial`` at t* = 0 to the last of the rising times ``output[0]``.

    ``limits`` holds tolerance, longest step, most steps, the number of peaks after which to stop (0: never) and ω² of
    the fastest small oscillation. ``output`` is (samples, sampled, events, components): the times, the sampled
    components at each, and a row (time, kind, λ, dλ/dt*, x) per event; ``counts`` receives the numbers at FOUND, PEAKS,
    WRITTEN, ACCEPTED, REJECTED. Returns the status (DONE or what stopped it), the time reached and the largest error of
    the energy balance.
    """
    y = initial.copy()
    slopes = np.empty((STAGES_DENSE, y.size))
    work = (np.empty(y.size), slopes, np.empty((DENSE_ORDER, y.size)), np.empty((MARKS, 2)))
    scratch = np.empty(y.size)
    samples, _, events, read = output
    t, end, worst = 0.0, samples[-1], 0.0
    h = min(0.25 * limits[1], end)
    energy_0 = energy(y[0], y[1], y[2], groups[0])
    if abs(y[0] - 1.0) >= NEGLIGIBLE * limits[0]:
        counts[SIDE] = 1 if y[0] > 1.0 else -1
    while counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= 0.0:
        for k in range(read.size):
            output[1][k, counts[WRITTEN]] = y[read[k]]
        counts[WRITTEN] += 1
    y[MOBILITY] = mobility(y[2], (groups[0], groups[1], groups[2], groups[3], groups[4]))
    if not _right_side(y, groups, slopes[0]):
        return STEP_TOO_SMALL, t, worst
    while t < end:
        if counts[ACCEPTED] + counts[REJECTED] >= limits[2]:
            return TOO_MANY_STEPS, t, worst
        h = min(h, limits[1])
        t_new = min(t + h, end)
        if t_new - t < SMALLEST_STEP * t or t_new == t:
            if t_new != end:
                return STEP_TOO_SMALL, t, worst
            break
        error = _attempt(y, t_new - t, groups, limits[0], work)
        if not error <= 1.0:  # also where the error estimate overflowed
            counts[REJECTED] += 1
            h = (t_new - t) * (max(SHRINK_MOST, SAFETY * error**-0.125) if error < np.inf else SHRINK_MOST)
            continue
        y_new = work[0]
        if _has_kink(y, y_new, groups, limits[0]):
            _stages(y, t_new - t, groups, (STAGES + 1, STAGES_DENSE), scratch, slopes)
            prepare_dense((y, y_new), t_new - t, slopes, read, work[2])
            counts[REJECTED] += 1
            h = (t_new - t) * _find_kink(y, y_new, work[2])
            continue
        counts[ACCEPTED] += 1
        turns = y[1] * y_new[1] <= 0.0 and y[1] != 0.0
        crosses = (y[0] - 1.0) * (y_new[0] - 1.0) <= 0.0 and y[0] != 1.0
        if turns or crosses or (counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= t_new):
            _stages(y, t_new - t, groups, (STAGES + 1, STAGES_DENSE), scratch, slopes)
            prepare_dense((y, y_new), t_new - t, slopes, read, work[2])
            if not _read_step(y, (t, t_new), work, output, counts, limits):
                return TOO_MANY_EVENTS, t, worst
        for c in range(y.size):
            y[c] = y_new[c]
            slopes[0, c] = slopes[STAGES, c]
        t = t_new
        worst = max(worst, abs(energy(y[0], y[1], y[2], groups[0]) + y[3] - energy_0))
        if limits[3] > 0.0 and counts[PEAKS] >= limits[3]:
            break
        h *= min(GROW_MOST, SAFETY * error**-0.125) if error > TINY_ERROR else GROW_MOST
    settle_crossing(y[0], events, counts, NEGLIGIBLE * limits[0])
    return DONE, t, worst / energy_0 if energy_0 > 0.0 else worst
