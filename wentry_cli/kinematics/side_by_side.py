"""The likelihood of several sets of hyperparameters in one pass of a Kalman filter over the record, O(n).

A filter waits for its own last result at every step. ``SETS`` of them, one number of each beside that of the next in
memory, let the processor do the same step of all with one instruction: all cost little more than one.

Means and covariances, of which the upper triangle is kept, lie in one array ``s`` whose parts are named by where they
begin. A state of order 3 is one of order 4 whose last element is 0 and stays so.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.kinematics.state_space import LAG, LAG_SPREAD, add_noise

Array = NDArray[np.float64]
SETS = 4
_ORDER = 4
_PARTS = 17
_X0, _X1, _X2, _X3, _P00, _P01, _P02, _P03, _P11, _P12, _P13, _P22, _P23, _P33, _PRODUCT, _SQUARES, _NOISE = range(
    0, _PARTS * SETS, SETS
)
_NOW, _FALL, _RATE, _SIZE = range(0, 4 * SETS, SETS)  # of a burst: its rest, what a step leaves of it, 1/tau, q0 tau
_GATHERED = 4  # innovations whose variances are multiplied before a logarithm is taken of them
_SAME_STEP = (
    1e-4  # frames: so little from the usual step, and four terms of the exponential's series are all of its digits
)
_GONE = 1e-200


@compiled
def log_likelihoods(
    nodes: Array, laws: Array, events: Array, strengths: Array, start_mean: Array, start_covariance: Array
) -> tuple[Array, Array]:
    """Return Σ log F and Σ v²/F, each (``SETS``,), of the innovations v and their variances F.

    ``nodes`` has the rows (time, value, variance, event): ``event`` is −1 at a frame, else the index of the event, and
    then ``value`` and ``variance`` are the variances of a jump of the velocity and of the position. ``laws``
    (``SETS``, 7) and ``strengths`` (``SETS``, events) are those of each set, ``start_mean`` (3 or 4,) and
    ``start_covariance`` what is known at the first node. Raises ``ValueError`` for another order.
    """
    m, n = start_mean.shape[0], nodes.shape[0]
    if m not in (3, _ORDER):
        raise ValueError("the order of the state is 3 or 4")
    noise = densities(nodes, laws, events, strengths)
    unit = _unit_noise(m)
    s = _start(start_mean, start_covariance)
    logs = np.zeros(SETS)
    gathered = 0
    for k in range(n):
        step = nodes[k, 0] - nodes[max(k - 1, 0), 0]
        if step > 0.0:
            for at in range(SETS):
                s[_NOISE + at] = noise[k, at]
            _predict(s, step, _noise_over(unit, step, m))
        event = int(nodes[k, 3])
        if event >= 0:
            _jump(s, laws, strengths[:, event], nodes[k], m)
            continue
        _update(s, nodes[k, 1], nodes[k, 2])
        gathered += 1
        if gathered % _GATHERED == 0:
            _take_logarithms(s, logs)
    _take_logarithms(s, logs)
    return logs, s[_SQUARES : _SQUARES + SETS].copy()


@compiled
def densities(nodes: Array, laws: Array, events: Array, strengths: Array) -> Array:
    """Mean density (n, ``SETS``) of the process noise on the way to each node, as ``state_space.density``."""
    n = nodes.shape[0]
    found = np.zeros((n, SETS))
    for k in range(1, n):
        start, stop = nodes[k - 1, 0], nodes[k, 0]
        share = 1.0
        if events.shape[0] > 0:
            share = (stop - max(start, events[0])) / (stop - start) if stop > events[0] and stop > start else 0.0
        for at in range(SETS):
            found[k, at] = laws[at, 0] * share
    for i in range(events.shape[0]):
        for strength, decay in ((1, 2), (5, 6)):
            _add_burst(nodes, (laws[:, strength], laws[:, decay]), events[i], strengths[:, i], found)
    return found


@compiled
def _add_burst(nodes: Array, burst: tuple[Array, Array], event: float, strengths: Array, found: Array) -> None:
    """Add the mean over each step of strength² · q0 · exp(−(t − event)/tau) after the event.

    ``burst`` are q0 and tau. Frames follow each other at one interval, so what a step leaves of the burst is the same
    for all but a few, and known to all digits from that where a rounding of the time makes it differ.
    """
    s = np.zeros(4 * SETS)
    for at in range(SETS):
        s[_RATE + at] = 1.0 / burst[1][at]
        s[_SIZE + at] = strengths[at] ** 2 * burst[0][at] * burst[1][at]
        s[_NOW + at] = -1.0
    usual = math.nan
    for k in range(1, nodes.shape[0]):
        start, stop = nodes[k - 1, 0] - event, nodes[k, 0] - event
        length = stop - max(start, 0.0)
        if stop <= 0.0 or length <= 0.0:
            continue
        if not abs(length - usual) < _SAME_STEP:
            usual = length
            for at in range(SETS):
                s[_FALL + at] = math.exp(-usual * s[_RATE + at])
        if s[_NOW] < 0.0:
            for at in range(SETS):
                s[_NOW + at] = math.exp(-max(start, 0.0) * s[_RATE + at])
        for at in range(SETS):
            off = (length - usual) * s[_RATE + at]
            rest = s[_NOW + at] * s[_FALL + at] * (1.0 - off * (1.0 - off / 2.0 * (1.0 - off / 3.0)))
            found[k, at] += s[_SIZE + at] * (s[_NOW + at] - rest) / (stop - start)
            s[_NOW + at] = rest if rest > _GONE else 0.0  # what is smaller is slow to reckon with


@compiled
def _unit_noise(m: int) -> Array:
    """Covariance (4, 4) of the process noise of density 1 over a step of 1; 0 beyond the order ``m``."""
    unit, own = np.zeros((_ORDER, _ORDER)), np.zeros((m, m))
    add_noise(own, 1.0, 1.0)
    unit[:m, :m] = own
    return unit


@compiled
def _noise_over(
    unit: Array, step: float, m: int
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """The upper triangle, row by row, of the covariance of noise of density 1 over ``step``."""
    p0 = step ** (2 * m - 7)
    p1 = p0 * step
    p2 = p1 * step
    p3, p4 = p2 * step, p2 * step * step
    p5, p6 = p4 * step, p4 * step * step
    return (
        unit[0, 0] * p6, unit[0, 1] * p5, unit[0, 2] * p4, unit[0, 3] * p3, unit[1, 1] * p4,
        unit[1, 2] * p3, unit[1, 3] * p2, unit[2, 2] * p2, unit[2, 3] * p1, unit[3, 3] * p0,
    )  # fmt: skip


@compiled
def _start(mean: Array, covariance: Array) -> Array:
    s = np.zeros(_PARTS * SETS)
    at_mean, at_covariance = _X0, _P00
    for i in range(_ORDER):
        if i < mean.shape[0]:
            s[at_mean : at_mean + SETS] = mean[i]
        at_mean += SETS
        for j in range(i, _ORDER):
            if j < mean.shape[0]:
                s[at_covariance : at_covariance + SETS] = covariance[i, j]
            at_covariance += SETS
    s[_PRODUCT : _PRODUCT + SETS] = 1.0
    return s


@compiled
def _predict(
    s: Array, step: float, noise: tuple[float, float, float, float, float, float, float, float, float, float]
) -> None:
    """Carry all sets over ``step``, in place: F x and F P Fᵀ with F the Taylor series, and the noise."""
    n00, n01, n02, n03, n11, n12, n13, n22, n23, n33 = noise
    c1, c2, c3 = step, step * step / 2.0, step * step / 2.0 * step / 3.0
    for at in range(SETS):
        x1, x2, x3 = s[_X1 + at], s[_X2 + at], s[_X3 + at]
        s[_X0 + at] = s[_X0 + at] + c1 * x1 + c2 * x2 + c3 * x3
        s[_X1 + at] = x1 + c1 * x2 + c2 * x3
        s[_X2 + at] = x2 + c1 * x3
        p01, p02, p03 = s[_P01 + at], s[_P02 + at], s[_P03 + at]
        p11, p12, p13 = s[_P11 + at], s[_P12 + at], s[_P13 + at]
        p22, p23, p33 = s[_P22 + at], s[_P23 + at], s[_P33 + at]
        a00, a01 = s[_P00 + at] + c1 * p01 + c2 * p02 + c3 * p03, p01 + c1 * p11 + c2 * p12 + c3 * p13
        a02, a03 = p02 + c1 * p12 + c2 * p22 + c3 * p23, p03 + c1 * p13 + c2 * p23 + c3 * p33
        a11, a12, a13 = p11 + c1 * p12 + c2 * p13, p12 + c1 * p22 + c2 * p23, p13 + c1 * p23 + c2 * p33
        a22, a23 = p22 + c1 * p23, p23 + c1 * p33
        q = s[_NOISE + at]
        s[_P00 + at] = a00 + c1 * a01 + c2 * a02 + c3 * a03 + q * n00
        s[_P01 + at] = a01 + c1 * a02 + c2 * a03 + q * n01
        s[_P02 + at] = a02 + c1 * a03 + q * n02
        s[_P03 + at] = a03 + q * n03
        s[_P11 + at] = a11 + c1 * a12 + c2 * a13 + q * n11
        s[_P12 + at] = a12 + c1 * a13 + q * n12
        s[_P13 + at] = a13 + q * n13
        s[_P22 + at] = a22 + c1 * a23 + q * n22
        s[_P23 + at] = a23 + q * n23
        s[_P33 + at] = p33 + q * n33


@compiled
def _update(s: Array, value: float, variance: float) -> None:
    """Let all sets take in one measurement of the position, in place."""
    for at in range(SETS):
        p0, p1, p2, p3 = s[_P00 + at], s[_P01 + at], s[_P02 + at], s[_P03 + at]
        innovation = value - s[_X0 + at]
        total = (p0 if p0 > 0.0 else 0.0) + variance
        s[_PRODUCT + at] *= total
        s[_SQUARES + at] += innovation * innovation / total
        s[_X0 + at] += p0 * innovation / total
        s[_X1 + at] += p1 * innovation / total
        s[_X2 + at] += p2 * innovation / total
        s[_X3 + at] += p3 * innovation / total
        s[_P00 + at] -= p0 * p0 / total
        s[_P01 + at] -= p0 * p1 / total
        s[_P02 + at] -= p0 * p2 / total
        s[_P03 + at] -= p0 * p3 / total
        s[_P11 + at] -= p1 * p1 / total
        s[_P12 + at] -= p1 * p2 / total
        s[_P13 + at] -= p1 * p3 / total
        s[_P22 + at] -= p2 * p2 / total
        s[_P23 + at] -= p2 * p3 / total
        s[_P33 + at] -= p3 * p3 / total


@compiled
def _jump(s: Array, laws: Array, strengths: Array, node: Array, m: int) -> None:
    """Widen the covariances of all sets, in place, by a jump of acceleration and jerk and those in ``node``.

    The velocity is behind the jump of the acceleration, as in ``square_root.jump_root``.
    """
    for at in range(SETS):
        s[_P00 + at] += node[2]
        duration, jump = laws[at, 6], (strengths[at] * laws[at, 3]) ** 2
        s[_P11 + at] += node[1] + (LAG**2 + LAG_SPREAD**2) * duration**2 * jump
        s[_P12 + at] -= LAG * duration * jump
        s[_P22 + at] += jump
        if m == _ORDER:
            s[_P33 + at] += (strengths[at] * laws[at, 4]) ** 2


@compiled
def _take_logarithms(s: Array, logs: Array) -> None:
    for at in range(SETS):
        logs[at] += math.log(s[_PRODUCT + at])
        s[_PRODUCT + at] = 1.0
