"""Clocks that go on while the sphere does not: gaps of numbers or stamps between frames of which none is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LONG = 1.7  # intervals: less is unevenness
ALIKE = 0.25  # how much steps of a sphere that keeps its way may differ
LEAST_PX = 1.0  # a sphere that hardly moves tells nothing of the time
MOST_LOOKED_AT = 8
SOME, SAME_RADIUS = 16, 0.1


@dataclass(frozen=True)
class IdleClock:
    """Between the frames ``before`` and ``after`` the clock tells ``intervals``, and the sphere moves as in one."""

    before: int
    after: int
    intervals: float


def stays_in_sight(frames: Sequence[int], radius_of: Callable[[int], float]) -> bool:
    """Whether a sphere, from where it is seen first, is seen with one radius up to the last of ``frames``.

    In air it is; where it meets the water, surface, splash and cavity hide a part of it. ``radius_of`` gives the radius
    of what is seen in a frame, NaN where nothing is, and is asked about some of them alone.
    """
    numbers = np.asarray(frames, dtype=np.intp)
    some = numbers[np.unique(np.linspace(0, numbers.size - 1, SOME).astype(np.intp))]
    radius = np.array([radius_of(int(frame)) for frame in some])
    seen = np.isfinite(radius)
    if not seen[-1]:
        return False
    radius = radius[int(np.argmax(seen)) :]
    return bool(np.all(np.abs(radius - radius[-1]) < SAME_RADIUS * radius[-1]))


def idle_times(frames: Sequence[int], time_s: Array, row_of: Callable[[int], float]) -> list[IdleClock]:
    """Find the long intervals between neighbouring ``frames`` in which a sphere moves as far as in usual ones.

    ``time_s`` are the times of all frames of the clip, ``row_of`` gives the row of the sphere in a frame, px, NaN
    where it is not seen; it is asked about the four frames around a long interval alone.
    """
    numbers = np.asarray(frames, dtype=np.intp)
    between = np.diff(time_s[numbers])
    if between.size < 3:
        return []
    usual = float(np.median(between))
    long = between > LONG * usual
    found = []
    for k in np.flatnonzero(long)[:MOST_LOOKED_AT]:
        if not 0 < k < between.size - 1 or long[k - 1] or long[k + 1]:
            continue
        rows = np.array([row_of(int(numbers[n])) for n in range(k - 1, k + 3)])
        before, way, after = np.diff(rows)
        step = 0.5 * (before + after)
        if step > LEAST_PX and max(abs(way - step), abs(after - before)) < ALIKE * step:
            found.append(IdleClock(int(numbers[k]), int(numbers[k + 1]), float(between[k] / usual)))
    return found
