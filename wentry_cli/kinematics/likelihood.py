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
from wentry_cli.kinematics.side_by_side import SETS, log_likelihoods

Array = NDArray[np.float64]
STEP = 0.25
SEARCH_LIMITS = np.array([[0.3, 14.0], [-1.0, 14.0], [0.0, 12.0], [-9.0, 18.0], [-1.0, 7.0], [-6.0, 1.0]])


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
def costs(
    points: Array, nodes: Array, events: Array, start_mean: Array, start_covariance: Array, limits: Array
) -> Array:
    """Minus the concentrated log likelihood of each row of ``points``, with a steep wall outside the search limits."""
    m, n = start_mean.shape[0], points.shape[0]
    count = max(nodes.shape[0] - events.shape[0] - m, 1)
    values, laws, strengths = np.empty(n), np.empty((SETS, 7)), np.empty((SETS, events.shape[0]))
    for first in range(0, n, SETS):
        for i in range(SETS):
            inside = clipped(points[min(first + i, n - 1)], limits)
            laws[i] = law_of(inside, m)
            strengths[i] = strengths_of(inside, events)
        logs, squares = log_likelihoods(nodes, laws, events, strengths, start_mean, start_covariance)
        for i in range(min(SETS, n - first)):
            fit = 0.5 * (count * math.log(squares[i] / count + 1e-300) + logs[i])
            values[first + i] = fit + _prior(points[first + i], limits)
    return values


@compiled
def _prior(theta: Array, limits: Array) -> float:
    """What ``theta`` costs before any frame is seen: a wall about the limits, and how far it is from what is usual.

    ``limits`` has a row (low, high, usual, spread) for each hyperparameter; an infinite spread says nothing.
    """
    wall, usual = 0.0, 0.0
    for i in range(theta.shape[0]):
        wall += (theta[i] - min(max(theta[i], limits[i, 0]), limits[i, 1])) ** 2
        usual += ((theta[i] - limits[i, 2]) / limits[i, 3]) ** 2
    return float(10.0 * wall + 0.5 * usual)


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
    chosen: Array = grid[np.argmin(costs(grid, nodes, events, start_mean, start_covariance, limits))].copy()
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
    """Nelder–Mead simplex from ``theta``; stops at a spread of 0.01 in the log likelihood or after ``budget`` calls.

    Whatever the simplex may do next is looked at in one pass; a call is counted where it would have to be looked at.
    """
    d = theta.shape[0]
    points = np.empty((d + 1, d))
    for i in range(d + 1):
        points[i] = theta
        if i > 0:
            points[i, i - 1] += 0.5
    values = costs(points, nodes, events, start_mean, start_covariance, limits)
    calls = d + 1
    while calls < budget:
        order = np.argsort(values)
        points = points[order]
        values = values[order]
        if values[d] - values[0] < 0.01:
            break
        moves = _moves(points)
        tried = costs(moves, nodes, events, start_mean, start_covariance, limits)
        move = 0
        calls += 1
        if tried[0] < values[0]:
            move = 1 if tried[1] < tried[0] else 0
            calls += 1
        elif tried[0] >= values[d - 1]:
            near = 2 if tried[0] < values[d] else 3
            calls += 1
            if not (tried[near] < tried[0] and tried[near] < values[d]):
                for i in range(1, d + 1):
                    points[i] = 0.5 * (points[i] + points[0])
                values[1:] = costs(points[1:], nodes, events, start_mean, start_covariance, limits)
                calls += d
                continue
            move = near
        points[d] = moves[move]
        values[d] = tried[move]
    best = np.argmin(values)
    return points[best].copy(), values[best]


@compiled
def _moves(points: Array) -> Array:
    """Where the worst point of a simplex (the last) may go: reflected, twice as far, half as far, half way inwards."""
    d = points.shape[1]
    centre = np.zeros(d)
    for i in range(d):
        centre += points[i] / d
    moves = np.empty((4, d))
    moves[0] = 2.0 * centre - points[d]
    moves[1] = 3.0 * centre - 2.0 * points[d]
    moves[2] = centre + 0.5 * (centre - points[d])
    moves[3] = centre - 0.5 * (centre - points[d])
    return moves
