"""Compiled adaptive integration of the oscillating sphere: Dormand–Prince 8(5,3), dense output, located events."""

from __future__ import annotations

import math

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import (
    FULL_SIZE,
    MOBILITY,
    STATE_SIZE,
    FloatArray,
    GroupValues,
    IntArray,
    energy,
    mobility,
)
from wentry_cli.mechanics.dense_output import SAMPLED, component, interpolate, prepare_dense
from wentry_cli.mechanics.events import (
    ACCEPTED,
    COUNTS,
    EVENT_COLUMNS,
    FOUND,
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
from wentry_cli.mechanics.stages import (
    MARKS,
    NEW,
    SLOPES,
    STATE,
    WORK_ROWS,
    attempt,
    evaluate_stages,
    right_side,
)
from wentry_cli.mechanics.tableau import STAGES, STAGES_DENSE

DONE, TOO_MANY_STEPS, STEP_TOO_SMALL, TOO_MANY_EVENTS, NOT_RISING = 0, 1, 2, 3, 4
SMALL_PERIOD = 2.0 * 2.0 * math.pi / math.sqrt(40.0)  # of the relaxed sphere at small amplitude, in units of t_c
LONGEST_STEP = 0.4  # of the shortest period: a step never holds two extrema
LEAST_TOLERANCE = 1e-14
MOST_EVENTS = 400_000
SAFETY, SHRINK_MOST, GROW_MOST = 0.88, 0.2, 5.0
NOW, BEFORE = -0.1, 0.02  # powers of this error and of the last in the next step: a controller that seldom overshoots
LOCAL = 0.7  # of the tolerance is what a step may be wrong by
SMALLEST_STEP = 1e-14  # of the time reached
TINY_ERROR = 1e-12
LEAST_ERROR = 1e-4
NEGLIGIBLE = 30.0  # times the tolerance
ROOT_ACCURACY = 1e-4  # of the tolerance

Output = tuple[FloatArray, FloatArray, FloatArray, IntArray]  # times to sample, samples, events, counts
Settings = tuple[float, float, int, int]  # time scale in s, tolerance, most steps, peaks after which to stop (0: never)
Found = tuple[int, float, float, FloatArray, FloatArray, int, int]


@compiled
def _elastic_excess(stretch: float, x: float) -> float:
    """λ² − λ_p², which has the sign of the stress of the relaxing network."""
    return (stretch - 1.0) * (stretch + 1.0) - x


@compiled
def _has_kink(work: FloatArray, groups: GroupValues, tolerance: float) -> bool:
    """Whether λ_e passes 1 inside a step, where |s|ᵐ with m ≠ 1 is not smooth.

    The error of a step across it does not follow the tolerance. Ends that lie on it are not across.
    """
    if groups[3] == 1.0 or groups[1] == 0.0:
        return False
    before = _elastic_excess(work[STATE, 0], work[STATE, 2])
    after = _elastic_excess(work[NEW, 0], work[NEW, 2])
    return before * after < 0.0 and min(abs(before), abs(after)) > 10.0 * tolerance


@compiled
def _find_kink(work: FloatArray) -> float:
    """Fraction of the step at which λ_e passes 1, by bisection and a last secant."""
    low, high = 0.0, 1.0
    f_low = _elastic_excess(work[STATE, 0], work[STATE, 2])
    f_high = _elastic_excess(work[NEW, 0], work[NEW, 2])
    for _ in range(12):
        middle = 0.5 * (low + high)
        f_middle = _elastic_excess(interpolate(work, 0, middle), interpolate(work, 2, middle))
        if f_middle * f_low > 0.0:
            low, f_low = middle, f_middle
        else:
            high, f_high = middle, f_middle
    return low + (high - low) * f_low / (f_low - f_high)


@compiled
def _note_events(
    span: tuple[float, float], work: FloatArray, events: FloatArray, counts: IntArray, limits: FloatArray
) -> bool:
    """Write the events inside one accepted step between the times ``span``; False if events are full."""
    h, negligible = span[1] - span[0], NEGLIGIBLE * limits[0]
    sharp = abs(work[NEW, 1] - work[STATE, 1]) >= negligible * h * limits[4]  # λ̈ over ω², the height of the turn
    for k in range(MARKS, MARKS + mark_events(work, max(1e-16, ROOT_ACCURACY * limits[0]))):
        theta, kind = work[k, 0], work[k, 1]
        at = interpolate(work, 0, theta), interpolate(work, 1, theta), interpolate(work, 2, theta)
        found = (span[0] + theta * h, kind, at[0], at[1], at[2])
        if kind > VALLEY:
            note_crossing(found, events, counts)
        elif sharp and not note_extremum(found, events, counts, negligible):
            return False
    return True


@compiled
def _sample(span: tuple[float, float], work: FloatArray, samples: FloatArray, sampled: FloatArray, written: int) -> int:
    """Write the samples inside one accepted step between the times ``span``; how many are written now."""
    h = span[1] - span[0]
    while written < samples.size and samples[written] <= span[1]:
        theta = (samples[written] - span[0]) / h
        for k in range(sampled.shape[0]):
            sampled[k, written] = interpolate(work, component(k), theta)
        written += 1
    return written


@compiled
def _write_release(work: FloatArray, samples: FloatArray, sampled: FloatArray) -> int:
    """Sample the state at the release for all times up to 0; how many they are."""
    written = 0
    while written < samples.size and samples[written] <= 0.0:
        for k in range(sampled.shape[0]):
            sampled[k, written] = work[STATE, component(k)]
        written += 1
    return written


@compiled
def integrate(groups: GroupValues, work: FloatArray, limits: FloatArray, output: Output) -> tuple[int, float, float]:
    """Integrate from the first row of ``work`` at t* = 0 to the last of the rising times ``output[0]``.

    ``limits`` holds tolerance, longest step, most steps, the number of peaks after which to stop (0: never) and ω² of
    the fastest small oscillation. ``output`` is (samples, sampled, events, counts): the times, the sampled components
    at each, a row (time, kind, λ, dλ/dt*, x) per event, and the numbers at FOUND, PEAKS, WRITTEN, ACCEPTED, REJECTED.
    Returns the status (DONE or what stopped it), the time reached and the largest error of the energy balance.
    """
    samples, sampled, events, counts = output
    size, stiffness = work.shape[1], groups[0]
    t, end, worst, last_error = 0.0, samples[-1], 0.0, LEAST_ERROR
    h = min(0.25 * limits[1], end)
    energy_0 = energy(work[STATE, 0], work[STATE, 1], work[STATE, 2], stiffness)
    if abs(work[STATE, 0] - 1.0) >= NEGLIGIBLE * limits[0]:
        counts[SIDE] = 1 if work[STATE, 0] > 1.0 else -1
    counts[WRITTEN] = _write_release(work, samples, sampled)
    work[STATE, MOBILITY] = mobility(work[STATE, 2], groups)
    if not right_side(work, STATE, SLOPES, groups):
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
        error = attempt(work, t_new - t, groups, limits[0])
        if not error <= 1.0:  # also where the error estimate overflowed
            counts[REJECTED] += 1
            h = (t_new - t) * (max(SHRINK_MOST, SAFETY * error**-0.125) if error < np.inf else SHRINK_MOST)
            continue
        kink = _has_kink(work, groups, limits[0])
        turns = work[STATE, 1] * work[NEW, 1] <= 0.0 and work[STATE, 1] != 0.0
        crosses = (work[STATE, 0] - 1.0) * (work[NEW, 0] - 1.0) <= 0.0 and work[STATE, 0] != 1.0
        if kink or turns or crosses or (counts[WRITTEN] < samples.size and samples[counts[WRITTEN]] <= t_new):
            evaluate_stages(work, t_new - t, groups, STAGES + 1, STAGES_DENSE)
            prepare_dense(work, t_new - t, sampled.shape[0])
            if kink:
                counts[REJECTED] += 1
                h = (t_new - t) * _find_kink(work)
                continue
            if (turns or crosses) and not _note_events((t, t_new), work, events, counts, limits):
                return TOO_MANY_EVENTS, t, worst
            counts[WRITTEN] = _sample((t, t_new), work, samples, sampled, counts[WRITTEN])
        counts[ACCEPTED] += 1
        for c in range(size):
            work[STATE, c] = work[NEW, c]
            work[SLOPES, c] = work[SLOPES + STAGES, c]
        t = t_new
        held = energy(work[STATE, 0], work[STATE, 1], work[STATE, 2], stiffness) + work[STATE, 3]
        worst = max(worst, abs(held - energy_0))
        if limits[3] > 0.0 and counts[PEAKS] >= limits[3]:
            break
        h *= max(SHRINK_MOST, min(GROW_MOST, SAFETY * max(error, TINY_ERROR) ** NOW * last_error**BEFORE))
        last_error = max(error, LEAST_ERROR)
    settle_crossing(work[STATE, 0], events, counts, NEGLIGIBLE * limits[0])
    return DONE, t, worst / energy_0 if energy_0 > 0.0 else worst


@compiled
def _are_rising(times: FloatArray) -> bool:
    before = -np.inf
    for k in range(times.size):
        if not before <= times[k] < np.inf:
            return False
        before = times[k]
    return times.size > 0 and times[0] > -np.inf


@compiled
def _work_of(release: tuple[float, float], with_sensitivities: bool) -> FloatArray:
    """The work of a step, its first row the state at the release."""
    work = np.empty((WORK_ROWS, FULL_SIZE if with_sensitivities else STATE_SIZE))
    for c in range(work.shape[1]):
        work[STATE, c] = 0.0
    work[STATE, 0], work[STATE, 2] = release[0], (release[1] - 1.0) * (release[1] + 1.0)
    if with_sensitivities:
        work[STATE, STATE_SIZE] = 1.0
        work[STATE, FULL_SIZE - 1] = 2.0 * release[1] * release[1]  # of x = λ_p² − 1 to ln λ_p
    return work


@compiled
def integrate_release(
    groups: GroupValues, release: tuple[float, float], times_s: FloatArray, settings: Settings, with_sensitivities: bool
) -> Found:
    """Integrate from rest at the stretches ``release`` = (λ, λ_p) and sample at the rising ``times_s``.

    All that surrounds ``integrate`` is compiled too, since a fit comes here some thousand times. Returns the status,
    the fraction of the time that was reached, the error of the energy balance, the samples (NaN where the integration
    ended before), the events, and the numbers of steps accepted and rejected.
    """
    time_scale, tolerance, most_steps, peaks_wanted = settings
    counts = np.zeros(COUNTS, dtype=np.int64)
    if not _are_rising(times_s):
        return NOT_RISING, 0.0, 0.0, np.empty((0, 0)), np.empty((0, 0)), 0, 0
    scaled = times_s / time_scale
    fast = math.sqrt(1.0 + groups[0])
    end = max(scaled[-1], 0.0)
    events = np.empty((int(min(4.5 * end * fast / SMALL_PERIOD + 16.0, MOST_EVENTS)), EVENT_COLUMNS))
    sampled = np.empty((SAMPLED + 5 if with_sensitivities else SAMPLED, times_s.size))
    swing = max(abs(release[0] - 1.0), abs(release[1] - 1.0))
    local = max(LOCAL * tolerance * min(1.0, 2.0 * swing), LEAST_TOLERANCE)
    limits = np.array([local, LONGEST_STEP * SMALL_PERIOD / fast, most_steps, peaks_wanted, 10.0 * fast * fast])
    work = _work_of(release, with_sensitivities)
    status, reached, energy_error = integrate(groups, work, limits, (scaled, sampled, events, counts))
    sampled[:, counts[WRITTEN] :] = np.nan
    done = reached / max(end, 1e-300)
    return status, done, energy_error, sampled, events[: counts[FOUND]], counts[ACCEPTED], counts[REJECTED]
