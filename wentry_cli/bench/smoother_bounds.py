"""How well v and a at impact are known to who knows what such falls are like: the best linear estimator.

It sees the frames about impact. Mean and covariance of position, velocity and acceleration are those of an ensemble of
other falls of the same spheres, speeds and slams; the instant of impact and the noise are known.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.falls import GRAVITY, SETTLED_S, make_falls
from wentry_cli.bench.smoother_peers import Method

Array = NDArray[np.float64]
FALLS_KNOWN = "oracle: best linear estimator, mean and covariance of such falls known"
FALLS = 600
SEEN_S = SETTLED_S + 0.002
GRID = np.linspace(0.0, SEEN_S, 601)


def find_bound(seed: int) -> Method:
    """Return the estimator; velocity and acceleration are NaN but within 4 ms after impact."""

    def differentiate(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
        seen, asked = t < SEEN_S, (t >= 0.0) & (t <= SETTLED_S)
        heights, speeds, accelerations = _ensemble(seed)
        dry = np.minimum(t[seen], 0.0)
        falls = _at(heights, np.maximum(t[seen], 0.0)) + speeds[:, :1] * dry - 0.5 * GRAVITY * dry**2
        mean = falls.mean(axis=0)
        total = np.cov(falls.T) + noise**2 * np.eye(mean.size)
        weight = np.linalg.solve(total, y[seen] - mean)
        found = []
        for ensemble in (speeds, accelerations):
            wanted = _at(ensemble, t[asked])
            middle = wanted.mean(axis=0)
            values = np.full(t.size, np.nan)
            values[asked] = middle + (wanted - middle).T @ ((falls - mean) @ weight) / (FALLS - 1)
            found.append(values)
        return found[0], found[1]

    return differentiate


@cache
def _ensemble(seed: int) -> tuple[Array, Array, Array]:
    """Height, velocity and acceleration, each (falls, times of the grid)."""
    falls = make_falls(GRID, FALLS, seed)
    return np.array([f.y for f in falls]), np.array([f.v for f in falls]), np.array([f.a for f in falls])


def _at(ensemble: Array, t: Array) -> Array:
    return np.array([np.interp(t, GRID, member) for member in ensemble])
