"""Frames that a recording lost without a gap in its numbers: the sphere makes steps of several frames at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
FEWEST_STEPS = 4
CLEARLY, MAD_TO_SD = 8.0, 1.4826
LEAST_PX = 0.1  # a sphere that hardly moves tells nothing of the time
OFF_WHOLE = 0.2  # steps; a leap of the outline is no whole number of them but by chance
UNEVEN = 0.15  # of a step; how much those around may differ from one another below the surface


def _line_at(own: int) -> Array:
    """Weights of five neighbouring values for the line through all but number ``own``, taken there."""
    others = [other for other in range(5) if other != own]
    weights = np.zeros(5)
    weights[others] = np.linalg.pinv(np.stack([np.ones(4), np.array(others) - own], axis=1))[0]
    return weights


LINE_AT = np.array([_line_at(own) for own in range(5)])


@dataclass(frozen=True)
class LostFrames:
    """Between the frames ``before`` and ``after`` the sphere moves as far as in ``steps`` frames elsewhere."""

    before: int
    after: int
    steps: int


def lost_in_fall(frames: ArrayLike, row_px: ArrayLike, unc_px: ArrayLike, fall_px: float) -> list[LostFrames]:
    """Find the steps of a free fall that are those of several frames.

    ``frames`` are the numbers of the measured ones, (n,) rising, ``row_px`` the rows of a point of the sphere and
    ``unc_px`` their standard uncertainties, ``fall_px`` the acceleration in px per frame squared. All steps but the
    lost ones give one speed: their median. What a step is longer must be a whole number of them, clear of the
    scatter; one that is taken back by the next is a frame in which something else was measured.
    """
    number, row, unc = (np.asarray(item, np.float64) for item in (frames, row_px, unc_px))
    if number.size <= FEWEST_STEPS:
        return []
    apart, way = np.diff(number), np.diff(row)
    middle = 0.5 * (number[1:] + number[:-1])
    speed = float(np.median(way / apart - fall_px * middle))
    step = speed + fall_px * middle
    beyond = way - step * apart
    scatter = MAD_TO_SD * float(np.median(np.abs(beyond)))
    return _whole_steps(number, beyond, step, np.maximum(np.hypot(unc[1:], unc[:-1]), scatter))


def lost_in_water(frames: ArrayLike, row_px: ArrayLike, unc_px: ArrayLike) -> list[LostFrames]:
    """Find the steps of a sphere that slows down evenly which are clearly those of several frames.

    As ``lost_in_fall``, but a step is compared with the line through the four nearest to it, where all of them are of
    neighbouring frames and these four nearly alike.
    """
    number, row, unc = (np.asarray(item, np.float64) for item in (frames, row_px, unc_px))
    way, apart = np.diff(row), np.diff(number)
    if way.size <= FEWEST_STEPS:
        return []
    index = np.arange(way.size)
    first = np.clip(index - 2, 0, way.size - 5)
    around = sliding_window_view(way, 5)[first]
    weight = LINE_AT[index - first]
    own = np.arange(5) == (index - first)[:, None]
    spread = np.where(own, -np.inf, around).max(axis=1) - np.where(own, np.inf, around).min(axis=1)
    even = spread <= UNEVEN * np.abs(np.where(own, 0.0, around).mean(axis=1) * 5.0 / 4.0)
    judged = even & (sliding_window_view(apart, 5)[first] == 1.0).all(axis=1)
    step = np.where(judged, np.sum(weight * around, axis=1), 0.0)
    beyond = np.where(judged, way - step, 0.0)
    scatter = MAD_TO_SD * float(np.median(np.abs(beyond[judged]))) if judged.any() else 0.0
    return _whole_steps(number, beyond, step, np.maximum(np.hypot(unc[1:], unc[:-1]), scatter))


def _whole_steps(number: Array, beyond: Array, step: Array, spread: Array) -> list[LostFrames]:
    """The steps that are longer than ``step`` by a whole number of it; ``number`` has one entry more than they."""
    clear = np.abs(beyond) > CLEARLY * spread
    lost = []
    for index in np.flatnonzero(clear & (beyond > 0.0) & (step > LEAST_PX)):
        more = float(beyond[index] / step[index])
        beside = [other for other in (index - 1, index + 1) if 0 <= other < beyond.size]
        taken_back = any(clear[other] and beyond[other] < -0.5 * beyond[index] for other in beside)
        if not taken_back and round(more) >= 1 and abs(more - round(more)) < OFF_WHOLE:
            lost.append(LostFrames(int(number[index]), int(number[index + 1]), 1 + round(more)))
    return lost
