"""One λ(t) from two views: which view counts when, by which weight, and the offset between their clocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.interpolation import lagrange_cubic
from wentry_cli.kinematics.outliers import scatter_ratio

Array = NDArray[np.float64]
MINIMUM_OVERLAP = 10
NEAREST = 5
SHARED_FRAMES = 0.01


@dataclass(frozen=True)
class Offset:
    """Time to add to the top view's clock, s, its standard uncertainty, and whether it is clearly determined."""

    seconds: float
    uncertainty_s: float
    determined: bool


@dataclass(frozen=True)
class MergedStretch:
    """λ at the frames of the leading view (n,): value, uncertainty, source word, and both views' own λ."""

    stretch: Array
    stretch_unc: Array
    source: NDArray[np.str_]
    top: Array
    side: Array


def merge_stretch(
    times_s: Array,
    side: tuple[Array, Array],
    top_times_s: Array,
    top: tuple[Array, Array],
    *,
    dome_over_s: float = float("nan"),
    slow_s: float = 0.0,
) -> MergedStretch:
    """Merge λ of the ``side`` view at ``times_s`` with λ of the ``top`` view at its own times (values, uncertainties).

    The top view counts before dome-over (NaN: it never domes over), the side view wherever it was measured; both
    together by 1/u². Where they disagree by more than their uncertainties, that of the mean is widened (Birge ratio).

    Beside the frames that both see, the side view keeps what the overlap taught: the part of its uncertainty that does
    not scatter is an error that changes over ``slow_s`` (0: nothing is known), so that λ does not step where the top
    view comes and goes, and the uncertainty grows from the joint one to the side view's own. The top view keeps it in
    the same way for good: its error is that of its depth and scale, which are one in all frames. How far the views'
    difference changes over the frames that both see is then left in its uncertainty.
    """
    seen, variance = _at(times_s, top_times_s, top)
    if np.isfinite(dome_over_s):
        seen = np.where(times_s < dome_over_s, seen, np.nan)
    top_unc = np.where(np.isfinite(seen), np.sqrt(variance), np.nan)
    has_side, has_top = _measured(*side), _measured(seen, top_unc)
    both = has_side & has_top
    weight_side = np.where(has_side, 1.0 / np.where(has_side, side[1], 1.0) ** 2, 0.0)
    weight_top = np.where(has_top, 1.0 / np.where(has_top, top_unc, 1.0) ** 2, 0.0)
    total = weight_side + weight_top
    any_view = total > 0.0
    total = np.where(any_view, total, 1.0)
    value = (weight_side * np.where(has_side, side[0], 0.0) + weight_top * np.where(has_top, seen, 0.0)) / total
    quarrel = np.where(both, np.abs(side[0] - seen) / np.where(both, np.hypot(side[1], top_unc), 1.0), 0.0)
    unc = np.maximum(1.0, quarrel) / np.sqrt(total)
    source = np.select([both, has_top, has_side], ["both", "top", "side"], "")
    if slow_s > 0.0:
        for one, other, alone, lasting in (
            (side, (seen, top_unc), has_side & ~has_top, slow_s),
            ((seen, top_unc), side, has_top & ~has_side, np.inf),
        ):
            correction, narrower = _carried(times_s, one, other, (both, alone), lasting)
            changes = _change(seen - side[0], both) if lasting == np.inf else 0.0
            value, unc = value - correction, np.where(narrower > 0.0, np.hypot(narrower, changes), unc)
    return MergedStretch(
        np.where(any_view, value, np.nan),
        np.where(any_view, unc, np.nan),
        source,
        np.where(has_top, seen, np.nan),
        np.where(has_side, side[0], np.nan),
    )


def _at(times: Array, top_times: Array, top: tuple[Array, Array]) -> tuple[Array, Array]:
    """λ of the top view at other times and its variance; no cubic leads across the impact at 0, where λ has a kink."""
    value, variance = np.full(times.shape, np.nan), np.full(times.shape, np.nan)
    for own, here in ((top_times < 0.0, times < 0.0), (top_times >= 0.0, times >= 0.0)):
        value[here], variance[here] = lagrange_cubic(top_times[own], top[0][own], top[1][own] ** 2, times[here])
    return value, variance


