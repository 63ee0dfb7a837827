"""A smoothing spline as a state-space model: transition, process noise and what an event changes.

The state of order ``m`` is (y, y′, …, y⁽ᵐ⁻¹⁾); white noise of spectral density q(t) drives the last derivative
(the ``m − 1`` times integrated Wiener process, whose posterior mean is the smoothing spline of degree 2m − 1: Wahba
1978; Kohn & Ansley 1987). Smoothed states are made by ``two_filters``; the search for the likelihood's maximum can do
without that care (``side_by_side``).

Everything is in dimensionless units: time in frame intervals, position in standard deviations of the noise. A *node* is
a frame (it has a measurement) or an event (it has a jump of acceleration).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Array = NDArray[np.float64]
LAG, LAG_SPREAD = 0.07, 0.05
"""The acceleration takes a part of the slam's duration to rise: by so much of tau_slam the velocity is behind a jump.

No frame resolves the rise; without it, the velocity just after an event would be known better than anyone can.
"""


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
