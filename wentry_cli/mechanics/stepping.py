"""Compiled adaptive integration of the oscillating sphere: Dormand–Prince 8(5,3), dense output, located events."""

from __future__ import annotations

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import (
    STATE_SIZE,
    FloatArray,
    derivatives,
    energy,
    sensitivity_derivatives,
)
from wentry_cli.mechanics.extrema import DOWNWARD, FOUND, PEAK, PEAKS, UPWARD, VALLEY, IntArray, admit, is_left, settle
from wentry_cli.mechanics.tableau import (
    DENSE_ORDER,
    DENSE_WEIGHTS,
    ERROR_WEIGHTS,
    STAGE_WEIGHTS,
    STAGES,
    STAGES_DENSE,
)

DONE, TOO_MANY_STEPS, STEP_TOO_SMALL, TOO_MANY_EVENTS = 0, 1, 2, 3
EVENT_COLUMNS = 5  # time, kind, stretch, rate, x
WRITTEN, ACCEPTED, REJECTED = 2, 3, 4  # places in ``counts`` behind FOUND and PEAKS
SAFETY, SHRINK_MOST, GROW_MOST = 0.9, 0.2, 5.0
SMALLEST_STEP = 1e-14  # of the time reached
TINY_ERROR = 1e-12
NEGLIGIBLE = 30.0  # times the tolerance

Work = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # new state, slopes, dense coefficients, marks
Output = tuple[FloatArray, FloatArray, FloatArray]  # times to sample, states there, events

# The weights that are not zero, row by row; unsigned columns spare the compiled code a test for negative indices.
_ROWS, _COLUMNS = np.nonzero(STAGE_WEIGHTS)
ENTRY_COLUMN = _COLUMNS.astype(np.uint64)
ENTRY_WEIGHT = STAGE_WEIGHTS[_ROWS, _COLUMNS]
ROW_START = np.searchsorted(_ROWS, np.arange(STAGES_DENSE + 1))


@compiled
def _right_side(state: FloatArray, groups: FloatArray, out: FloatArray) -> bool:
    if not derivatives(state, groups, out):
        return False
    if state.size > STATE_SIZE:
        sensitivity_derivatives(state, groups, out)
    return True


@compiled
def _stages(
    y: FloatArray, h: float, groups: FloatArray, rows: tuple[int, int], work: FloatArray, slopes: FloatArray
) -> bool:
    """Evaluate the stages ``rows[0]`` to ``rows[1]`` − 1 of a step of length ``h``.

    The argument of the last stage stays in ``work``. Four components at a time stay in registers.
    """
    for i in range(rows[0], rows[1]):
        for c in range(0, y.size, 4):
            w0, w1, w2, w3 = 0.0, 0.0, 0.0, 0.0
            for k in range(ROW_START[i], ROW_START[i + 1]):
                j, weight = ENTRY_COLUMN[k], ENTRY_WEIGHT[k]
                w0 += weight * slopes[j, c]
                w1 += weight * slopes[j, c + 1]
                w2 += weight * slopes[j, c + 2]
                w3 += weight * slopes[j, c + 3]
            work[c] = y[c] + h * w0
            work[c + 1] = y[c + 1] + h * w1
            work[c + 2] = y[c + 2] + h * w2
            work[c + 3] = y[c + 3] + h * w3
        if not _right_side(work, groups, slopes[i]):
            return False
    return True


