"""How much of the roughness that a smoothing spline expects a record shows, and error bars that hold as much.

The variance that a spline states has two parts: the noise that it lets pass, and what it takes the truth to do beyond
its bandwidth and smooths away. Of the d-th derivative by order m the second part is (2d + 1)/2m, for the acceleration
by order 4 it is 5/8: where the truth is smoother than that, error bars are √(8/3) too wide (Wahba 1983; Nychka 1988).
The spline of the smoothed track itself shows it, for what that takes off is a bias as well.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.state_pass import StatePass, smooth

Array = NDArray[np.float64]
DERIVATIVES = np.arange(3)
MOST = 2.0
EXPECTED_BEFORE = 2.0  # degrees of freedom that speak for what is expected, whatever the record shows


def shown(smoothing: StatePass, events_s: Array, reach: float) -> float:
    """Return how much of the roughness expected beyond the bandwidth a record shows, up to ``MOST``; 1: as expected.

    Smoothed once more, position changes by b; over its variance V the mean of b² is known where the record is all
    noise beyond the bandwidth and where it is as rough as expected. ``reach`` as of ``inner``.
    """
    record = smoothing.record
    frames = record.nodes[:, 3] < 0
    rows = record.nodes[frames]
    times = record.origin_s + rows[:, 0] * record.interval_s
    weight = inner(smoothing, times, events_s, reach)
    states, covariance = smoothing.evaluate(times)
    variance = covariance[:, 0, 0]
    known = (weight > 0.0) & (variance > 0.0)
    if not known.any():
        return 1.0
    nodes = record.nodes.copy()
    nodes[frames, 1] = states[:, 0] / record.noise_m - record.polynomial(rows[:, 0])[:, 0]
    again, _ = smooth(replace(record, nodes=nodes), smoothing.theta).evaluate(times)
    ratio = float(np.average((again[known, 0] - states[known, 0]) ** 2 / variance[known], weights=weight[known]))
    noise, expected = _changes(record.order)
    freedom = float(np.sum(weight * smoothing.leverage(covariance, rows[:, 2] * record.noise_m**2)))
    share = (ratio - noise) / (expected - noise)
    return min(max((freedom * share + EXPECTED_BEFORE) / (freedom + EXPECTED_BEFORE), 0.0), MOST)


def bar_factors(smoothing: StatePass, times_s: Array, events_s: Array, reach: float, share: float) -> Array:
    """Return factors (n, 3) on the standard uncertainties of position, velocity and acceleration for a share shown."""
    more = (share - 1.0) * inner(smoothing, times_s, events_s, reach)
    part = (2.0 * DERIVATIVES + 1.0) / (2.0 * smoothing.record.order)
    return np.asarray(np.sqrt(1.0 + more[:, None] * part))


def inner(smoothing: StatePass, times_s: Array, events_s: Array, reach: float) -> Array:
    """Return 1 where a spline has a bandwidth, on to 0 at an event (within ``reach`` frames), before it and at an end.

    An end reaches as far as the lasting bandwidth.
    """
    record = smoothing.record
    times = record.frames(times_s)
    left = record.nodes[-1, 0] - times
    if events_s.size == 0:
        left = np.minimum(left, times)
    found = np.clip(left * math.exp(-smoothing.theta[0]), 0.0, 1.0)
    for k, event in enumerate(record.frames(events_s)):
        after = times - event
        found *= np.clip((after if k == 0 else np.abs(after)) / reach - 1.0, 0.0, 1.0)
    return np.asarray(found)


def _changes(order: int) -> tuple[float, float]:
    """Mean of b²/V of position where all is noise beyond the bandwidth, and where the truth is as rough as expected.

    With x = ω²ᵐ the spline passes 1/(1 + x) of an oscillation; noise has a density of 1, the truth one of 1/x.
    """
    s = 1.0 / (2.0 * order)

    def integral(powers: float, size: int) -> float:
        return math.gamma(s + powers) * math.gamma(size - powers - s) / math.gamma(size)

    variance, noise = integral(0, 1), integral(2, 4)
    return noise / variance, (noise + integral(1, 4)) / variance
