"""The power law of a closing neck, averaged over the exposure, and its least squares within bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.normal_equations import solve

Floats = NDArray[np.float64]

EXPONENT_PRIOR = 0.55
EXPONENT_PRIOR_UNC = 0.04  # a ring (0.5) and an axisymmetric neck before its last instants (0.6) are both likely
CURVATURE_PRIOR_UNC = 1.0  # of c times the span of the fitted samples
LEAST_BEND = 0.05  # of its square: far beyond the samples
LOWEST = np.array(
    [1e-9, -np.inf, 0.3, -0.35]
)  # a ring that falls back from its greatest radius has a curvature of -1/4
HIGHEST = np.array([np.inf, np.inf, 0.9, 20.0])
MOST_STEPS = 60  # a neck that does not close has its minimum far away in a flat valley, of no use to anybody
STILL = 1e-9  # relative step at which the search has ended
FLAT = 1e-10  # relative gain of the cost at which it has ended


@dataclass(frozen=True)
class ClosureLaw:
    """The averaged power law in scaled time (0 at the last sample, −1 at the first) and scaled radius.

    Its parameters are closure time, ln amplitude, exponent and curvature: the radius is amplitude · τ^exponent ·
    √(1 + 2 curvature τ), τ the time that is left. A ring under constant pressure, whose square is a parabola in time,
    follows that exactly with exponent 1/2.
    """

    time: Floats
    radius: Floats
    radius_unc: float
    exposure: float

    def predict(self, parameters: Floats) -> Floats:
        """Mean radius during each exposure."""
        return _evaluate(self.time, self.exposure, parameters)[0]

    def residuals(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Weighted misfit and that of the priors (n + 2,), and their Jacobian (n + 2, 4)."""
        return _residuals((self.time, self.radius), (self.radius_unc, self.exposure), parameters)


@compiled
def _residuals(samples: tuple[Floats, Floats], given: tuple[float, float], parameters: Floats) -> tuple[Floats, Floats]:
    (time, radius), (radius_unc, exposure) = samples, given
    n = time.size
    value, slopes = _evaluate(time, exposure, parameters)
    residual, jacobian = np.empty(n + 2), np.zeros((n + 2, 4))
    residual[:n] = (value - radius) / radius_unc
    jacobian[:n] = slopes / radius_unc
    residual[n] = (parameters[2] - EXPONENT_PRIOR) / EXPONENT_PRIOR_UNC
    residual[n + 1] = parameters[3] / CURVATURE_PRIOR_UNC
    jacobian[n, 2], jacobian[n + 1, 3] = 1.0 / EXPONENT_PRIOR_UNC, 1.0 / CURVATURE_PRIOR_UNC
    return residual, jacobian


@compiled
def _evaluate(time: Floats, exposure: float, parameters: Floats) -> tuple[Floats, Floats]:
    """Mean radius during each exposure (n,), and its derivatives by the parameters (n, 4)."""
    closure, exponent, curvature = parameters[0], parameters[2], parameters[3]
    amplitude = math.exp(parameters[1])
    value, slopes = np.empty(time.size), np.empty((time.size, 4))
    for k in range(time.size):
        remaining = closure - time[k]
        bend = _bend(max(remaining, 0.0), curvature)
        if exposure <= 0.0:
            radius, by_time, by_exponent, by_curvature = _at_once(max(remaining, 0.0), exponent, bend)
        else:
            early = _integral(remaining + 0.5 * exposure, exponent, bend)
            late = _integral(remaining - 0.5 * exposure, exponent, bend)
            radius, by_time = (early[0] - late[0]) / exposure, (early[1] - late[1]) / exposure
            by_exponent, by_curvature = (early[2] - late[2]) / exposure, (early[3] - late[3]) / exposure
        value[k] = amplitude * radius
        slopes[k, 0], slopes[k, 1] = amplitude * by_time, value[k]
        slopes[k, 2], slopes[k, 3] = amplitude * by_exponent, amplitude * by_curvature
    return value, slopes


class _Bend(NamedTuple):
    """√(1 + 2 curvature τ) about a frame's middle as a line in τ, with what changes it.

    It hardly bends within one exposure. ``turns`` is the change of the line's slope from frame to frame, by τ.
    """

    offset: float
    slope: float
    offset_by_curvature: float
    slope_by_curvature: float
    turns: float
    middle: float