@compiled
def _error(y: FloatArray, y_new: FloatArray, h: float, tolerance: float, slopes: FloatArray) -> float:
    """Scaled error of a step, 1 at the tolerance; may be inf or nan, which the caller reads as too large."""
    third, fifth = 0.0, 0.0
    for c in range(y.size):
        e3, e5 = 0.0, 0.0
        for j in range(STAGES):
            e3 += ERROR_WEIGHTS[0, j] * slopes[j, c]
            e5 += ERROR_WEIGHTS[1, j] * slopes[j, c]
        scale = tolerance * (1.0 + max(abs(y[c]), abs(y_new[c])))
        third += (e3 / scale) ** 2
        fifth += (e5 / scale) ** 2
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
def _prepare_dense(y: FloatArray, y_new: FloatArray, h: float, slopes: FloatArray, dense: FloatArray) -> None:
    for c in range(y.size):
        change = y_new[c] - y[c]
        dense[0, c] = change
        dense[1, c] = h * slopes[0, c] - change
        dense[2, c] = 2.0 * change - h * (slopes[STAGES, c] + slopes[0, c])
        for i in range(4):
            total = 0.0
            for j in range(STAGES_DENSE):
                total += DENSE_WEIGHTS[i, j] * slopes[j, c]
            dense[3 + i, c] = h * total


@compiled
def _interpolate(y: FloatArray, dense: FloatArray, c: int, theta: float) -> float:
    """Component ``c`` of the dense output at the fraction ``theta`` of the step."""
    value = 0.0
    for i in range(DENSE_ORDER - 1, -1, -1):
        value += dense[i, c]
        value *= theta if i % 2 == 0 else 1.0 - theta
    return float(value + y[c])


@compiled
def _root(y: FloatArray, dense: FloatArray, c: int, level: float, low: float, high: float) -> float:
    """Fraction of the step where component ``c`` passes ``level``; bracketed (Illinois), to rounding."""
    f_low = _interpolate(y, dense, c, low) - level
    f_high = _interpolate(y, dense, c, high) - level
    if f_low == 0.0 or f_low * f_high > 0.0:
        return low
    middle = high
    for _ in range(60):
        if f_high == 0.0 or abs(high - low) < 1e-15:
            return high
        middle = high - f_high * (high - low) / (f_high - f_low)
        f_middle = _interpolate(y, dense, c, middle) - level
        if f_middle * f_high < 0.0:
            low, f_low = high, f_high
        else:
            f_low *= 0.5
        if abs(middle - high) < 1e-16:
            return middle
        high, f_high = middle, f_middle
    return high


@compiled
def _mark_events(y: FloatArray, y_new: FloatArray, dense: FloatArray, marks: FloatArray) -> int:
    """Find the extremum and the unit crossings of one step in their order.

    Writes rows (fraction, kind) into ``marks`` and returns their number. A step holds at most one extremum, so λ is
    monotone on both sides of it.
    """
    turn, turn_kind, count = 2.0, PEAK, 0
    if y[1] > 0.0 >= y_new[1]:
        turn = _root(y, dense, 1, 0.0, 0.0, 1.0)
    elif y[1] < 0.0 <= y_new[1]:
        turn, turn_kind = _root(y, dense, 1, 0.0, 0.0, 1.0), VALLEY
    low, start = 0.0, y[0]
    for part in range(2):
        high = min(turn, 1.0) if part == 0 else 1.0
        end = y_new[0] if high == 1.0 else _interpolate(y, dense, 0, high)
        if start < 1.0 <= end or start > 1.0 >= end:
            marks[count, 0] = _root(y, dense, 0, 1.0, low, high)
            marks[count, 1] = UPWARD if start < end else DOWNWARD
            count += 1
        if turn > 1.0:
            break
        if part == 0:
            marks[count, 0], marks[count, 1] = turn, turn_kind
            count += 1
        low, start = high, end
    return count


@compiled
def _read_step(
    y: FloatArray,
    span: tuple[float, float],
    work: Work,
    output: Output,
    counts: IntArray,
    scale: tuple[float, float],
) -> bool:
    """Write the events and samples inside one accepted step between the times ``span``; False if events are full.

    ``scale`` is λ at the release and the swing that is rounding, by which ``admit`` judges an event.
    """
    y_new, _, dense, marks = work
    samples, sampled, events = output
    h = span[1] - span[0]
    for k in range(_mark_events(y, y_new, dense, marks)):
        row = counts[FOUND]
        if row >= events.shape[0]:
            return False
        events[row, 0] = span[0] + marks[k, 0] * h
        events[row, 1] = marks[k, 1]
        for c in range(3):
            events[row, 2 + c] = _interpolate(y, dense, c, marks[k, 0])
        admit(events, counts, scale[0], scale[1])
    while counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= span[1]:
        theta = (samples[counts[WRITTEN]] - span[0]) / h
        for c in range(y.size):
            sampled[counts[WRITTEN], c] = _interpolate(y, dense, c, theta)
        counts[WRITTEN] += 1
    return True


