"""A smoothing spline as a state-space model: compiled Kalman filter and Bryson–Frazier backward pass, O(n).

The state of order ``m`` is (y, y′, …, y⁽ᵐ⁻¹⁾); white noise of spectral density q(t) drives the last derivative
(the ``m − 1`` times integrated Wiener process, whose posterior mean is the smoothing spline of degree 2m − 1: Wahba
1978; Kohn & Ansley 1987). Nothing here inverts a covariance, so q = 0 (ballistic flight) is allowed.

Everything is in dimensionless units: time in frame intervals, position in standard deviations of the noise. A *node* is
a frame (it has a measurement) or an event (it has a jump of acceleration).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Array = NDArray[np.float64]


@compiled
def predict(x: Array, P: Array, step: float, q: float) -> None:
    """Carry mean ``x`` and covariance ``P`` over ``step`` in place, with process noise of density ``q``."""
    m = x.shape[0]
    for i in range(m):
        c = 1.0
        for j in range(i + 1, m):
            c *= step / (j - i)
            x[i] += c * x[j]
            for k in range(m):
                P[i, k] += c * P[j, k]
    for i in range(m):
        c = 1.0
        for j in range(i + 1, m):
            c *= step / (j - i)
            for k in range(m):
                P[k, i] += c * P[k, j]
    if q > 0.0:
        add_noise(P, step, q)


@compiled
def add_noise(P: Array, step: float, q: float) -> None:
    """Add the covariance of the integrated Wiener process over ``step`` (its sign is kept for steps back in time)."""
    m = P.shape[0]
    length = abs(step)
    for i in range(m):
        for j in range(m):
            power = 2 * m - 1 - i - j
            term = q * length**power / power
            for k in range(2, m - i):
                term /= k
            for k in range(2, m - j):
                term /= k
            if step < 0.0 and (i + j) % 2 == 1:
                term = -term
            P[i, j] += term


@compiled
def update(x: Array, P: Array, value: float, variance: float) -> tuple[float, float]:
    """Take in one measurement of the position, in place; return the innovation and its variance."""
    m = x.shape[0]
    innovation = value - float(x[0])
    total = float(P[0, 0]) + variance
    for i in range(m):
        x[i] += P[i, 0] * innovation / total
    for i in range(m - 1, -1, -1):
        for j in range(m - 1, i - 1, -1):
            P[i, j] -= P[0, i] * P[0, j] / total
            P[j, i] = P[i, j]
    return innovation, total


@compiled
def burst(strength: float, q0: float, tau: float, start: float, stop: float) -> float:
    """Mean over [start, stop] (times after an event) of strength · q0 · exp(−t/tau); zero before the event."""
    if stop <= 0.0 or q0 <= 0.0:
        return 0.0
    first = max(start, 0.0)
    if stop - start < 1e-9:
        return strength * q0 * math.exp(-first / tau)
    return strength * q0 * tau * (math.exp(-first / tau) - math.exp(-stop / tau)) / (stop - start)


@compiled
def density(law: Array, events: Array, strengths: Array, start: float, stop: float) -> float:
    """Mean process noise density over [start, stop].

    ``law`` = (q_inf, q0, tau, jump of acceleration, jump of jerk, q_slam, tau_slam). Without events the density is
    q_inf throughout; with events it is zero before the first of them.
    """
    if events.shape[0] == 0:
        return float(law[0])
    if stop <= events[0]:
        return 0.0
    share = 1.0
    if stop - start > 1e-9:
        share = (stop - max(start, events[0])) / (stop - start)
    total = float(law[0]) * share
    for i in range(events.shape[0]):
        total += burst(strengths[i] ** 2, law[1], law[2], start - events[i], stop - events[i])
        total += burst(strengths[i] ** 2, law[5], law[6], start - events[i], stop - events[i])
    return total


@compiled
def jump(P: Array, law: Array, strength: float, node: Array) -> None:
    """Widen ``P`` in place by a jump of the acceleration (and jerk), and by those that the event's node names."""
    m = P.shape[0]
    P[0, 0] += node[2]
    P[1, 1] += node[1]
    if m > 2:
        P[2, 2] += (strength * law[3]) ** 2
    if m > 3:
        P[3, 3] += (strength * law[4]) ** 2


@compiled
def log_likelihood(
    nodes: Array, law: Array, events: Array, strengths: Array, start_mean: Array, start_covariance: Array
) -> tuple[float, float]:
    """Return (Σ log F, Σ v²/F) of the innovations v and their variances F.

    ``nodes`` has the rows (time, value, variance, event): ``event`` is −1 at a frame, else the index of the event, and
    then ``value`` and ``variance`` are the variances of a jump of the velocity and of the position.
    """
    x = start_mean.copy()
    P = start_covariance.copy()
    logs = 0.0
    squares = 0.0
    now = nodes[0, 0]
    for k in range(nodes.shape[0]):
        time = nodes[k, 0]
        if time > now:
            predict(x, P, time - now, density(law, events, strengths, now, time))
        now = time
        event = int(nodes[k, 3])
        if event >= 0:
            jump(P, law, strengths[event], nodes[k])
        else:
            innovation, total = update(x, P, nodes[k, 1], nodes[k, 2])
            logs += math.log(total)
            squares += innovation * innovation / total
    return logs, squares


