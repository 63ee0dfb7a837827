"""Where a cavity starts inside the one before it: the sphere widens again and its contact line leaves a new wall."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.minimum import interior_minima, prominence_of

Floats = NDArray[np.float64]

SMALLEST_SWING = 0.03  # of the stretch from valley to peak: less leaves no wall that could be told apart
BRIDGED_FRAMES = 10


@dataclass(frozen=True)
class CavityStart:
    """When a later cavity starts and how high the contact line is then; NaN and a status where that was not seen."""

    t_s: float
    t_unc_s: float
    y_m: float
    status: str


def find_cavity_starts(t_s: Floats, stretch: Floats, stretch_unc: Floats, separation_y_m: Floats) -> list[CavityStart]:
    """Find the starts of the second, third … cavity from the side view, arrays of shape (n,), NaN where not measured.

    A cavity starts where the stretch, after a valley, crosses 1 on its way up: from there the sphere is wider than the
    wall that it has just left. Where late valleys stay above 1 it is midway between valley and peak, status
    ``no_unit_crossing``; ``no_edge`` where the contact line was not seen then. Empty for a rigid sphere.
    """
    seen = np.isfinite(t_s) & np.isfinite(stretch) & (t_s > 0.0)
    time, values = t_s[seen], stretch[seen]
    if time.size < 9:
        return []
    unc = float(np.nanmedian(stretch_unc[seen])) if np.isfinite(stretch_unc[seen]).any() else 0.0
    swing = max(SMALLEST_SWING, 8.0 * unc)
    peaks = [index for index in interior_minima(-values) if prominence_of(-values, index) >= swing]
    starts = []
    for first, second in pairwise(peaks):
        valley = first + int(np.argmin(values[first:second]))
        starts.append(_start_between(time[valley : second + 1], values[valley : second + 1], unc))
    return [_with_height(start, t_s, separation_y_m) for start in starts]


def _start_between(time: Floats, values: Floats, unc: float) -> CavityStart:
    """Upward crossing of 1 between a valley (first sample) and a peak (last), by a line through its four neighbours."""
    above = np.flatnonzero((values[:-1] < 1.0) & (values[1:] >= 1.0))
    if above.size == 0:
        middle, half = 0.5 * (time[0] + time[-1]), 0.25 * (time[-1] - time[0])
        return CavityStart(float(middle), float(half), np.nan, "no_unit_crossing")
    at = int(above[0])
    part = slice(max(at - 1, 0), min(at + 3, time.size))
    rate = float(np.polyfit(time[part] - time[at], values[part], 1)[0])
    share = (1.0 - values[at]) / (values[at + 1] - values[at])
    step = float(time[at + 1] - time[at])
    return CavityStart(float(time[at] + share * step), float(np.hypot(unc / abs(rate), 0.05 * step)), np.nan, "ok")


def _with_height(start: CavityStart, t_s: Floats, separation_y_m: Floats) -> CavityStart:
    seen = np.isfinite(t_s) & np.isfinite(separation_y_m)
    time, height = t_s[seen], separation_y_m[seen]
    if time.size < 2 or not time[0] <= start.t_s <= time[-1]:
        return CavityStart(start.t_s, start.t_unc_s, np.nan, "no_edge")
    after = int(np.searchsorted(time, start.t_s))
    step = float(np.nanmedian(np.diff(t_s)))
    if after > 0 and time[after] - time[after - 1] > BRIDGED_FRAMES * step:
        return CavityStart(start.t_s, start.t_unc_s, np.nan, "no_edge")
    return CavityStart(start.t_s, start.t_unc_s, float(np.interp(start.t_s, time, height)), start.status)


def wall_numbers(y_m: Floats, t_s: Floats | float, starts: list[CavityStart]) -> NDArray[np.int64]:
    """Return which wall each height belongs to at its time: 1 the outer, k + 1 below where nested cavity k starts."""
    number = np.ones(y_m.size, dtype=np.int64)
    for order, start in enumerate(starts):
        number[(y_m < start.y_m) & (t_s > start.t_s)] = order + 2  # no height is below an unknown one
    return number
