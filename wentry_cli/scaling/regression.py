"""Regressions over drops: through the origin, with an intercept, as a power law; intervals by Student's t.

Drops of one sphere share its material and repeats of one condition share everything, so that they are not independent:
the uncertainty counts spheres, or conditions where there are not more spheres than parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.scaling.grouped import Parameter, fit_parameters

Array = NDArray[np.float64]
Labels = NDArray[np.int64]
MINIMUM_POINTS = 5
LEAST_SPREAD = 0.1  # of x, over its greatest value or in ln x; points that are nearer tell no trend


@dataclass(frozen=True)
class Regression:
    """A line y = slope x (+ intercept) or a power law y = slope x^exponent; NaN where a number does not apply.

    ``slope_low`` and ``slope_high`` hold 95 %, for a power law those of the prefactor; the interval of the exponent is
    ``exponent_low`` to ``exponent_high``. ``dof`` are the degrees of freedom behind the interval of the slope, of a
    power law that of the exponent. ``residual_scatter`` is a standard deviation, of ln y for a power law. ``status`` is
    ok or too_few: fewer than five points, or points within a tenth in x, give no number, no more groups than parameters
    no uncertainty.
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
    dof: float
    r_squared: float
    residual_scatter: float
    n: int
    n_conditions: int
    n_spheres: int
    status: str


@dataclass(frozen=True)
class Points:
    """Drops to be fitted: abscissa, ordinate, and the numbers of the sphere and of the condition of each."""

    x: Array
    y: Array
    spheres: Labels
    conditions: Labels

    def only(self, keep: NDArray[np.bool_]) -> Points:
        """Return the points that ``keep`` marks."""
        return Points(self.x[keep], self.y[keep], self.spheres[keep], self.conditions[keep])

    @property
    def counts(self) -> dict[str, int]:
        """How many points, conditions and spheres there are."""
        return {
            "n": int(self.x.size),
            "n_conditions": int(np.unique(self.conditions).size),
            "n_spheres": int(np.unique(self.spheres).size),
        }


def fit_line(points: Points, *, intercept: bool = False) -> Regression:
    """Least squares line through the points (NaN left out), through the origin unless ``intercept``.

    ``r_squared`` is the share of Σ(y − ȳ)² explained in both cases.
    """
    points = points.only(np.isfinite(points.x) & np.isfinite(points.y))
    x = points.x
    design = np.stack([x, np.ones_like(x)], axis=1) if intercept else x[:, None]
    found = _fit(points, design, LEAST_SPREAD * float(np.max(np.abs(x), initial=0.0)))
    if found is None:
        return _nothing(points)
    slope, offset = found[0], found[1] if intercept else NOT_FITTED
    return _regression(points, design, found, slope=slope, offset=offset, exponent=NOT_FITTED)


def fit_power_law(points: Points) -> Regression:
    """Least squares of ln y = ln(prefactor) + exponent ln x; points that are not positive are left out."""
    positive = (points.x > 0.0) & (points.y > 0.0) & np.isfinite(points.x) & np.isfinite(points.y)
    points = points.only(positive)
    logs = Points(np.log(points.x), np.log(points.y), points.spheres, points.conditions)
    design = np.stack([np.ones_like(logs.x), logs.x], axis=1)
    found = _fit(logs, design, LEAST_SPREAD)
    if found is None:
        return _nothing(points)
    log, exponent = found
    factor = float(np.exp(log.value))
    slope = Parameter(factor, factor * log.unc, float(np.exp(log.low)), float(np.exp(log.high)), log.dof)
    return _regression(logs, design, found, slope=slope, offset=NOT_FITTED, exponent=exponent)


NOT_FITTED = Parameter(np.nan, np.nan, np.nan, np.nan, np.nan)


def _fit(points: Points, design: Array, least: float) -> list[Parameter] | None:
    """Parameters of the columns of ``design``; None for too few points, or where x does not spread over ``least``."""
    if points.x.size < MINIMUM_POINTS or np.ptp(points.x) <= least:
        return None
    return fit_parameters(design, points.y, _groups(points, design.shape[1]))


def _groups(points: Points, parameters: int) -> Labels:
    """What errs together: the drops of a sphere; where that leaves too few groups, the repeats of a condition.

    Conditions do not help where x is the sphere's own, as D/√(G∞/ρ_s) is: they repeat it.
    """
    few = np.unique(points.spheres).size <= parameters
    return points.conditions if few and np.unique(points.x).size > parameters else points.spheres


def _regression(
    points: Points, design: Array, found: list[Parameter], *, slope: Parameter, offset: Parameter, exponent: Parameter
) -> Regression:
    scatter, share = _scatter(design, points.y, np.array([parameter.value for parameter in found]))
    return Regression(
        slope=slope.value,
        slope_unc=slope.unc,
        slope_low=slope.low,
        slope_high=slope.high,
        intercept=offset.value,
        intercept_unc=offset.unc,
        exponent=exponent.value,
        exponent_unc=exponent.unc,
        exponent_low=exponent.low,
        exponent_high=exponent.high,
        dof=slope.dof if exponent is NOT_FITTED else exponent.dof,
        r_squared=share,
        residual_scatter=scatter,
        **points.counts,
        status="ok" if all(np.isfinite(parameter.unc) for parameter in found) else "too_few",
    )


def _scatter(design: Array, y: Array, fitted: Array) -> tuple[float, float]:
    """Standard deviation of the residuals and the share of the variance of y explained."""
    residual = y - design @ fitted
    total = float(np.sum((y - np.mean(y)) ** 2))
    scatter = float(np.sqrt(np.sum(residual**2) / (y.size - design.shape[1])))
    return scatter, 1.0 - float(np.sum(residual**2)) / total if total > 0.0 else np.nan


def _nothing(points: Points) -> Regression:
    nan = float("nan")
    return Regression(*(nan,) * 13, **points.counts, status="too_few")
