"""Force coefficients: averaged over a period of a soft sphere (the paper's C̄_F), per frame of a rigid one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """Sphere and liquid: m, kg/m³, kg/m³, m/s²."""

    diameter_m: float
    density_kg_m3: float
    liquid_density_kg_m3: float
    gravity_m_s2: float = 9.81

    @property
    def volume_m3(self) -> float:
        """Volume of the sphere."""
        return float(np.pi / 6.0 * self.diameter_m**3)


@dataclass(frozen=True)
class PeriodEnds:
    """What a period begins and ends with, and its standard uncertainties: velocities m/s, heights m, times s."""

    start_s: float
    end_s: float
    velocity_start: float
    velocity_end: float
    bottom_start: float
    bottom_end: float
    velocity_start_unc: float = 0.0
    velocity_end_unc: float = 0.0
    bottom_start_unc: float = 0.0
    bottom_end_unc: float = 0.0
    duration_unc: float = 0.0


@dataclass(frozen=True)
class ForceCoefficient:
    """Net coefficient as the paper defines it, and the hydrodynamic one with weight and buoyancy taken out."""

    net: Array
    net_unc: Array
    hydrodynamic: Array
    hydrodynamic_unc: Array


def period_force_coefficient(
    ends: PeriodEnds, stretch_peak: float, stretch_peak_unc: float, body: Body, *, scale_unc: float = 0.0
) -> ForceCoefficient:
    """Return C̄_F = ρ_s V mean(ÿ_c) / (½ ρ_w mean(ẏ_b)² π (λ_pN D/2)²) over one period.

    The means are differences over the ends: mean(ÿ_c) = Δv_c/T and mean(ẏ_b) = Δy_b/T, exactly. With
    C = K T Δv/(Δy_b λ_p)² the uncertainties add as relative ones; a duration that is uncertain moves T alone (the
    changes of v_c and y_b with the instant are in their own uncertainties only so far as the caller put them there).
    ``scale_unc`` is the relative uncertainty of all lengths together.
    """
    duration = ends.end_s - ends.start_s
    change = ends.velocity_end - ends.velocity_start
    travel = ends.bottom_end - ends.bottom_start
    mean_acceleration = change / duration
    pressure_area = _pressure_area(travel / duration, stretch_peak * body.diameter_m, body)
    change_unc = np.hypot(ends.velocity_start_unc, ends.velocity_end_unc)
    travel_unc = np.hypot(ends.bottom_start_unc, ends.bottom_end_unc)
    common = np.hypot(2.0 * travel_unc / travel, 2.0 * stretch_peak_unc / stretch_peak)
    return _coefficients(
        np.asarray(mean_acceleration),
        np.asarray(np.hypot(change_unc / duration, mean_acceleration * ends.duration_unc / duration)),
        np.asarray(pressure_area),
        np.asarray(np.hypot(common, 2.0 * ends.duration_unc / duration)),
        body,
        scale_unc,
    )


def rigid_force_coefficient(
    velocity: tuple[Array, Array], acceleration: tuple[Array, Array], body: Body, *, scale_unc: float = 0.0
) -> ForceCoefficient:
    """Return C_F(t) of a rigid sphere from its velocity and acceleration in each frame (NaN where it stands still).

    Each is a pair of values and standard uncertainties; ``scale_unc`` is the relative uncertainty of all lengths
    together.
    """
    speed = np.where(velocity[0] == 0.0, np.nan, velocity[0])
    area = _pressure_area(speed, body.diameter_m, body)
    return _coefficients(*acceleration, area, 2.0 * velocity[1] / np.abs(speed), body, scale_unc)


def _pressure_area(speed: Array | float, diameter: float, body: Body) -> Array | float:
    return 0.5 * body.liquid_density_kg_m3 * speed**2 * np.pi * (diameter / 2.0) ** 2


def _coefficients(
    acceleration: Array,
    acceleration_unc: Array,
    area: Array | float,
    area_relative: Array,
    body: Body,
    scale_unc: float,
) -> ForceCoefficient:
    """Both coefficients from the acceleration and the dynamic pressure times area (relative uncertainty).

    Lengths that are too long by a share e make accelerations larger by e and pressures by 2 e: a coefficient C moves by
    (C_net − 2 C) e.
    """
    mass = body.density_kg_m3 * body.volume_m3
    lift = body.liquid_density_kg_m3 * body.volume_m3 * body.gravity_m_s2
    net = mass * acceleration / area
    hydrodynamic = (mass * (acceleration + body.gravity_m_s2) - lift) / area
    own = mass * acceleration_unc / area

    def total(value: Array) -> Array:
        return np.asarray(np.sqrt(own**2 + (value * area_relative) ** 2 + ((net - 2.0 * value) * scale_unc) ** 2))

    return ForceCoefficient(net, total(net), hydrodynamic, total(hydrodynamic))
