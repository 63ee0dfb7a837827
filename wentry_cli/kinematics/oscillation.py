"""Peaks, valleys and periods of the stretch λ(t) of a sphere that rings after an impact.

λ(t) is smoothed by the state-space spline (an event at impact), so that every extremum is a root of λ̇ with the
uncertainty u(λ̇)/|λ̈| and every crossing a root of λ − mean with u(λ)/|λ̇|. The slowly varying mean is the stretch at
rest about which the sphere rings, from three extrema in a row: in the amplitude s = ±√(2λ² + λ⁻⁴ − 3), the root of
the stored energy, a swing that loses the same share each time is m + A, m − Aρ, m + Aρ², so that
m = (s₁s₃ − s₂²)/(s₁ + s₃ − 2s₂) (Aitken). The three begin with the valley before the crossing, where the swings are
small. Averages over a cycle lie too high: by .04 for a free neo-Hookean sphere with peaks of 1.5, more with damping.

A peak's stretch is no better known than what the frames around it have in common: the part of their stated uncertainty
that their scatter does not show is added in quadrature. It moves neighbouring extrema together; what sticks to a sphere
moves over its outline as it flattens, and what it does to λ may change by as much within a quarter of a period: by
that it shifts them in time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.extremum import NO_TIME, UNSEEN, Extremum, ends, swing
from wentry_cli.kinematics.hidden_peaks import (
    alone_behind_gap,
    first_peak_in_gap,
    starts_high,
    starts_on_peak,
    unseen_peaks,
)
from wentry_cli.kinematics.interpolation import beside_gap
from wentry_cli.kinematics.outliers import scattering, unseen_part
from wentry_cli.kinematics.smoother import SmoothTrack, smooth_track

Array = NDArray[np.float64]
FINE = 8  # samples per frame in the search for roots
COARSE = 16  # times as many samples from a valley to the next peak
NEAR = 25  # frames around an extremum that tell what they have in common


@dataclass(frozen=True)
class Period:
    """Period N: from one upward crossing to the next (the first from impact), its peak, its valley.

    ``status``: ok; no_unit_crossing where nothing crosses the mean and an end is midway between valley and next peak;
    clip_ended where the record ends before the next crossing (``end_s`` is NaN); not_identified where λ was not
    measured about the peak, which the time of the later ones tells (its time and stretch are NaN).
    """

    number: int
    start_s: float
    end_s: float
    end_unc_s: float
    peak: Extremum
    valley: Extremum | None
    peak_to_peak_s: float
    peak_to_peak_unc_s: float
    status: str


@dataclass(frozen=True)
class Oscillation:
    """Extrema in order of time, periods, and the smoothed stretch; ``status`` is ok or too_few."""

    extrema: tuple[Extremum, ...]
    periods: tuple[Period, ...]
    track: SmoothTrack | None
    status: str

    @property
    def peaks(self) -> tuple[Extremum, ...]:
        """The peaks, λ_p1 first."""
        return tuple(e for e in self.extrema if e.peak)

    @property
    def free_period_s(self) -> tuple[float, float]:
        """The free period T, first to second peak, and its standard uncertainty; NaN where there is none."""
        if not self.periods:
            return NO_TIME, NO_TIME
        return self.periods[0].peak_to_peak_s, self.periods[0].peak_to_peak_unc_s


def find_oscillation(
    times_s: Array, stretch: Array, stretch_unc: Array, *, minimum_swing: float = 0.004
) -> Oscillation:
    """Find the oscillation of ``stretch`` (n; NaN = missing) at times after impact (impact at 0), frames in order.

    An extremum counts when it differs from its neighbours by four standard uncertainties of the difference and by
    ``minimum_swing``. Fewer than six measured frames after impact, or no peak: status ``too_few``. Peaks in frames that
    were not measured, such as those behind the splash, keep their number.
    """
    times, values = np.asarray(times_s, dtype=float), np.asarray(stretch, dtype=float)
    after = (times > 0.0) & np.isfinite(values)
    spread = np.broadcast_to(np.asarray(stretch_unc, dtype=float), times.shape)
    noise = scattering(times[after], values[after], spread[after])
    track = smooth_track(times[after], values[after], noise, events_s=(0.0,))
    if track.status != "ok":
        return Oscillation((), (), None, "too_few")
    extrema = _significant(_extrema(track), minimum_swing)
    if len(extrema) == 1 and all(swing(extrema[0], end, minimum_swing) < 1.0 for end in ends(track)):
        extrema = ()
    if alone_behind_gap(extrema, times[after]):
        extrema = ()
    hidden = starts_on_peak(extrema, track) or first_peak_in_gap(extrema, times[after])
    extrema = extrema[1:] if hidden else extrema
    unseen = unseen_peaks(extrema, times[after], hidden or starts_high(extrema, track, minimum_swing))
    while extrema and not extrema[0].peak and not unseen:
        extrema = extrema[1:]
    spacing = np.gradient([e.time_s for e in extrema]) if len(extrema) > 1 else np.full(len(extrema), np.inf)
    bends = np.abs(track.means(np.array([e.time_s for e in extrema]))[:, 2])
    beside = zip(extrema, 0.5 * spacing, bends.tolist(), strict=True)
    extrema = tuple(_with_common(e, track, spread[after], *other) for e, *other in beside)
    periods = _periods(track, extrema, unseen)
    return Oscillation(extrema, periods, track, "ok" if periods else "too_few")


def _fine_times(track: SmoothTrack) -> Array:
    """Times (n, FINE + 1) from frame to frame where λ̇ may vanish between: it changes at no more than twice λ̈."""
    frames = track.frames
    step, rate, bend = np.diff(frames.times_s), frames.velocity, np.abs(frames.acceleration)
    reach = 2.0 * step * np.maximum(bend[:-1], bend[1:])
    near = (rate[:-1] * rate[1:] <= 0.0) | (np.minimum(np.abs(rate[:-1]), np.abs(rate[1:])) < reach)
    return np.linspace(frames.times_s[:-1][near], frames.times_s[1:][near], FINE + 1, axis=1)


def _extrema(track: SmoothTrack) -> tuple[Extremum, ...]:
    """Every root of λ̇ with its kind, by the secant through the bracketing samples and one Newton step."""
    fine = _fine_times(track)
    rates = track.means(fine.ravel())[:, 1].reshape(fine.shape)
    between = rates[:, :-1] * rates[:, 1:] < 0.0
    start, end = fine[:, :-1][between], fine[:, 1:][between]
    rate, after = rates[:, :-1][between], rates[:, 1:][between]
    secant = start - rate * (end - start) / (after - rate)
    _, speed, turn = track.means(secant).T
    step = np.divide(-speed, turn, out=np.zeros(rate.size), where=turn != 0.0)
    roots = track.evaluate(np.clip(secant + step, start, end))
    bend = np.abs(roots.acceleration)
    unc = np.divide(roots.velocity_unc, bend, out=np.zeros(rate.size), where=bend > 0.0)
    columns = (roots.times_s, unc, roots.position, roots.position_unc, rate > 0.0)
    return tuple(Extremum(*row) for row in zip(*(column.tolist() for column in columns), strict=True))


def _significant(extrema: tuple[Extremum, ...], minimum_swing: float) -> tuple[Extremum, ...]:
    """Drop adjacent pairs that differ too little, the smallest difference first, then lone insignificant ends."""
    kept = list(extrema)
    while len(kept) > 1:
        swings = np.array([swing(a, b, minimum_swing) for a, b in pairwise(kept)])
        worst = int(np.argmin(swings))
        if swings[worst] >= 1.0:
            break
        # an end of the chain goes alone, or the alternation of peaks and valleys would break
        if worst == len(kept) - 2:
            del kept[-1]
        elif worst == 0:
            del kept[0]
        else:
            del kept[worst : worst + 2]
    return tuple(kept)


def _with_common(extremum: Extremum, track: SmoothTrack, stated: Array, quarter_s: float, bend: float) -> Extremum:
    """Add what the frames around an extremum do not know together, in quadrature; ``bend`` is its |λ̈|."""
    times = track.frames.times_s
    near = np.argsort(np.abs(times - extremum.time_s), kind="stable")[:NEAR]
    common = unseen_part(track.residual[near], stated[near])
    stretch_unc = float(np.hypot(extremum.stretch_unc, common))
    doubts = (extremum.time_unc_s, beside_gap(extremum.time_s, times), common / quarter_s / (bend or np.inf))
    time_unc = float(np.linalg.norm(doubts))
    return replace(extremum, stretch_unc=stretch_unc, time_unc_s=time_unc, common_unc=common)


def _periods(track: SmoothTrack, extrema: tuple[Extremum, ...], unseen: int) -> tuple[Period, ...]:
    peaks = [UNSEEN] * unseen + [e for e in extrema if e.peak]
    hidden = unseen - (0 if not extrema or extrema[0].peak else 1)  # valleys that were not seen either
    valleys: list[Extremum | None] = [*[None] * hidden, *[e for e in extrema if not e.peak]]
    periods = []
    start = 0.0
    for i, peak in enumerate(peaks):
        valley = valleys[i] if i < len(valleys) else None
        following = peaks[i + 1] if i + 1 < len(peaks) else None
        end, end_unc, status = _end(track, valley, following, _rest(extrema, valley) if valley else 1.0)
        between = following.time_s - peak.time_s if following else NO_TIME
        between_unc = float(np.hypot(following.time_unc_s, peak.time_unc_s)) if following else NO_TIME
        status = status if i >= unseen else "not_identified"
        periods.append(Period(i + 1, start, end, end_unc, peak, valley, between, between_unc, status))
        start = end
    return tuple(periods)


def _amplitude(stretch: float) -> float:
    return math.copysign(math.sqrt(max(2.0 * stretch**2 + stretch**-4 - 3.0, 0.0)), stretch - 1.0)


def _stretch_of(amplitude: float) -> float:
    """Invert ``_amplitude`` by bisection; it is monotonic."""
    low, high = 0.2, 5.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _amplitude(middle) < amplitude else (low, middle)
    return 0.5 * (low + high)


def _rest(extrema: tuple[Extremum, ...], valley: Extremum) -> float:
    """Stretch about which the sphere rings after ``valley``; 1 where there are not three extrema to tell."""
    i = extrema.index(valley)
    three = extrema[i : i + 3] if i + 3 <= len(extrema) else extrema[max(len(extrema) - 3, 0) :]
    if len(three) < 3:
        return 1.0
    first, second, third = (_amplitude(e.stretch) for e in three)
    return _stretch_of((first * third - second**2) / (first + third - 2.0 * second))


def _end(
    track: SmoothTrack, valley: Extremum | None, following: Extremum | None, mean: float
) -> tuple[float, float, str]:
    """The upward crossing after ``valley``: its time, standard uncertainty and status."""
    if valley is None:
        return NO_TIME, NO_TIME, "clip_ended"
    last = following.time_s if following else float(track.frames.times_s[-1])
    strides = (FINE, 1) if following else (1,)  # behind the last peak others may follow that are not told from noise
    time = _crossing(track, np.linspace(valley.time_s, last, COARSE * FINE + 1), mean, strides)
    if time is not None:
        state = track.evaluate(time)
        # which mean is meant is uncertain itself: 1, the stretch of no force, is as good as the one used
        common = max(e.common_unc for e in (valley, following) if e is not None)
        spread = np.linalg.norm([state.position_unc[0], state.position[0] - 1.0, common])
        return time, float(spread / abs(state.velocity[0])), "ok"
    if following is None:
        return NO_TIME, NO_TIME, "clip_ended"
    middle = 0.5 * (valley.time_s + following.time_s)
    return middle, (following.time_s - valley.time_s) / np.sqrt(12.0), "no_unit_crossing"


def _crossing(track: SmoothTrack, times: Array, mean: float, strides: tuple[int, ...]) -> float | None:
    """When the stretch first rises through ``mean`` at the ``times``, of which it is looked at every so many at first.

    None where it does not.
    """
    for stride in strides:
        above = track.means(times[::stride])[:, 0] - mean
        rising = np.flatnonzero((above[:-1] < 0.0) & (above[1:] >= 0.0))
        if not rising.size:
            return None
        i = int(rising[0])
        times = times[stride * i : stride * (i + 1) + 1]
    return float(times[0] - above[i] * (times[1] - times[0]) / (above[i + 1] - above[i]))
