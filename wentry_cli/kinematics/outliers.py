"""Frames that do not belong to the track: found before smoothing by their neighbours, after it by their residual."""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wentry_cli.kinematics.state_pass import StatePass

Array = NDArray[np.float64]
MAD_TO_SD = 1.4826
GROSS = 8.0
LATE = 4.0
SPEED_FRAMES = 6  # on either side of an event that tell the speed
MOST_BEND = 2.0 / 3.0  # a velocity that turns round within a frame is off its neighbours' cubic by this many steps
AROUND, LEAST_SHARE = 25, 1e-4


def first_suspects(times: Array, position: Array, variance: Array, events: Array) -> NDArray[np.bool_]:
    """Return a mask of gross outliers: off the cubic through two neighbours on either side by more than 8 MAD.

    A neighbour of an outlier is off too, by less: only the worst of any five adjacent frames goes, then all are judged
    again by what is left. Where outliers are close to each other that takes the wrong ones, so that frames near any
    that went are judged once more, by those farther off. An event may bend the track within a frame by as much as the
    sphere moves in one: near it, that much is allowed.
    """
    keep, limit = np.ones(times.size, dtype=bool), math.inf
    for _ in range(12):
        index = np.flatnonzero(keep)
        if index.size < 9:
            break
        score = np.abs(_neighbour_score(times[index], position[index], variance[index]))
        limit = GROSS * max(MAD_TO_SD * float(np.median(score)), 1e-12 * float(np.ptp(position)) + 1e-300)
        for event in events:
            at = int(np.searchsorted(times[index], event))
            near = np.median(np.abs(np.diff(position[index][max(at - SPEED_FRAMES, 0) : at + SPEED_FRAMES])))
            score[max(at - 2, 0) : at + 2] -= MOST_BEND * near
        padded = np.pad(score, 2)
        highest = np.max([padded[i : i + score.size] for i in range(5)], axis=0)
        worst = (score > limit) & (score >= highest)
        for flagged, own in ((worst, score), (worst[::-1], score[::-1])):
            _at_the_end(flagged, own)
        if not worst.any():
            break
        keep[index[worst]] = False
    return ~_judged_from_afar(times, position, variance, events, keep, limit / GROSS)


def _at_the_end(worst: NDArray[np.bool_], score: Array) -> None:
    """Where the third frame is the worst, name in place the one of the first three that spoils the scores like that.

    An outlier stands in the scores from its second neighbour on as 1, −4, 6, −4, 1: a first frame in the third alone.
    """
    if worst[2]:
        share = score[3] / score[2]
        worst[2] = False
        worst[2 if share > 0.45 else 1 if share > 0.1 else 0] = True


def _judged_from_afar(
    times: Array, position: Array, variance: Array, events: Array, keep: NDArray[np.bool_], spread: float
) -> NDArray[np.bool_]:
    """``keep`` with the frames near those left out judged by a cubic through four on either side that are not.

    As it was where an event or an end of the record is near. ``spread`` is the scatter of the score by neighbours.
    """
    typical = math.sqrt(float(np.median(variance)))
    near = np.convolve(~keep, np.ones(5), mode="same") > 0.5
    judged = keep.copy()
    clear = np.flatnonzero(~near)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    for start, stop in edges.reshape(-1, 2):
        at = int(np.searchsorted(clear, start))
        around = clear[max(at - 4, 0) : at + 4]
        if at < 4 or around.size < 8 or np.any((events > times[around[0]]) & (events < times[around[-1]])):
            continue
        scaled, part = (times - times[start]) / np.ptp(times[around]), slice(start, stop)
        fitted = np.polyfit(scaled[around], position[around], 3, w=1.0 / np.sqrt(variance[around]))
        off = position[part] - np.polyval(fitted, scaled[part])
        judged[part] = np.abs(off) * typical / np.sqrt(variance[part]) <= GROSS * spread
    return judged


def _neighbour_score(t: Array, y: Array, variance: Array) -> Array:
    """Distance of each position from the cubic through its four neighbours, over its own standard deviation."""
    score = np.zeros(t.size)
    middle = slice(2, t.size - 2)
    around = [slice(2 + k, t.size - 2 + k) for k in (-2, -1, 1, 2)]
    predicted = np.zeros(t.size - 4)
    for i in around:
        weight = np.ones(t.size - 4)
        for j in around:
            if j != i:
                weight = weight * (t[middle] - t[j]) / (t[i] - t[j])
        predicted += weight * y[i]
    spread = np.sqrt(variance[middle])
    score[middle] = (y[middle] - predicted) / (spread / np.median(spread))
    return score


