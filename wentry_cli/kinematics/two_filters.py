"""Smoothed states of the model in ``state_space``: a filter forward, an information filter backward, joined, O(n)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.kinematics.square_root import (
    ORDER,
    advance,
    forget,
    join,
    jump_root,
    recall,
    scale_noise,
    take_in,
    triangular,
    unit_root,
    widen,
)
from wentry_cli.kinematics.state_space import add_noise, density, predict

Array = NDArray[np.float64]


@compiled
def filter_forward(
    nodes: Array, law: Array, events: Array, strengths: Array, start_mean: Array, start_covariance: Array
) -> tuple[Array, Array]:
    """Return filtered means (n, 4) and roots of the covariances (n, 4, 4) after each node.

    ``start_covariance`` is diagonal.
    """
    n, m = nodes.shape[0], start_mean.shape[0]
    means, roots = np.zeros((n, ORDER)), np.zeros((n, ORDER, ORDER))
    unit, noise, wide = unit_root(m), np.empty((ORDER, ORDER)), np.empty((ORDER, 2 * ORDER))
    x, S = np.zeros((ORDER, 1)), np.zeros((ORDER, ORDER))
    x[:m, 0] = start_mean
    S[:m, :m] = np.sqrt(start_covariance)
    now = nodes[0, 0]
    for k in range(n):
        step = nodes[k, 0] - now
        if step > 0.0:
            scale_noise(unit, step, density(law, events, strengths, now, nodes[k, 0]), noise)
            advance(x, step)
            advance(S, step)
            widen(S, noise, wide)
        now = nodes[k, 0]
        event = int(nodes[k, 3])
        if event >= 0:
            jump_root(law, strengths[event], nodes[k], m, noise)
            widen(S, noise, wide)
        else:
            take_in(x[:, 0], S, nodes[k, 1], nodes[k, 2])
        means[k] = x[:, 0]
        roots[k] = S
    return means, roots


@compiled
def filter_backward(nodes: Array, law: Array, events: Array, strengths: Array, m: int) -> tuple[Array, Array]:
    """Return information vectors (n, 2, 4) and roots (n, 2, 4, 4): of what all after a node know, and with the node."""
    n = nodes.shape[0]
    vectors, roots = np.zeros((n, 2, ORDER)), np.zeros((n, 2, ORDER, ORDER))
    unit, noise, wide = unit_root(m), np.empty((ORDER, ORDER)), np.empty((ORDER, ORDER + 1))
    z, R = np.zeros((ORDER, 1)), np.zeros((ORDER, ORDER))
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            step = nodes[k + 1, 0] - nodes[k, 0]
            scale_noise(unit, step, density(law, events, strengths, nodes[k, 0], nodes[k + 1, 0]), noise)
            recall(z, R, step, noise)
        vectors[k, 0], roots[k, 0] = z[:, 0], R
        event = int(nodes[k, 3])
        if event >= 0:
            jump_root(law, strengths[event], nodes[k], m, noise)
            forget(z[:, 0], R, noise)
        else:
            wide[:, ORDER] = 0.0
            wide[:, :ORDER] = R
            wide[0, ORDER] = 1.0 / math.sqrt(nodes[k, 2])
            triangular(wide, R)
            z[0, 0] += nodes[k, 1] / nodes[k, 2]
        vectors[k, 1], roots[k, 1] = z[:, 0], R
    return vectors, roots


@compiled
def evaluate(
    queries: Array,
    anchors: NDArray[np.int64],
    nodes: Array,
    law: Array,
    events: Array,
    strengths: Array,
    m: int,
    filtered: tuple[Array, Array],
    ahead: tuple[Array, Array],
) -> tuple[Array, Array]:
    """Smoothed mean (n, m) and covariance (n, m, m) at any time.

    ``anchors`` names, for each query, the last node at or before it (−1 before the first node).
    """
    count, last = queries.shape[0], nodes.shape[0] - 1
    states, spreads = np.empty((count, m)), np.empty((count, m, m))
    unit, noise, work = unit_root(m), np.empty((ORDER, ORDER)), np.empty((2, ORDER, ORDER))
    wide = np.empty((ORDER, 2 * ORDER))
    x, S, z, R = np.empty((ORDER, 1)), np.empty((ORDER, ORDER)), np.empty((ORDER, 1)), np.empty((ORDER, ORDER))
    for i in range(count):
        k = max(anchors[i], 0)
        back = anchors[i] < 0
        here = nodes[k, 0] if back else max(queries[i], nodes[k, 0])
        x[:, 0] = filtered[0][k]
        S[:] = filtered[1][k]
        step = here - nodes[k, 0]
        if step == 0.0:  # the filter from behind has been here too
            z[:, 0], R[:] = ahead[0][k, 0], ahead[1][k, 0]
        else:
            # the filters crossed this gap with one mean density: any other here would not match them
            q = density(law, events, strengths, nodes[k, 0], nodes[k + 1, 0] if k < last else here)
            scale_noise(unit, step, q, noise)
            advance(x, step)
            advance(S, step)
            widen(S, noise, wide)
            z[:], R[:] = 0.0, 0.0
            if k < last:
                z[:, 0], R[:] = ahead[0][k + 1, 1], ahead[1][k + 1, 1]
                scale_noise(unit, nodes[k + 1, 0] - here, q, noise)
                recall(z, R, nodes[k + 1, 0] - here, noise)
        join(x[:, 0], S, z[:, 0], R, work)
        if back:
            predict(x[:, 0], S, queries[i] - here, 0.0)
            add_noise(S[:m, :m], queries[i] - here, density(law, events, strengths, queries[i], here))
        states[i] = x[:m, 0]
        spreads[i] = S[:m, :m]
    return states, spreads
