"""Which cavity closes: cavities are counted by the period in which the contact line made them, not by time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def pinch_off_cavity(
    neck_y_m: float, separation_times_s: ArrayLike, separation_y_m: ArrayLike, period_starts_s: ArrayLike
) -> int | None:
    """Return the number N of the cavity that closes, or None where the contact line was not seen at that depth.

    N is the period during which the separation line passed the depth of the neck that closes first, so that a neck
    between cavities N and N + 1 belongs to N + 1 and D_eff is the stretch peak of that period times D.

    Parameters
    ----------
    neck_y_m : float
        Height of the neck at its closure (``events.csv``: ``pinch_off``, ``y_m``), metres, up positive.
    separation_times_s, separation_y_m : (n,) arrays
        Time after impact and height of the contact line (``side.csv``: ``t_s``, ``separation_y_m``); NaN is skipped.
    period_starts_s : (N,) array
        Starts of the periods 1, 2, … in increasing order (``periods.csv``: ``t_start_s``), the first is the impact.

    Notes
    -----
    The contact line may rise while it recedes; the last downward passage counts, since it made the wall that is left.
    A contact line that was lost and seen again lower down is interpolated linearly in between.
    """
    times, heights = np.asarray(separation_times_s, dtype=float), np.asarray(separation_y_m, dtype=float)
    starts = np.asarray(period_starts_s, dtype=float)
    seen = np.isfinite(times) & np.isfinite(heights)
    # The contact line starts at the surface at the moment of impact.
    times = np.concatenate([starts[:1], times[seen]])
    heights = np.concatenate([[0.0], heights[seen]])
    passes = np.flatnonzero((heights[:-1] > neck_y_m) & (heights[1:] <= neck_y_m))
    if starts.size == 0 or not np.isfinite(starts).all() or not np.isfinite(neck_y_m) or passes.size == 0:
        return None
    last = passes[-1]
    share = (heights[last] - neck_y_m) / (heights[last] - heights[last + 1])
    passage = times[last] + share * (times[last + 1] - times[last])
    period = int(np.searchsorted(starts, passage, side="right"))
    return max(period, 1)
