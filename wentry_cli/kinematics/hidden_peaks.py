"""Peaks of the stretch that nobody has seen: before the record, behind the splash, in a gap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.extremum import Extremum, ends, swing
from wentry_cli.kinematics.smoother import SmoothTrack

Array = NDArray[np.float64]
# The first peak and the first valley come so long after impact, in free periods: .23 to .35 in recordings and models.
FIRST_PEAK, FIRST_VALLEY = 0.3, 0.8
LATE_START, RISEN = 0.3, 2.0  # half periods after impact; standard uncertainties
WIDE_GAP = 0.4  # half periods without a frame
BESIDE = 0.1  # periods before and after a peak within which frames were measured, or else it was not seen


def starts_high(extrema: tuple[Extremum, ...], track: SmoothTrack, minimum_swing: float) -> bool:
    """Whether λ falls to its first valley from above the 1 that it had at impact: then a peak lies in between."""
    if not extrema or extrema[0].peak:
        return False
    start = ends(track)[0]
    falls = start.stretch > extrema[0].stretch and swing(start, extrema[0], minimum_swing) >= 1.0
    return falls and start.stretch > 1.0 and swing(start, Extremum(0.0, 0.0, 1.0, 0.0, False), minimum_swing) >= 1.0


def starts_on_peak(extrema: tuple[Extremum, ...], track: SmoothTrack) -> bool:
    """Whether the first peak stands where the record begins, late, and λ was not seen to rise to it.

    Then it may as well have been higher and before, where nothing was measured.
    """
    if len(extrema) < 2 or not extrema[0].peak:
        return False
    start, peak = ends(track)[0], extrema[0]
    late = start.time_s > LATE_START * (extrema[1].time_s - peak.time_s)
    return late and peak.stretch - start.stretch < RISEN * float(np.hypot(start.stretch_unc, peak.stretch_unc))


def first_peak_in_gap(extrema: tuple[Extremum, ...], measured_s: Array) -> bool:
    """Whether the first peak lies where nothing was measured for long: how high it was nobody has seen."""
    if len(extrema) < 2 or not extrema[0].peak:
        return False
    peak, half = extrema[0].time_s, extrema[1].time_s - extrema[0].time_s
    before, behind = measured_s[measured_s <= peak], measured_s[measured_s > peak]
    gap = (behind[0] if behind.size else np.inf) - (before[-1] if before.size else 0.0)
    return bool(gap > WIDE_GAP * half)


def alone_behind_gap(extrema: tuple[Extremum, ...], measured_s: Array) -> bool:
    """Whether the only extremum comes after a gap in which others may have been: nobody knows its number."""
    if len(extrema) != 1:
        return False
    when = extrema[0].time_s
    return _widest_gap(measured_s, when) > WIDE_GAP * FIRST_PEAK * when


def _widest_gap(measured_s: Array, until_s: float) -> float:
    """The longest time without a measured frame between impact and ``until_s``."""
    return float(np.max(np.diff(measured_s[measured_s <= until_s], prepend=0.0), initial=0.0))


def unseen_peaks(extrema: tuple[Extremum, ...], measured_s: Array, certain: bool) -> int:
    """How many peaks lie before the first extremum, in frames that were not measured; at least one if ``certain``."""
    if len(extrema) < 2:
        return 0
    alike = [b.time_s - a.time_s for a, b in zip(extrema, extrema[2:], strict=False)]
    period = float(np.median(alike)) if alike else 2.0 * (extrema[1].time_s - extrema[0].time_s)
    first = extrema[0]
    phase = first.time_s / period
    count = round(phase - FIRST_PEAK) if first.peak else round(phase - FIRST_VALLEY) + 1
    off = (measured_s - first.time_s) / period + (1.0 if first.peak else 0.5)  # from the last peak before it
    seen = np.any((off > -BESIDE) & (off < 0.0)) and np.any((off > 0.0) & (off < BESIDE))
    whole = _widest_gap(measured_s, first.time_s) < WIDE_GAP * 0.5 * period  # else others may be hidden before that one
    return max(count, 1) if certain else 0 if seen and whole else max(count, 0)
