"""Oscillation of the sphere: Bergström-Boyce equations of an affinely stretched ball, integrated by SciPy.

The equations are those of the paper's appendix A (with the signs and factors put right in docs/theory.md); the
integrator is ``scipy.integrate.solve_ivp`` (DOP853), on purpose another code than the one that fits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from wentry_cli.synthetic.scene import Material, Physics

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Oscillation:
    """Stretch and its rate against the time of the material (s); ``at(tau)`` gives (stretch, d stretch / d tau)."""

    dense: Callable[[Floats], Floats] | None
    end_s: float
    shallow_valleys: float = 0.0
    depth_of_bend: float = 0.04

    def at(self, tau: Floats | float) -> tuple[Floats, Floats]:
        """Stretch and its rate at material time ``tau``; 1 and 0 before impact and for a rigid sphere."""
        tau = np.asarray(tau, float)
        if self.dense is None:
            return np.ones_like(tau), np.zeros_like(tau)
        state = self.dense(np.clip(tau, 0.0, self.end_s).ravel())
        stretch = np.where(tau > 0.0, state[0].reshape(tau.shape), 1.0)
        rate = np.where(tau > 0.0, state[1].reshape(tau.shape), 0.0)
        return self._soften(stretch, rate)

    def _soften(self, stretch: Floats, rate: Floats) -> tuple[Floats, Floats]:
        """Shrink excursions below 1, bending smoothly over ``depth_of_bend`` so that no velocity jumps."""
        if not self.shallow_valleys:
            return stretch, rate
        x, w = stretch - 1.0, self.depth_of_bend
        below = 0.5 * (np.tanh(-x / w) + 1.0)
        slope_below = -0.5 / w / np.cosh(x / w) ** 2
        factor = 1.0 - self.shallow_valleys * below
        return 1.0 + x * factor, rate * (factor - self.shallow_valleys * slope_below * x)


def tabulate_solution(times: Floats, dense: Callable[[Floats], Floats], parts: int = 16) -> CubicSpline:
    """A cubic spline through a solution, each step of the solver in ``parts``: its own interpolant answers slowly."""
    share = np.arange(parts) / parts
    fine = (times[:-1, None] + share * np.diff(times)[:, None]).ravel()
    knots = np.append(fine, times[-1])
    return CubicSpline(knots, dense(knots), axis=1)


def _rate_of_flow(material: Material, viscous: float, elastic: float) -> float:
    """d ln(viscous stretch)/dt."""
    out_of_balance = elastic**2 - elastic**-4
    strain = np.sqrt(2.0 * viscous**2 + viscous**-4) - np.sqrt(3.0) + material.xi
    stress = material.g_t_pa * abs(out_of_balance) / material.tau0_pa
    return float(0.5 * material.eps0_dot_1_s * strain**material.n * stress**material.m * np.sign(out_of_balance))


def solve_oscillation(
    material: Material | None,
    radius_m: float,
    density_kg_m3: float,
    speed_m_s: float,
    physics: Physics,
    *,
    end_s: float,
) -> Oscillation:
    """Integrate the stretch from the undeformed sphere at impact, loaded by the impact, for ``end_s`` seconds.

    The impact gives the sphere a rate of stretch ``physics.loading_rate * U0 / R`` within a time of the order of
    ``physics.loading_time * R / U0``; afterwards it oscillates freely.
    """
    if material is None:
        return Oscillation(None, end_s)
    push = physics.loading_rate * speed_m_s / radius_m * physics.period_factor
    within = physics.loading_time * radius_m / speed_m_s / physics.period_factor
    stiffness = 5.0 / (2.0 * density_kg_m3 * radius_m**2)

    def derivative(t: float, state: Floats) -> list[float]:
        stretch, rate, viscous = state
        elastic = stretch / viscous
        restoring = 2.0 * material.g_inf_pa * (stretch - stretch**-5)
        restoring += 2.0 * material.g_t_pa / stretch * (elastic**2 - elastic**-4)
        inertia = 1.0 + 2.0 / stretch**6
        load = 3.0 * push * t / within**2 * np.exp(-t / within)
        acceleration = (6.0 * rate**2 / stretch**7 - stiffness * restoring + load) / inertia
        return [rate, acceleration, viscous * _rate_of_flow(material, viscous, elastic)]

    solution = solve_ivp(derivative, (0.0, end_s), [1.0, 0.0, 1.0], "DOP853", rtol=1e-9, atol=1e-11, dense_output=True)
    if not solution.success:
        raise RuntimeError(f"the oscillation could not be integrated: {solution.message}")
    return Oscillation(tabulate_solution(solution.t, solution.sol), end_s, physics.shallow_valleys)