def scatter_ratio(times: Array, position: Array, unc: Array) -> float:
    """Return the scatter from frame to frame over the stated uncertainty; NaN with fewer than nine measured frames.

    The scatter is that about the cubic through four neighbours, which leaves (1 + 34/36) times the variance of a frame
    where frames are evenly spaced; what varies slowly drops out.
    """
    good = np.isfinite(position) & np.isfinite(unc) & (unc > 0)
    if good.sum() < 9:
        return float("nan")
    score = _neighbour_score(times[good], position[good], unc[good] ** 2)[2:-2]
    typical = float(np.median(unc[good][2:-2]))
    return MAD_TO_SD * float(np.median(np.abs(score))) / (math.sqrt(70.0 / 36.0) * typical)


def scattering(times: Array, position: Array, unc: Array) -> Array:
    """Return the part of each frame's stated uncertainty that scatters from frame to frame, judged by those around it.

    What the frames of a track have in common (the radius that was put into all of them, a shape that is no ellipse)
    may be most of what is stated in one part of it and little in another. The scatter is that of ``scatter_ratio``
    over ``AROUND`` frames, and no more than stated; what a frame states beyond the median of these is its own. As
    stated with fewer than nine frames.
    """
    if times.size < 9:
        return unc
    score = np.abs(_neighbour_score(times, position, unc**2))[2:-2] / (math.sqrt(70.0 / 36.0) * np.median(unc[2:-2]))
    half = AROUND // 2
    first = np.clip(np.arange(times.size) - 2 - half, 0, max(score.size - AROUND, 0))
    share = MAD_TO_SD * _running_median(score, AROUND)[first]
    usual = _running_median(unc, AROUND + 4)[first]
    own = np.sqrt(np.maximum(unc**2 - usual**2, 0.0))
    return np.asarray(np.hypot(np.minimum(unc, usual) * np.clip(share, LEAST_SHARE, 1.0), own))


def _running_median(values: Array, length: int) -> Array:
    """Medians of all windows of ``length`` neighbours, by their first place; of all values where they are fewer."""
    return np.asarray(np.median(sliding_window_view(values, min(length, values.size)), axis=1))


def unseen_part(residual: Array, unc: Array) -> float:
    """Return the part of the stated uncertainties of a few frames that their scatter about a track does not show.

    Their median, less in quadrature the scatter (clipped at three), taken as large as so few frames allow (three
    standard deviations of a scatter): what is left is common. 0 where they scatter as stated or nothing is known.
    """
    good = np.isfinite(residual) & np.isfinite(unc)
    if not good.any():
        return 0.0
    stated = float(np.median(unc[good]))
    score = np.minimum(np.abs(residual[good]), 3.0 * unc[good]) / np.maximum(unc[good], 1e-300)
    ratio = math.sqrt(float(np.mean(score**2)))
    seen = ratio * (1.0 + 3.0 / math.sqrt(2.0 * float(good.sum())))
    return stated * math.sqrt(max(1.0 - seen**2, 0.0))


def late_suspects(
    passes: tuple[StatePass, ...], times: Array, position: Array, variance: Array, used: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return a mask of frames off the track that all the others give by more than 4 robust standard deviations.

    Frames that were left out before (not ``used``) are judged anew. Where the record was smoothed with more than one
    order a frame is suspect only if it is so by each.
    """
    suspect = np.ones(times.size, dtype=bool)
    for result in passes:
        states, covariance = result.evaluate(times)
        residual = position - states[:, 0]
        own = result.leverage(covariance, variance)
        score = residual / np.sqrt(variance * np.where(used, 1.0 - np.minimum(own, 1.0 - 1e-9), 1.0 + own))
        limit = LATE * MAD_TO_SD * float(np.median(np.abs(score[used])))
        suspect &= (np.abs(score) > limit) & (np.abs(residual) > 1e-9 * float(np.ptp(position)))
    return suspect


def correlation_widening(score: Array) -> float:
    """Return the factor on standard uncertainties for noise of which each frame keeps a share from the frame before.

    ``score`` are residuals in standard deviations, (n,), NaN where not used. A smoothing that takes the noise for white
    follows some of it: the mean of many frames scatters √((1 + r)/(1 − r)) times as much, r their correlation from
    frame to frame. 1 where r is within three standard errors of 0 (residuals of white noise have it a little below).
    """
    both = np.isfinite(score[:-1]) & np.isfinite(score[1:])
    if both.sum() < 9:
        return 1.0
    a, b = score[:-1][both], score[1:][both]
    size = math.sqrt(float(np.sum(a**2) * np.sum(b**2)))
    share = float(np.sum(a * b)) / size if size > 0.0 else 0.0
    if share < 3.0 / math.sqrt(float(both.sum())):
        return 1.0
    return math.sqrt((1.0 + share) / max(1.0 - share, 0.05))
