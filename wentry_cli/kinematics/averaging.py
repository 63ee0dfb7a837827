"""What is not known of the hyperparameters: smoothings with several of them, each as often as the data allow.

The likelihood of a few hundred frames leaves a bandwidth uncertain by tens of per cent and the strength of a slam by
more. Error bars from the best hyperparameters alone leave that out: at impact they hold two thirds of the time.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv, ndtri

from wentry_cli.kinematics.hyperparameters import likelihood_model
from wentry_cli.kinematics.likelihood import clipped, costs, curvature
from wentry_cli.kinematics.state_pass import StatePass, smooth

Array = NDArray[np.float64]
DRAWS = 96
MEMBERS = 16
FRAMES = 40_000  # times members: a long record knows its hyperparameters better and costs more
FREEDOM = 5.0  # of the t distribution drawn from: its tails must reach further than the likelihood's
WIDEST = 1.5  # the logarithms searched over are taken to be known within this where the likelihood is flat


def members(best: StatePass) -> list[tuple[float, StatePass]]:
    """Return shares (they add up to 1) and smoothings of the record of ``best``, the smoothing of greatest likelihood.

    Importance sampling (Geweke 1989) with a multivariate t about the mode and evenly spread draws, weights cut at the
    root of their number (Ionides 2008), then systematic resampling. The same record gives the same members.
    """
    count = int(min(MEMBERS, FRAMES // best.record.nodes.shape[0]))
    if count < 2:
        return [(1.0, best)]
    model = likelihood_model(best.record)
    mode = clipped(best.theta, model[-1])
    values, vectors = np.linalg.eigh(curvature(mode, *model))
    # the symmetric root: any other would hang on signs that rounding gives the vectors, and the draws with it
    scale = (vectors / np.sqrt(np.maximum(values, WIDEST**-2))) @ vectors.T
    normal, stretch = _even_draws(mode.size)
    points = mode + (normal * stretch[:, None]) @ scale.T
    distance = np.sum((normal * stretch[:, None]) ** 2, axis=1)
    log_drawn = -0.5 * (FREEDOM + mode.size) * np.log1p(distance / FREEDOM)
    log_weight = -costs(points, *model) - log_drawn
    weight = np.exp(log_weight - np.max(log_weight))
    weight = np.minimum(weight, np.mean(weight) * np.sqrt(DRAWS))
    edges = np.cumsum(weight / np.sum(weight))
    chosen = np.searchsorted(edges, (np.arange(count) + 0.5) / count)
    which, times = np.unique(np.minimum(chosen, DRAWS - 1), return_counts=True)
    return [
        (float(n) / count, smooth(best.record, clipped(points[i], model[-1])))
        for i, n in zip(which, times, strict=True)
    ]


@cache
def _even_draws(d: int) -> tuple[Array, Array]:
    """Standard normal draws (DRAWS, d) and the factors that make them Student's, from an additive recurrence."""
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (d + 2))  # Roberts' generalised golden ratio
    steps = root ** -np.arange(1.0, d + 2.0)
    uniform = (0.5 + np.outer(np.arange(DRAWS), steps)) % 1.0
    return ndtri(uniform[:, :d]), np.sqrt(0.5 * FREEDOM / gammaincinv(0.5 * FREEDOM, uniform[:, d]))
