"""Which cavity closes: cavities are counted by the period in which the contact line made them, not by time.

The contact line passes the depth of the neck within a period whose ends were measured, or some periods after the last
measured one: a stiff sphere rings on below what can be seen. While the swing is small its period is steady, so that
they can be counted; the count is given only where it cannot be another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

SURE = 2.0  # standard uncertainties between the passage and the nearest end of a period
DRIFT = 0.04  # of the period: how much it may change from one to the next beyond what the measured ones show
LARGEST_SWING = 0.06  # of the stretch from peak to valley in the last measured period: above, no period is steady
INTERVALS = (0.7, 1.4)  # of the median: an interval outside holds a period that was missed, or is none
FIRST_INTERVAL = (0.7, 1.8)  # the first one begins with the impact
NEIGHBOURS = 5  # frames whose median is the contact line's height


@dataclass(frozen=True)
class Periods:
    """The measured periods in order, arrays of shape (n,), NaN where not known: ends and distance to the next peak.

    ``peak`` and ``valley`` are the greatest and smallest stretch of each.
    """

    end_s: Floats
    end_unc_s: Floats
    peak_to_peak_s: Floats
    peak: Floats
    valley: Floats


@dataclass(frozen=True)
class CavityNumber:
    """The number N of the cavity that closes; None where it is not identified.

    ``source`` is ``measured`` where the ends of period N were, ``counted`` where it lies beyond the last measured end,
    and empty without a number.
    """

    number: int | None
    source: str


UNKNOWN = CavityNumber(None, "")


def find_passage(neck_y_m: float, separation_times_s: ArrayLike, separation_y_m: ArrayLike) -> tuple[float, float]:
    """Return when the contact line passed the height ``neck_y_m`` and its uncertainty, NaN where that was not seen.

    The arrays (n,) are time after impact and height of the contact line (``side.csv``: ``t_s``, ``separation_y_m``);
    NaN is skipped. The contact line may rise while it recedes; the last downward passage counts, since it made the
    wall that is left. A contact line that was lost and seen again lower down is interpolated linearly in between.
    Heights are medians of neighbouring frames, which single wrong ones do not move.
    """
    times, heights = np.asarray(separation_times_s, dtype=float), np.asarray(separation_y_m, dtype=float)
    seen = np.isfinite(times) & np.isfinite(heights) & (times > 0.0)
    # The contact line starts at the surface at the moment of impact.
    times = np.concatenate([[0.0], times[seen]])
    heights = np.concatenate([[0.0], _medians(heights[seen])])
    passes = np.flatnonzero((heights[:-1] > neck_y_m) & (heights[1:] <= neck_y_m))
    if not np.isfinite(neck_y_m) or passes.size == 0:
        return float("nan"), float("nan")
    last = passes[-1]
    share = (heights[last] - neck_y_m) / (heights[last] - heights[last + 1])
    between = float(times[last + 1] - times[last])
    return float(times[last] + share * between), 0.5 * between


def _medians(values: Floats) -> Floats:
    """Running medians over ``NEIGHBOURS`` samples, fewer at the ends, where the window stays symmetric."""
    count, half = values.size, NEIGHBOURS // 2
    reach = np.minimum(np.minimum(np.arange(count), np.arange(count)[::-1]), half)
    return np.array([np.median(values[k - r : k + r + 1]) for k, r in enumerate(reach)])


def find_cavity_number(passage_s: float, passage_unc_s: float, periods: Periods) -> CavityNumber:
    """Return the number of the cavity whose wall the contact line made at ``passage_s`` (s after impact).

    N is the period of the passage, so that a neck between cavities N and N + 1 belongs to N + 1 and D_eff is the
    stretch peak of that period times D. It is not identified where the passage is so close to the end of a period that
    it may be on the other side, where a period may have been missed, or where too many would have to be counted.
    """
    known = int(np.argmin(np.append(np.isfinite(periods.end_s), False)))
    if not np.isfinite(passage_s) or known == 0:
        return UNKNOWN
    ends, uncs = periods.end_s[:known], np.nan_to_num(periods.end_unc_s[:known])
    interval, spread = _interval(ends, periods.peak_to_peak_s)
    if not _complete(ends, interval):
        return UNKNOWN
    if passage_s < ends[-1] + SURE * np.hypot(uncs[-1], passage_unc_s):
        near = np.abs(passage_s - ends) < SURE * np.hypot(uncs, passage_unc_s)
        return UNKNOWN if near.any() else CavityNumber(1 + int(np.sum(ends < passage_s)), "measured")
    swing = periods.peak[known - 1] - periods.valley[known - 1]
    if not swing < LARGEST_SWING or not np.isfinite(interval):
        return UNKNOWN
    elapsed = (passage_s - ends[-1]) / interval
    unc = np.hypot(elapsed * np.hypot(spread / interval, DRIFT), np.hypot(uncs[-1], passage_unc_s) / interval)
    if min(elapsed % 1.0, 1.0 - elapsed % 1.0) < SURE * unc:
        return UNKNOWN
    return CavityNumber(known + 1 + int(elapsed), "counted")


def _interval(ends: Floats, peak_to_peak: Floats) -> tuple[float, float]:
    """Period of the swing and its spread, from the distances of peaks and of ends; NaN where there are none."""
    found = np.concatenate([np.diff(ends), peak_to_peak[np.isfinite(peak_to_peak)]])
    if found.size == 0:
        return float("nan"), float("nan")
    return float(np.mean(found)), float(np.std(found))


def _complete(ends: Floats, interval: float) -> bool:
    """Whether the ends of the periods follow one another as they do when none is missing."""
    if not np.isfinite(interval):
        return ends.size == 1
    later = np.diff(ends) / interval
    first = ends[0] / interval
    return bool(
        np.all((later > INTERVALS[0]) & (later < INTERVALS[1])) and FIRST_INTERVAL[0] < first < FIRST_INTERVAL[1]
    )


def stretch_peak_of(number: int, periods: Periods, peak_unc: Floats) -> tuple[float, float]:
    """Return λ_pN and its standard uncertainty: measured, or on the decay of the last measured peaks.

    Beyond the measured peaks what is above 1 shrinks by the same share from peak to peak; all of it is uncertain.
    NaN where there are not two peaks to tell the share.
    """
    peaks = periods.peak[np.isfinite(periods.peak)]
    if number <= peaks.size:
        return float(periods.peak[number - 1]), float(peak_unc[number - 1])
    above = peaks - 1.0
    if peaks.size < 2 or not 0.0 < above[-1] < above[-2]:
        return float("nan"), float("nan")
    left = float(above[-1] * (above[-1] / above[-2]) ** (number - peaks.size))
    return 1.0 + left, float(np.hypot(left, peak_unc[peaks.size - 1]))