def _change(apart: Array, both: NDArray[np.bool_]) -> float:
    """How far a difference of the two views changes over the frames that both see: half of what its means span."""
    seen = apart[both]
    if seen.size < NEAREST:
        return 0.0
    means = np.convolve(seen, np.full(NEAREST, 1.0 / NEAREST), mode="valid")
    return 0.5 * float(np.ptp(means))


def _carried(
    times: Array,
    one: tuple[Array, Array],
    other: tuple[Array, Array],
    which: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    slow_s: float,
) -> tuple[Array, Array]:
    """What to take off λ of the frames that ``one`` view sees alone, and their uncertainty (0: leave it).

    The slow error in units of the stated uncertainty is a Gaussian process; it is seen in the nearest frames of both
    views, whose slow errors are taken as one, and is the less certain the further these are. Where the scatter shows
    more than a quarter of the stated variance nothing is carried: there is little but noise.
    """
    both, alone = which
    correction, narrower = np.zeros(times.shape), np.zeros(times.shape)
    index = np.flatnonzero(both)
    ratio = scatter_ratio(times, *one)
    seen = ratio * (1.0 + 3.0 / np.sqrt(2.0 * max(float(np.isfinite(one[0]).sum()), 1.0)))
    if index.size < NEAREST or not seen < 0.5:
        return correction, narrower
    slow = 1.0 - seen**2
    apart = (one[0] - other[0]) / one[1]
    weight = 1.0 / (seen**2 + (other[1] / one[1]) ** 2)
    for k in np.flatnonzero(alone):
        near = index[np.argsort(np.abs(times[index] - times[k]), kind="stable")[:NEAREST]]
        mean = float(np.sum(weight[near] * apart[near]) / np.sum(weight[near]))
        # the other view's own error is common to its frames: no mean of them is better than one
        noise = seen**2 / NEAREST + float(np.median((other[1] / one[1])[near] ** 2))
        known = slow / (slow + noise)
        close = float(np.exp(-0.5 * ((times[k] - times[near[0]]) / slow_s) ** 2))
        correction[k] = one[1][k] * close * known * mean
        narrower[k] = one[1][k] * np.sqrt(1.0 - slow * close**2 * known)
    return correction, narrower


def find_offset(
    times_s: Array, side: tuple[Array, Array], top_times_s: Array, top: tuple[Array, Array], *, interval_s: float
) -> Offset:
    """Find the offset of the top view's clock from frames in which both views measure λ.

    λ_side(t) − λ_top(t) = b + δ λ̇ is fitted by weighted least squares in δ and b (a constant difference of scale must
    not pass for time), twice. What the two views get wrong alike with λ̇, a hundredth of a frame, counts in its
    uncertainty. It is clearly determined with ten common frames, δ known to a tenth of a frame, beyond three standard
    uncertainties, and below two frames.
    """
    shift, spread = 0.0, np.inf
    for _ in range(2):
        step, spread = _offset_step(times_s, side, top_times_s + shift, top)
        if not np.isfinite(step):
            return Offset(0.0, np.inf, False)
        shift += step
    spread = float(np.hypot(spread, SHARED_FRAMES * interval_s))
    clear = spread < 0.1 * interval_s and 3.0 * spread < abs(shift) < 2.0 * interval_s
    return Offset(shift, spread, bool(clear))


def _offset_step(
    times: Array, side: tuple[Array, Array], top_times: Array, top: tuple[Array, Array]
) -> tuple[float, float]:
    seen, variance = _at(times, top_times, top)
    rate = np.gradient(seen, times)
    total = np.sqrt(variance + side[1] ** 2)
    good = np.isfinite(seen) & np.isfinite(rate) & _measured(side[0], total)
    if good.sum() < MINIMUM_OVERLAP or np.ptp(rate[good]) == 0.0:
        return float("nan"), np.inf
    # a top clock that runs late by δ shows λ_top(t) = λ(t − δ): the correction is added to its times
    design = np.stack([-rate[good], np.ones(int(good.sum()))], axis=1) / total[good, None]
    difference = (side[0] - seen)[good] / total[good]
    solution = np.linalg.lstsq(design, difference, rcond=None)[0]
    residual = difference - design @ solution
    scale = max(1.0, float(np.sqrt(np.sum(residual**2) / (good.sum() - 2))))
    return float(solution[0]), scale * float(np.sqrt(np.linalg.inv(design.T @ design)[0, 0]))


def _measured(value: Array, unc: Array) -> NDArray[np.bool_]:
    return np.isfinite(value) & np.isfinite(unc) & (unc > 0.0)
