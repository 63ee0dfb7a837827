"""Hyperparameters of the state-space smoother by maximum likelihood, the noise scale concentrated out.

The process noise is described by bandwidth times instead of densities: a spline of order m with noise of one standard
deviation per frame smooths over about T = q^(−1/2m) frames, so a search over log T meets the same range in every
record, where a search over q or over the classic penalty meets a different one for each (and hits its ends).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.kinematics.state_space import log_likelihood

Array = NDArray[np.float64]
USUAL_SLAM, SLAM_SPREAD = 0.4, 0.7  # logarithm of frames: a slam lasts two or three
USUAL_SHARE = 0.1  # a lasting bandwidth of a tenth of the record, within a factor e
STEP = 0.25
SEARCH_LIMITS = np.array([[0.3, 14.0], [-1.0, 14.0], [0.0, 12.0], [-9.0, 9.0], [-1.0, 7.0], [-6.0, 1.0]])


@compiled
def law_of(theta: Array, m: int) -> Array:
    """Return (q_inf, q0, tau, jump of acceleration, jump of jerk, q_slam, tau_slam) from the logarithms searched over.

    ``theta`` holds the logarithms of: bandwidth of the lasting noise, bandwidth of the burst after an event, decay
    time of the burst (all in frames), jump of the acceleration (noise per frame²), duration of the slam (frames),
    strength of the later events. One element alone is the bandwidth of a plain spline.

    The slam is over in a few frames and turns the acceleration by as much as the jump did: noise that lasts tau_slam
    and changes the acceleration by the jump in that time. Without it a smooth prior cannot follow the peak and is
    overconfident there.
    """
    law = np.zeros(7)
    law[0] = math.exp(-2.0 * m * theta[0])
    law[2] = 1.0
    law[6] = 1.0
    if theta.shape[0] > 1:
        law[1] = math.exp(-2.0 * m * theta[1])
        law[2] = math.exp(theta[2])
        law[3] = math.exp(theta[3])
        law[6] = math.exp(theta[4])
        law[4] = law[3] / law[6]
        law[5] = law[3] ** 2 / law[6] ** (2 * m - 5)
    return law


@compiled
def strengths_of(theta: Array, events: Array) -> Array:
    """Return the strength of each event: 1 for the first, the sixth hyperparameter for later ones."""
    strengths = np.ones(events.shape[0])
    if theta.shape[0] > 5:
        strengths[1:] = math.exp(theta[5])
    return strengths


@compiled
def clipped(theta: Array, limits: Array) -> Array:
    """Return ``theta`` brought within the search limits."""
    inside = theta.copy()
    for i in range(theta.shape[0]):
        inside[i] = min(max(theta[i], limits[i, 0]), limits[i, 1])
    return inside


@compiled
def cost(theta: Array, nodes: Array, events: Array, start_mean: Array, start_covariance: Array, limits: Array) -> float:
    """Minus the concentrated log likelihood, with a steep wall outside the search limits."""
    wall = 0.0
    inside = clipped(theta, limits)
    for i in range(theta.shape[0]):
        wall += float(theta[i] - inside[i]) ** 2
    if theta.shape[0] > 4:
        wall += 0.05 * ((theta[4] - USUAL_SLAM) / SLAM_SPREAD) ** 2
        lasting = math.log(USUAL_SHARE * nodes[nodes.shape[0] - 1, 0])
        wall += 0.05 * (theta[0] - lasting) ** 2
    m = start_mean.shape[0]
    logs, squares = log_likelihood(
        nodes, law_of(inside, m), events, strengths_of(inside, events), start_mean, start_covariance
    )
    count = max(nodes.shape[0] - events.shape[0] - m, 1)
    return float(0.5 * (count * math.log(squares / count + 1e-300) + logs) + 10.0 * wall)


@compiled
def costs(
    points: Array, nodes: Array, events: Array, start_mean: Array, start_covariance: Array, limits: Array
) -> Array:
    """Return the cost of each row of ``points``."""
    values = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        values[i] = cost(points[i], nodes, events, start_mean, start_covariance, limits)
    return values


@compiled
def curvature(
    theta: Array, nodes: Array, events: Array, start_mean: Array, start_covariance: Array, limits: Array
) -> Array:
    """Second derivatives (d, d) of the cost at ``theta``, by differences over a quarter in the logarithms."""
    d = theta.shape[0]
    found = np.empty((d, d))
    corners = np.empty((4, d))
    signs = ((1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0))
    for i in range(d):
        for j in range(i + 1):
            for k in range(4):
                corners[k] = theta
                corners[k, i] += STEP * signs[k][0]
                corners[k, j] += STEP * signs[k][1]
            value = costs(corners, nodes, events, start_mean, start_covariance, limits)
            found[i, j] = (value[0] + value[1] - value[2] - value[3]) / (4.0 * STEP**2)
            found[j, i] = found[i, j]
    return found


@compiled
def best_start(
    grid: Array, nodes: Array, events: Array, start_mean: Array, start_covariance: Array, limits: Array
) -> Array:
    """Return the row of ``grid`` with the least cost."""
    best = 0
    least = math.inf
    for i in range(grid.shape[0]):
        value = cost(grid[i], nodes, events, start_mean, start_covariance, limits)
        if value < least:
            least = value
            best = i
    chosen: Array = grid[best].copy()
    return chosen


@compiled
def minimise(
    theta: Array,
    nodes: Array,
    events: Array,
    start_mean: Array,
    start_covariance: Array,
    limits: Array,
    budget: int,
) -> tuple[Array, float]:
    """Nelder–Mead simplex from ``theta``; stops at a spread of 0.01 in the log likelihood or after ``budget`` calls."""
    d = theta.shape[0]
    points = np.empty((d + 1, d))
    values = np.empty(d + 1)
    for i in range(d + 1):
        points[i] = theta
        if i > 0:
            points[i, i - 1] += 0.5
        values[i] = cost(points[i], nodes, events, start_mean, start_covariance, limits)
    calls = d + 1
    while calls < budget:
        order = np.argsort(values)
        points = points[order]
        values = values[order]
        if values[d] - values[0] < 0.01:
            break
        centre = np.zeros(d)
        for i in range(d):
            centre += points[i] / d
        ahead = 2.0 * centre - points[d]
        value = cost(ahead, nodes, events, start_mean, start_covariance, limits)
        calls += 1
        if value < values[0]:
            far = 3.0 * centre - 2.0 * points[d]
            further = cost(far, nodes, events, start_mean, start_covariance, limits)
            calls += 1
            if further < value:
                ahead, value = far, further
        elif value >= values[d - 1]:
            pull = 0.5 if value < values[d] else -0.5
            near = centre + pull * (centre - points[d])
            nearer = cost(near, nodes, events, start_mean, start_covariance, limits)
            calls += 1
            if nearer < value and nearer < values[d]:
                ahead, value = near, nearer
            else:
                for i in range(1, d + 1):
                    points[i] = 0.5 * (points[i] + points[0])
                    values[i] = cost(points[i], nodes, events, start_mean, start_covariance, limits)
                calls += d
                continue
        points[d] = ahead
        values[d] = value
    best = np.argmin(values)
    return points[best].copy(), values[best]
