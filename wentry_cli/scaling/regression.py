"""Regressions over drops: through the origin, with an intercept, as a power law; intervals by the bootstrap.

Two bootstraps are drawn, over drops and over spheres (drops of one sphere share its material, so that they are not
independent); the reported interval is the wider of the two at each end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MINIMUM_POINTS = 5
RESAMPLES = 2000
LEAST_DRAWS = 100
CONFIDENCE = 0.95
ONE_SIGMA = (15.87, 84.13)


@dataclass(frozen=True)
class Regression:
    """A line y = slope x (+ intercept) or a power law y = slope x^exponent; NaN where a number does not apply.

    ``slope_low`` and ``slope_high`` hold 95 %, for a power law those of the prefactor; the interval of the exponent is
    ``exponent_low`` to ``exponent_high``. ``residual_scatter`` is a standard deviation, of ln y for a power law.
    ``status`` is ok or too_few (fewer than five points: no number).
    """

    slope: float
    slope_unc: float
    slope_low: float
    slope_high: float
    intercept: float
    intercept_unc: float
    exponent: float
    exponent_unc: float
    exponent_low: float
    exponent_high: float
    r_squared: float
    residual_scatter: float
    n: int
    status: str


def fit_line(
    x: Array, y: Array, spheres: NDArray[np.int64], random: np.random.Generator, *, intercept: bool = False
) -> Regression:
    """Least squares line through (x, y), n points (NaN left out), with ``spheres`` naming the sphere of each.

    Through the origin unless ``intercept``; ``r_squared`` is then the share of Σ(y − ȳ)² explained, as with one.
    """
    keep = np.isfinite(x) & np.isfinite(y)
    x, y, spheres = x[keep], y[keep], spheres[keep]
    if x.size < MINIMUM_POINTS or np.ptp(x) == 0.0:
        return _nothing(x.size)
    design = np.stack([x, np.ones_like(x)], axis=1) if intercept else x[:, None]
    fitted = _solve(design, y)
    draws = _bootstrap(design, y, spheres, random)
    if not draws:
        return _nothing(x.size)
    low, high, spread = _interval(draws, 0)
    scatter, share = _scatter(design, y, fitted)
    return Regression(
        slope=float(fitted[0]),
        slope_unc=spread,
        slope_low=low,
        slope_high=high,
        intercept=float(fitted[1]) if intercept else np.nan,
        intercept_unc=_interval(draws, 1)[2] if intercept else np.nan,
        exponent=np.nan,
        exponent_unc=np.nan,
        exponent_low=np.nan,
        exponent_high=np.nan,
        r_squared=share,
        residual_scatter=scatter,
        n=int(x.size),
        status="ok",
    )


def fit_power_law(x: Array, y: Array, spheres: NDArray[np.int64], random: np.random.Generator) -> Regression:
    """Least squares of ln y = ln(prefactor) + exponent ln x; points that are not positive are left out."""
    keep = np.isfinite(x) & np.isfinite(y)
    keep[keep] = (x[keep] > 0.0) & (y[keep] > 0.0)
    logs, values, spheres = np.log(x[keep]), np.log(y[keep]), spheres[keep]
    if logs.size < MINIMUM_POINTS or np.ptp(logs) == 0.0:
        return _nothing(logs.size)
    design = np.stack([np.ones_like(logs), logs], axis=1)
    fitted = _solve(design, values)
    draws = _bootstrap(design, values, spheres, random)
    if not draws:
        return _nothing(logs.size)
    low, high, spread = _interval(draws, 0)
    steep_low, steep_high, steep_spread = _interval(draws, 1)
    scatter, share = _scatter(design, values, fitted)
    return Regression(
        slope=float(np.exp(fitted[0])),
        slope_unc=float(np.exp(fitted[0])) * spread,
        slope_low=float(np.exp(low)),
        slope_high=float(np.exp(high)),
        intercept=np.nan,
        intercept_unc=np.nan,
        exponent=float(fitted[1]),
        exponent_unc=steep_spread,
        exponent_low=steep_low,
        exponent_high=steep_high,
        r_squared=share,
        residual_scatter=scatter,
        n=int(logs.size),
        status="ok",
    )


def _solve(design: Array, y: Array) -> Array:
    return np.asarray(np.linalg.lstsq(design, y, rcond=None)[0], dtype=float)


def _scatter(design: Array, y: Array, fitted: Array) -> tuple[float, float]:
    """Standard deviation of the residuals and the share of the variance of y explained."""
    residual = y - design @ fitted
    total = float(np.sum((y - np.mean(y)) ** 2))
    scatter = float(np.sqrt(np.sum(residual**2) / (y.size - design.shape[1])))
    return scatter, 1.0 - float(np.sum(residual**2)) / total if total > 0.0 else np.nan


def _bootstrap(design: Array, y: Array, spheres: NDArray[np.int64], random: np.random.Generator) -> list[Array]:
    """Parameters of resampled sets, (draws, parameters): over drops and over spheres.

    A way of drawing of which hardly a set has any spread in x is left out; where both are, nothing is known.
    """
    groups = [np.flatnonzero(spheres == s) for s in np.unique(spheres)]
    single = [np.array([i]) for i in range(y.size)]
    both = (_draws(design, y, single, random), _draws(design, y, groups, random))
    return [draws for draws in both if draws.shape[0] > LEAST_DRAWS]


def _draws(design: Array, y: Array, groups: list[NDArray[np.int64]], random: np.random.Generator) -> Array:
    """Weighted normal equations: a resampled set is a count for each group."""
    count, k = len(groups), design.shape[1]
    normal = np.array([design[g].T @ design[g] for g in groups]).reshape(count, k * k)
    right = np.array([design[g].T @ y[g] for g in groups])
    weights = random.multinomial(count, np.full(count, 1.0 / count), size=RESAMPLES)
    matrices = (weights @ normal).reshape(-1, k, k)
    vectors = weights @ right
    # a draw of one sphere alone may have no spread in x and then says nothing about a slope
    regular = np.linalg.cond(matrices) < 1e10
    return np.asarray(np.linalg.solve(matrices[regular], vectors[regular][..., None])[..., 0], dtype=float)


def _interval(draws: list[Array], column: int) -> tuple[float, float, float]:
    """The wider of the percentile intervals at each end, and the greater half width of the central 68 %.

    A few resamples with hardly any spread in x throw their slopes far out; a standard deviation would tell only those.
    """
    tail = 50.0 * (1.0 - CONFIDENCE)
    sets = [d[:, column] for d in draws]
    lows = [float(np.percentile(s, tail)) for s in sets]
    highs = [float(np.percentile(s, 100.0 - tail)) for s in sets]
    return min(lows), max(highs), max(float(np.diff(np.percentile(s, ONE_SIGMA))[0]) / 2 for s in sets)


def _nothing(n: int) -> Regression:
    nan = float("nan")
    return Regression(nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, int(n), "too_few")
