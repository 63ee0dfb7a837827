"""Whether a sphere can have moved and deformed as its sightings say: each is judged by those before and after it.

Axis, centre and stretch are judged together, with the covariance of the fit. Each of them is taken for a straight line
in time and on it a Gaussian process with a squared-exponential kernel: motion of an amplitude that such a sphere has,
none of it faster than an oscillation of 20 frames. Where that does not explain the sightings, the stretch may be that
of a sphere that oscillates faster: of the ``PERIODS`` the one counts that makes them most likely, those that it does
not explain being anywhere. Where all motion is less smooth than that, or more so, what is usual nearby is the measure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.normal_equations import factorise, substitute
from wentry_cli.tracking.confirmed import NEIGHBOUR_FRAMES
from wentry_cli.tracking.sighting import Sighting

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
JUDGED = [0, 1, 3]  # x, y and stretch in the order of ``PARAMETERS``
PERIODS = (20.0, 14.0, 10.0, 7.0)  # frames: of the shortest oscillation; that of axis and centre is the first
# Amplitudes of what is no straight line: of axis and centre in radii, of the stretch beside 1.5 times the median of
# what it is off 1 nearby. Of the lines little is known: a radius (or 1) off, and a quarter of it a frame.
ASIDE, DOWN, STRETCHED, OSCILLATES = 0.005, 0.02, 0.005, 1.5
LINE, STEP = 1.0, 0.25
LEFT_OUT = np.array([0.02, 0.02, 0.0005])  # by a fit, beside its uncertainty: px, px, 1
BESIDE = 4  # neighbours on either side that a sighting is judged by
CLOSE_BY = 5.0  # frames to the farthest of them, for one side to count alone
AT_ODDS, AGREES = 0.5, 1.0  # it does where it says less than half of the other side, or no more than one deviation
UNEXPLAINED = 4.0  # standard deviations
AROUND = 25  # sightings that tell what is usual nearby
USUAL_SCORE = 0.77  # the median of the root mean square of three standard normal numbers
LEAST_USUAL, LEAST_ALONE = 0.5, 1.0  # motion may be steadier than its amplitudes allow; less is made of one side alone
LONGEST_RUN = 4  # sightings in a row that may be wrong together
FEWEST, MOST_ROUNDS = 3, 40


@dataclass(frozen=True)
class Course:
    """Good sightings of one sphere as numbers: n frames.

    ``values`` (n, 3) are axis (px), centre (px) and stretch, ``covariance`` (n, 3, 3), ``amplitude`` (n, 3) what they
    may be off a straight line by, ``radius`` px, ``period`` that of the shortest oscillation of the stretch in frames.
    """

    frames: Array
    values: Array
    covariance: Array
    amplitude: Array
    radius: float
    period: float = PERIODS[0]

    @classmethod
    def of(cls, good: Sequence[Sighting]) -> Course:
        """Gather good sightings, one at least, in the order of their frames."""
        fits = [item.fit for item in good if item.fit is not None]
        values = np.array([(fit.center_x_px, fit.center_y_px, fit.stretch) for fit in fits])
        covariance = np.array([fit.covariance for fit in fits])[:, JUDGED][:, :, JUDGED]
        radius = float(np.median([fit.radius_px for fit in fits]))
        moves = np.broadcast_to([ASIDE * radius, DOWN * radius], (len(fits), 2))
        amplitude = np.column_stack([moves, OSCILLATES * _usual(np.abs(values[:, 2] - 1.0)) + STRETCHED])
        return cls(np.array([item.frame for item in good], np.float64), values, covariance, amplitude, radius)

    def predict(self, at: Array, beside: Indices) -> tuple[Array, Array]:
        """Values (m, 3) at the frames ``at`` and their variances, from the sightings ``beside`` (m, k), −1 for none."""
        correlated = np.array([PERIODS[0], PERIODS[0], self.period]) / (2.0 * math.pi)
        return _predict(self.frames, self.values, self._noise(), self.amplitude, self.radius, correlated, at, beside)

    def _noise(self) -> Array:
        """Variances (n, 3) that frames do not have in common."""
        return np.asarray(self.covariance[:, range(3), range(3)] + LEFT_OUT**2)

    def off(self, index: Indices, beside: Indices) -> Array:
        """How far the sightings ``index`` lie off what those ``beside`` them say: rms over the three, in deviations."""
        return np.asarray(np.sqrt(self._squares(index, beside)[0] / len(JUDGED)))

    def likelihood(self, keep: NDArray[np.bool_]) -> Array:
        """Logarithm of how likely each sighting is (n,): one that is kept from its neighbours among those.

        The others are wrong: as likely anywhere within a radius, with any stretch.
        """
        kept = np.flatnonzero(keep)
        own = np.arange(kept.size)
        squares, volume = self._squares(kept, _beside(kept, own, own + 1))
        found = np.full(keep.size, -2.0 * math.log(self.radius))
        found[kept] = -0.5 * (squares + volume + len(JUDGED) * math.log(2.0 * math.pi))
        return found

    def _squares(self, index: Indices, beside: Indices) -> tuple[Array, Array]:
        """Squared deviations of sightings from what others say, and the logarithm of the determinant of the spread."""
        found, variance = self.predict(self.frames[index], beside)
        spread = self.covariance[index] + np.eye(3) * (variance + LEFT_OUT**2)[:, None, :]
        apart = self.values[index] - found
        squares = np.sum(apart * np.linalg.solve(spread, apart[:, :, None])[:, :, 0], axis=1)
        return squares, np.linalg.slogdet(spread)[1]


@compiled
def _predict(
    frames: Array,
    values: Array,
    noise: Array,
    amplitude: Array,
    radius: float,
    correlated: Array,
    at: Array,
    beside: Indices,
) -> tuple[Array, Array]:
    found, variance = np.empty((at.size, 3)), np.empty((at.size, 3))
    apart = np.empty(beside.shape[1])
    for row in range(at.size):
        there = beside[row][beside[row] >= 0]
        size, start = there.size, there[0]
        for i in range(size):
            apart[i] = frames[there[i]] - at[row]
            if abs(apart[i]) < abs(frames[start] - at[row]):
                start = there[i]
        for part in range(3):
            unit = radius if part < 2 else 1.0
            moves, line, step = amplitude[start, part] ** 2, (LINE * unit) ** 2, (STEP * unit) ** 2
            kernel, weight = np.empty((size, size)), np.empty(size)
            for i in range(size):
                for j in range(i + 1):
                    near = math.exp(-0.5 * ((apart[i] - apart[j]) / correlated[part]) ** 2)
                    kernel[i, j] = kernel[j, i] = moves * near + line + step * apart[i] * apart[j]
                kernel[i, i] += noise[there[i], part]
                weight[i] = moves * math.exp(-0.5 * (apart[i] / correlated[part]) ** 2) + line
            cross = weight.copy()
            factorise(kernel)
            substitute(kernel, weight)
            found[row, part], variance[row, part] = values[start, part], moves + line
            for i in range(size):
                found[row, part] += weight[i] * (values[there[i], part] - values[start, part])
                variance[row, part] -= weight[i] * cross[i]
            variance[row, part] = max(variance[row, part], 0.0)
    return found, variance


def without_unexplained(sightings: Sequence[Sighting]) -> list[Sighting]:
    """Call poor what no smooth motion through its neighbours, before and after, explains."""
    kept = list(sightings)
    good = [index for index, item in enumerate(kept) if item.ok]
    if good:
        for index in np.array(good)[~explained(Course.of([kept[index] for index in good]))]:
            kept[index] = Sighting(kept[index].frame, "poor_fit", wet=kept[index].wet)
    return kept


def explained(course: Course) -> NDArray[np.bool_]:
    """Which sightings smooth motion through the others explains.

    Where some are not, their neighbourhood tells how fast the sphere oscillates there: an oscillation that has died
    away is in no later sighting.
    """
    keep = _explained(course)
    if keep.all() or np.count_nonzero(keep) < FEWEST:
        return keep
    courses = [course, *(replace(course, period=period) for period in PERIODS[1:])]
    tried = np.array([keep, *(_explained(other) for other in courses[1:])])
    likely = np.array([other.likelihood(kept) for other, kept in zip(courses, tried, strict=True)])
    near = np.convolve(~keep, np.ones(AROUND))[AROUND // 2 : -(AROUND // 2)] > 0.5
    for start, stop in _runs_of(near):
        keep[start:stop] = tried[np.argmax(likely[:, start:stop].sum(axis=1)), start:stop]
    return keep


def _explained(course: Course) -> NDArray[np.bool_]:
    """Which sightings smooth motion of the period of the course explains.

    A wrong one makes its neighbours look wrong too, and several in a row confirm one another: the run of up to
    ``LONGEST_RUN`` that is farthest off what those around it say goes first, then all are judged again, and at last
    those that went once more by those that did not.
    """
    keep = np.ones(course.frames.size, dtype=bool)
    for _ in range(MOST_ROUNDS):
        kept = np.flatnonzero(keep)
        if kept.size < FEWEST:
            return keep
        own = np.arange(kept.size)
        off = course.off(kept, _beside(kept, own, own + 1))
        usual = _usual(off) / USUAL_SCORE
        wrong = off > UNEXPLAINED * LEAST_USUAL
        wrong[wrong] = _scores(course, kept, usual, (kept[wrong], own[wrong], own[wrong] + 1)) > UNEXPLAINED
        few, first, last = _groups(course.frames[kept])
        wrong[few] |= _scores(course, kept, usual, (kept[few], first, last)) > UNEXPLAINED
        if not wrong.any():
            break
        for start, stop in _worst_runs(course, kept, usual, wrong):
            keep[kept[start:stop]] = False
    gone, kept = np.flatnonzero(~keep), np.flatnonzero(keep)
    place = np.searchsorted(kept, gone)
    keep[gone] = _scores(course, kept, usual, (gone, place, place)) <= UNEXPLAINED
    return keep


def _usual(values: Array) -> Array:
    """Running median over ``AROUND`` values, fewer at the ends."""
    padded = np.pad(values, AROUND // 2, constant_values=np.nan)
    return np.asarray(np.nanmedian(sliding_window_view(padded, AROUND), axis=1))


def _beside(kept: Indices, first: Indices, last: Indices) -> Indices:
    """The nearest four of ``kept`` before place ``first`` in it and from place ``last`` on, (m, 8); −1 where none."""
    step = np.arange(BESIDE)
    place = np.concatenate([first[:, None] - 1 - step, last[:, None] + step], axis=1)
    inside = (place >= 0) & (place < kept.size)
    return np.where(inside, kept[np.clip(place, 0, kept.size - 1)], -1)


def _groups(frames: Array) -> tuple[Indices, Indices, Indices]:
    """Places of the few frames that follow one another closely, apart from all others, and where each few end."""
    group = np.concatenate([[0], np.cumsum(np.diff(frames) > NEIGHBOUR_FRAMES)])
    first, last = np.searchsorted(group, group), np.searchsorted(group, group, side="right")
    few = np.flatnonzero((last - first > 1) & (last - first <= LONGEST_RUN))
    return few, first[few], last[few]


def _scores(course: Course, kept: Indices, usual: Array, judged: tuple[Indices, Indices, Indices]) -> Array:
    """How far sightings lie off those of ``kept`` outside of a run, over what is ``usual``.

    ``judged``: the sightings, and the places in ``kept`` where the run of each begins and ends. Off those on both
    sides, or on one side alone where four are close by and the other side is at odds with them: time may be missing in
    a recording, and a seal strikes the sphere.
    """
    index, first, last = judged
    beside, level = _beside(kept, first, last), usual[np.minimum(first, kept.size - 1)]
    score = course.off(index, beside) / np.maximum(level, LEAST_USUAL)
    doubted = np.flatnonzero((score > UNEXPLAINED) & (beside[:, 0] >= 0) & (beside[:, BESIDE] >= 0))
    sides = beside[doubted, :BESIDE], beside[doubted, BESIDE:]
    off = [course.off(index[doubted], side) / np.maximum(level[doubted], LEAST_ALONE) for side in sides]
    for side, own, other in zip(sides, off, off[::-1], strict=True):
        farthest = np.abs(course.frames[side] - course.frames[index[doubted]][:, None]).max(axis=1)
        told = (side >= 0).all(axis=1) & (farthest <= CLOSE_BY) & (own < np.maximum(AT_ODDS * other, AGREES))
        score[doubted[told]] = np.minimum(score[doubted], own)[told]
    return score


def _worst_runs(course: Course, kept: Indices, usual: Array, wrong: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """In each group of neighbours of which one is wrong: the run (places in ``kept``) that is farthest off the rest."""
    near = np.convolve(wrong, np.ones(2 * BESIDE + 1))[BESIDE:-BESIDE] > 0.5
    found = []
    for start, stop in _runs_of(near):
        runs = [(a, a + size) for size in range(1, LONGEST_RUN + 1) for a in range(start, stop - size + 1)]
        runs = [(a, b) for a, b in runs if wrong[a:b].any() and b - a < kept.size - 1]
        member = np.array([(place, a, b) for a, b in runs for place in range(a, b)])
        squares = _scores(course, kept, usual, (kept[member[:, 0]], member[:, 1], member[:, 2])) ** 2
        own = np.repeat(np.arange(len(runs)), [b - a for a, b in runs])
        found.append(runs[int(np.argmax(np.bincount(own, squares) / np.bincount(own)))])
    return found


def _runs_of(true: NDArray[np.bool_]) -> Indices:
    """Start and stop of each run of what is true (m, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(int))).reshape(-1, 2)
