"""The power law of a closing neck, averaged over the exposure, and its least squares within bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        return self.evaluate(parameters)[0]

    def evaluate(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Mean radius during each exposure (n,), and its derivatives by the parameters (n, 4)."""
        closure, log_amplitude, exponent, curvature = parameters
        remaining = closure - self.time
        bend = _bend(np.maximum(remaining, 0.0), curvature)
        if self.exposure <= 0.0:
            terms = _at_once(np.maximum(remaining, 0.0), exponent, bend)
        else:
            early = _integral(remaining + 0.5 * self.exposure, exponent, bend)
            late = _integral(remaining - 0.5 * self.exposure, exponent, bend)
            terms = (early - late) / self.exposure
        value, by_closure, by_exponent, by_curvature = np.exp(log_amplitude) * terms
        return value, np.stack([by_closure, value, by_exponent, by_curvature], axis=1)

    def residuals(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Weighted misfit and that of the priors (n + 2,), and their Jacobian (n + 2, 4)."""
        value, slopes = self.evaluate(parameters)
        priors = [(parameters[2] - EXPONENT_PRIOR) / EXPONENT_PRIOR_UNC, parameters[3] / CURVATURE_PRIOR_UNC]
        tail = [[0.0, 0.0, 1.0 / EXPONENT_PRIOR_UNC, 0.0], [0.0, 0.0, 0.0, 1.0 / CURVATURE_PRIOR_UNC]]
        misfit = (value - self.radius) / self.radius_unc
        return np.concatenate([misfit, priors]), np.concatenate([slopes / self.radius_unc, tail])


@dataclass(frozen=True)
class _Bend:
    """√(1 + 2 curvature τ) about each frame's middle as a line in τ, with what changes it: arrays of shape (n,).

    It hardly bends within one exposure. ``turns`` is the change of the line's slope from frame to frame, by τ.
    """

    offset: Floats
    slope: Floats
    offset_by_curvature: Floats
    slope_by_curvature: Floats
    turns: Floats
    middle: Floats


def _bend(middle: Floats, curvature: float) -> _Bend:
    root = np.sqrt(np.maximum(1.0 + 2.0 * curvature * middle, LEAST_BEND))
    slope, by_curvature = curvature / root, middle / root
    slope_by_curvature = 1.0 / root - curvature * middle / root**3
    offset_by_curvature = by_curvature - slope_by_curvature * middle
    turns = np.where(middle > 0.0, -slope * slope / root, 0.0)
    return _Bend(root - slope * middle, slope, offset_by_curvature, slope_by_curvature, turns, middle)


def _at_once(left: Floats, exponent: float, bend: _Bend) -> Floats:
    """Radius and its derivatives by time, exponent and curvature, without exposure: (4, n)."""
    log = np.log(np.maximum(left, 1e-300))
    power = left**exponent
    bent = bend.offset + bend.slope * left
    slope = exponent * np.exp((exponent - 1.0) * np.maximum(log, -60.0)) * bent + power * bend.slope
    by_curvature = power * (bend.offset_by_curvature + bend.slope_by_curvature * left)
    return np.stack([power * bent, slope, power * log * bent, by_curvature])


def _integral(remaining: Floats, exponent: float, bend: _Bend) -> Floats:
    """The same integrated over the time that remains, zero after the closure: (4, n)."""
    left = np.maximum(remaining, 0.0)
    log = np.log(np.maximum(left, 1e-300))
    first, second = exponent + 1.0, exponent + 2.0
    power = left**exponent
    area, moment = power * left / first, power * left * left / second
    value = bend.offset * area + bend.slope * moment
    by_exponent = bend.offset * area * (log - 1.0 / first) + bend.slope * moment * (log - 1.0 / second)
    by_curvature = bend.offset_by_curvature * area + bend.slope_by_curvature * moment
    by_time = power * (bend.offset + bend.slope * left) + bend.turns * (moment - bend.middle * area)
    return np.stack([value, by_time, by_exponent, by_curvature])


@dataclass(frozen=True)
class Solution:
    """Parameters at the minimum and the Jacobian of the residuals there."""

    x: Floats
    jac: Floats


def solve_closure(law: ClosureLaw, start: Floats) -> Solution:
    """Minimise the sum of squares from ``start`` by Levenberg–Marquardt; a parameter at a bound stays while it pulls.

    Method: Nocedal and Wright, Numerical Optimization (2006), section 10.3, with gradient projection (16.7).
    """
    x = np.clip(start, LOWEST, HIGHEST)
    residual, jacobian = law.residuals(x)
    cost, damping = float(residual @ residual), 1e-3
    for _ in range(MOST_STEPS):
        gradient = jacobian.T @ residual
        held = ((x <= LOWEST) & (gradient > 0.0)) | ((x >= HIGHEST) & (gradient < 0.0))
        trial = np.clip(x + _step(jacobian, gradient, ~held, damping), LOWEST, HIGHEST)
        tried, slopes = law.residuals(trial)
        new_cost = float(tried @ tried)
        small = bool(np.all(np.abs(trial - x) <= STILL * (np.abs(x) + STILL)))
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
    return Solution(x, jacobian)


def _step(jacobian: Floats, gradient: Floats, free: NDArray[np.bool_], damping: float) -> Floats:
    step = np.zeros(free.size)
    part = jacobian[:, free]
    normal = part.T @ part
    normal.flat[:: normal.shape[0] + 1] *= 1.0 + damping
    step[free] = -np.linalg.lstsq(normal, gradient[free], rcond=None)[0]
    return step