@compiled
def filter_forward(
    nodes: Array, law: Array, events: Array, strengths: Array, start_mean: Array, start_covariance: Array
) -> tuple[Array, Array, Array]:
    """Run the filter; return filtered means (n, m), covariances (n, m, m) and gains (n, m + 2).

    The last two columns of the gains hold the innovation and its variance (0 at events).
    """
    n = nodes.shape[0]
    m = start_mean.shape[0]
    means = np.zeros((n, m))
    covariances = np.zeros((n, m, m))
    gains = np.zeros((n, m + 2))
    x = start_mean.copy()
    P = start_covariance.copy()
    now = nodes[0, 0]
    for k in range(n):
        time = nodes[k, 0]
        if time > now:
            predict(x, P, time - now, density(law, events, strengths, now, time))
        now = time
        event = int(nodes[k, 3])
        if event >= 0:
            jump(P, law, strengths[event], nodes[k])
        else:
            column = P[:, 0].copy()
            innovation, total = update(x, P, nodes[k, 1], nodes[k, 2])
            gains[k, :m] = column / total
            gains[k, m] = innovation
            gains[k, m + 1] = total
        means[k] = x
        covariances[k] = P
    return means, covariances, gains


@compiled
def pull_back(r: Array, N: Array, step: float) -> None:
    """Carry the adjoint pair (r, N) back over ``step`` in place: r ← Φᵀ r, N ← Φᵀ N Φ."""
    m = r.shape[0]
    for i in range(m - 1, -1, -1):
        c = 1.0
        for j in range(i - 1, -1, -1):
            c *= step / (i - j)
            r[i] += c * r[j]
            for k in range(m):
                N[i, k] += c * N[j, k]
    for i in range(m - 1, -1, -1):
        c = 1.0
        for j in range(i - 1, -1, -1):
            c *= step / (i - j)
            for k in range(m):
                N[k, i] += c * N[k, j]


@compiled
def smooth_backward(nodes: Array, gains: Array) -> tuple[Array, Array]:
    """Bryson–Frazier recursion: adjoint vectors (n, m) and matrices (n, m, m) just before each node."""
    n = nodes.shape[0]
    m = gains.shape[1] - 2
    vectors = np.zeros((n, m))
    matrices = np.zeros((n, m, m))
    r = np.zeros(m)
    N = np.zeros((m, m))
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            pull_back(r, N, nodes[k + 1, 0] - nodes[k, 0])
        if nodes[k, 3] < 0:
            gain = gains[k, :m]
            total = gains[k, m + 1]
            row = N @ gain
            curvature = gain @ row
            r[0] += gains[k, m] / total - gain @ r
            for i in range(m):
                N[0, i] -= row[i]
                N[i, 0] -= row[i]
            N[0, 0] += curvature + 1.0 / total
        vectors[k] = r
        matrices[k] = N
    return vectors, matrices


@compiled
def evaluate(
    queries: Array,
    anchors: NDArray[np.int64],
    nodes: Array,
    law: Array,
    events: Array,
    strengths: Array,
    filtered: tuple[Array, Array],
    adjoint: tuple[Array, Array],
) -> tuple[Array, Array]:
    """Smoothed mean (n, m) and covariance (n, m, m) at any time.

    ``anchors`` names, for each query, the last node at or before it (−1 before the first node).
    """
    means, covariances = filtered
    vectors, matrices = adjoint
    count, m = queries.shape[0], means.shape[1]
    last = nodes.shape[0] - 1
    states = np.empty((count, m))
    spreads = np.empty((count, m, m))
    for i in range(count):
        k = max(anchors[i], 0)
        back = anchors[i] < 0
        here = nodes[k, 0] if back else max(queries[i], nodes[k, 0])
        x = means[k].copy()
        P = covariances[k].copy()
        if here > nodes[k, 0]:
            # the filter crossed this gap with one mean density: any other here would not match its gains
            stop = nodes[k + 1, 0] if k < last else here
            predict(x, P, here - nodes[k, 0], density(law, events, strengths, nodes[k, 0], stop))
        if k < last:
            r = vectors[k + 1].copy()
            N = matrices[k + 1].copy()
            pull_back(r, N, nodes[k + 1, 0] - here)
            x += P @ r
            P -= P @ N @ P
        if back:
            predict(x, P, queries[i] - here, 0.0)
            add_noise(P, queries[i] - here, density(law, events, strengths, queries[i], here))
        states[i] = x
        spreads[i] = P
    return states, spreads