@compiled
def integrate(
    groups: FloatArray, initial: FloatArray, limits: FloatArray, output: Output, counts: IntArray
) -> tuple[int, float, float]:
    """Integrate from ``initial`` at t* = 0 to the last of the rising times ``output[0]``.

    ``limits`` holds tolerance, longest step, most steps and the number of peaks after which to stop (0: never).
    ``output`` is (samples, sampled, events): the times, the state at each, and a row (time, kind, λ, dλ/dt*, x) per
    event; ``counts`` receives the numbers at FOUND, PEAKS, WRITTEN, ACCEPTED, REJECTED. Returns the status (DONE or
    what stopped it), the time reached and the largest error of the energy balance.
    """
    y = initial.copy()
    slopes = np.empty((STAGES_DENSE, y.size))
    work = (np.empty(y.size), slopes, np.empty((DENSE_ORDER, y.size)), np.empty((4, 2)))
    scratch = np.empty(y.size)
    samples, events = output[0], output[2]
    scale = (initial[0], NEGLIGIBLE * limits[0])
    t, end, worst = 0.0, samples[-1], 0.0
    h = min(0.25 * limits[1], end)
    energy_0 = energy(y[0], y[1], y[2], groups[0])
    while counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= 0.0:
        output[1][counts[WRITTEN], :] = y
        counts[WRITTEN] += 1
    if not _right_side(y, groups, slopes[0]):
        return STEP_TOO_SMALL, t, worst
    while t < end:
        if counts[ACCEPTED] + counts[REJECTED] >= limits[2]:
            return TOO_MANY_STEPS, t, worst
        h = min(h, limits[1])
        t_new = min(t + h, end)
        if t_new - t < SMALLEST_STEP * t or t_new == t:
            return (DONE if t_new == end else STEP_TOO_SMALL), t, worst
        error = _attempt(y, t_new - t, groups, limits[0], work)
        if not error <= 1.0:  # also where the error estimate overflowed
            counts[REJECTED] += 1
            h = (t_new - t) * (max(SHRINK_MOST, SAFETY * error**-0.125) if error < np.inf else SHRINK_MOST)
            continue
        counts[ACCEPTED] += 1
        y_new = work[0]
        turns = y[1] * y_new[1] <= 0.0 and y[1] != 0.0
        crosses = (y[0] - 1.0) * (y_new[0] - 1.0) <= 0.0 and y[0] != 1.0
        if turns or crosses or (counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= t_new):
            _stages(y, t_new - t, groups, (STAGES + 1, STAGES_DENSE), scratch, slopes)
            _prepare_dense(y, y_new, t_new - t, slopes, work[2])
            if not _read_step(y, (t, t_new), work, output, counts, scale):
                return TOO_MANY_EVENTS, t, worst
        y[:] = y_new
        slopes[0, :] = slopes[STAGES]
        t = t_new
        worst = max(worst, abs(energy(y[0], y[1], y[2], groups[0]) + y[3] - energy_0))
        if limits[3] > 0.0 and counts[PEAKS] >= limits[3] and is_left(events, counts, y[0], scale[1]):
            break
        h *= min(GROW_MOST, SAFETY * error**-0.125) if error > TINY_ERROR else GROW_MOST
    settle(events, counts, y[0], scale[1])
    return DONE, t, worst / energy_0 if energy_0 > 0.0 else worst
