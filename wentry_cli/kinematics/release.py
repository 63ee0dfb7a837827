"""When a sphere that is held at rest at the start of a clip is let go."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
AT_REST = 0.1  # of the speed gained in the fall: what moves faster before it is not held
FEWEST_FALLING, FEWEST_HELD = 5, 2  # frames on either side of a release
MOST_TRIED = 160  # moments tried at first
CLEARLY = 25.0  # of the mean square that is left per frame: what a release must explain more than one parabola does
LEAST_SCATTER = 1e-3  # of the uncertainties, which may hold a common part; below it there is no noise to measure


def release_time(time_s: ArrayLike, position: ArrayLike, unc: ArrayLike) -> float:
    """Find when a held sphere begins to fall, from its path before impact.

    Parameters
    ----------
    time_s, position, unc : (n,)
        Increasing times, s, positions along the fall in any unit and of either sign, and their standard uncertainties,
        of which the ratios count; NaN where not measured.

    Returns
    -------
    float
        Time of the release, s: the frames after it fall freely. −inf where the sphere falls from the first frame on,
        or where too few frames tell.

    Notes
    -----
    A path that is a slow line up to the release and a parabola from there on, tangent to it, is fitted for every moment
    of release; the acceleration is free, so that a wrong scale or frame rate hides no release. It counts if it explains
    clearly more than one parabola through all frames and if what moves before it is slow against the fall: a path that
    bends for another reason goes on falling before its kink.
    """
    time, row, spread = (np.asarray(item, np.float64) for item in (time_s, position, unc))
    good = np.isfinite(time) & np.isfinite(row) & np.isfinite(spread) & (spread > 0.0)
    time, row, spread = time[good], row[good], spread[good]
    if time.size < FEWEST_FALLING + FEWEST_HELD or _falls_at_once(time, row):
        return -math.inf
    first, last = FEWEST_HELD - 1, time.size - FEWEST_FALLING - 1
    tried = time[np.unique(np.linspace(first, last, min(MOST_TRIED, last - first + 1)).astype(int))]
    left = [_kink(time, row, spread, at)[0] for at in tried]
    best = _refined(time, row, spread, tried, int(np.argmin(left)))
    remains, held, gained = _kink(time, row, spread, best)
    explained = _kink(time, row, spread, -math.inf)[0] - remains
    significant = explained > CLEARLY * max(remains / (time.size - 4), LEAST_SCATTER**2)
    return best if significant and abs(held) < AT_REST * abs(gained) else -math.inf


def _falls_at_once(time: Array, row: Array) -> bool:
    """Whether the first frames move about as fast as the last ones do: the usual clip, which needs no search."""
    few = max(2, time.size // 4)
    start = (row[few - 1] - row[0]) / (time[few - 1] - time[0])
    end = (row[-1] - row[-few]) / (time[-1] - time[-few])
    return bool(abs(start) > 0.5 * abs(end))


def _kink(time: Array, row: Array, spread: Array, at: float) -> tuple[float, float, float]:
    """Fit a line that bends into a parabola at a time.

    Returns the weighted sum of squares left, the speed before the bend, and that gained from there to the last frame.
    """
    start, length = time[0], time[-1] - time[0]
    since = np.maximum(time - max(at, start), 0.0) / length
    design = np.stack([np.ones_like(time), (time - start) / length, 0.5 * since**2], axis=1) / spread[:, None]
    solution = np.linalg.lstsq(design, row / spread, rcond=None)[0]
    left = row / spread - design @ solution
    return float(left @ left), float(solution[1]) / length, float(solution[2] * since[-1]) / length


def _refined(time: Array, row: Array, spread: Array, tried: Array, at: int) -> float:
    """The best moment between the neighbours of the best one tried, by repeated thirds."""
    low, high = tried[max(at - 1, 0)], tried[min(at + 1, tried.size - 1)]
    for _ in range(16):
        one, other = low + (high - low) / 3.0, high - (high - low) / 3.0
        if _kink(time, row, spread, one)[0] < _kink(time, row, spread, other)[0]:
            high = other
        else:
            low = one
    return float(0.5 * (low + high))