@compiled
def _bend(middle: float, curvature: float) -> _Bend:
    root = math.sqrt(max(1.0 + 2.0 * curvature * middle, LEAST_BEND))
    slope, by_curvature = curvature / root, middle / root
    slope_by_curvature = 1.0 / root - curvature * middle / root**3
    offset_by_curvature = by_curvature - slope_by_curvature * middle
    turns = -slope * slope / root if middle > 0.0 else 0.0
    return _Bend(root - slope * middle, slope, offset_by_curvature, slope_by_curvature, turns, middle)


@compiled
def _at_once(left: float, exponent: float, bend: _Bend) -> tuple[float, float, float, float]:
    """Radius and its derivatives by time, exponent and curvature, without exposure."""
    log = math.log(max(left, 1e-300))
    power = left**exponent
    bent = bend.offset + bend.slope * left
    slope = exponent * math.exp((exponent - 1.0) * max(log, -60.0)) * bent + power * bend.slope
    by_curvature = power * (bend.offset_by_curvature + bend.slope_by_curvature * left)
    return power * bent, slope, power * log * bent, by_curvature


@compiled
def _integral(remaining: float, exponent: float, bend: _Bend) -> tuple[float, float, float, float]:
    """The same integrated over the time that remains, zero after the closure."""
    left = max(remaining, 0.0)
    log = math.log(max(left, 1e-300))
    first, second = exponent + 1.0, exponent + 2.0
    power = left**exponent
    area, moment = power * left / first, power * left * left / second
    value = bend.offset * area + bend.slope * moment
    by_exponent = bend.offset * area * (log - 1.0 / first) + bend.slope * moment * (log - 1.0 / second)
    by_curvature = bend.offset_by_curvature * area + bend.slope_by_curvature * moment
    by_time = power * (bend.offset + bend.slope * left) + bend.turns * (moment - bend.middle * area)
    return value, by_time, by_exponent, by_curvature


@dataclass(frozen=True)
class Solution:
    """Parameters at the minimum and the Jacobian of the residuals there."""

    x: Floats
    jac: Floats


def solve_closure(law: ClosureLaw, start: Floats) -> Solution:
    """Minimise the sum of squares from ``start`` by Levenberg–Marquardt; a parameter at a bound stays while it pulls.

    Method: Nocedal and Wright, Numerical Optimization (2006), section 10.3, with gradient projection (16.7).
    """
    return Solution(*_minimise((law.time, law.radius), (law.radius_unc, law.exposure), start))


@compiled
def _minimise(samples: tuple[Floats, Floats], given: tuple[float, float], start: Floats) -> tuple[Floats, Floats]:
    """Parameters at the minimum and the Jacobian of the residuals there."""
    x = np.minimum(np.maximum(start, LOWEST), HIGHEST)
    residual, jacobian = _residuals(samples, given, x)
    cost, damping = np.sum(residual * residual), 1e-3
    for _ in range(MOST_STEPS):
        gradient = (jacobian * residual.reshape(-1, 1)).sum(axis=0)
        held = ((x <= LOWEST) & (gradient > 0.0)) | ((x >= HIGHEST) & (gradient < 0.0))
        trial = np.minimum(np.maximum(x + _step(jacobian, gradient, ~held, damping), LOWEST), HIGHEST)
        tried, slopes = _residuals(samples, given, trial)
        new_cost = np.sum(tried * tried)
        small = np.all(np.abs(trial - x) <= STILL * (np.abs(x) + STILL))
        if new_cost <= cost:
            gain = cost - new_cost
            x, residual, jacobian, cost = trial, tried, slopes, new_cost
            if small or (gain <= FLAT * cost and damping <= 1.0):
                break
            damping = max(0.2 * damping, 1e-14)
        elif small or damping > 1e14:
            break
        else:
            damping *= 8.0
    return x, jacobian


@compiled
def _step(jacobian: Floats, gradient: Floats, free: NDArray[np.bool_], damping: float) -> Floats:
    """The damped step of the parameters that are ``free``; NaN, which no cost takes, where they are not determined."""
    normal, step = np.zeros((4, 4)), np.zeros(4)
    for i in range(4):
        normal[i, i] = 1.0
        for j in range(4):
            if free[i] and free[j]:
                normal[i, j] = np.sum(jacobian[:, i] * jacobian[:, j])
        normal[i, i] = normal[i, i] * (1.0 + damping)
        step[i] = -gradient[i] if free[i] else 0.0
    if not solve(normal, step):
        step[:] = np.nan
    return step
