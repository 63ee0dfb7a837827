"""The dimensionless numbers of a drop and the speed that its height makes one expect, with their uncertainties."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from wentry_cli.config.moved import uncertainty_by_hand
from wentry_cli.scaling import dimensionless
from wentry_cli.stages.inputs.columns import Row
from wentry_cli.stages.summary.cross_checks import air_takes
from wentry_cli.stages.summary.speeds import Speeds

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop
    from wentry_cli.config.models import Experiment


def numbers_of(drop: Drop, speeds: Speeds) -> Row:
    """Columns of summary.csv that follow from what was measured by hand and from the impact speed.

    The uncertainties of diameter, densities, viscosity, surface tension, gravity, height, modulus and speed count as
    independent. One that nobody stated is empty, not 0.
    """
    material, experiment = drop.material, drop.experiment
    modulus = (math.nan, 0.0) if material is None else (material.g_inf_pa, material.g_inf_pa_unc)

    def numbers(given: Experiment, speed: float = speeds.impact, g_inf: float = modulus[0]) -> dict[str, float]:
        return _numbers(given, speed, g_inf)

    values = numbers(experiment)
    by_hand = uncertainty_by_hand(numbers, experiment)
    faster = numbers(experiment, speeds.impact + speeds.impact_unc)
    stiffer = numbers(experiment, g_inf=modulus[0] + modulus[1])
    uncertainties = {
        f"{name}_unc": math.hypot(by_hand[name], faster[name] - value, stiffer[name] - value) or math.nan
        for name, value in values.items()
        if name != "speed_taken_by_air_m_s"  # a bound
    }
    return values | uncertainties


def _numbers(experiment: Experiment, speed: float, g_inf: float) -> dict[str, float]:
    diameter, gravity, liquid = experiment.sphere.diameter_m, experiment.gravity_m_s2, experiment.liquid
    found = {
        "speed_from_height_m_s": _expected_speed(experiment),
        "speed_taken_by_air_m_s": _taken_by_air(experiment),
        "froude": dimensionless.froude(speed, diameter, gravity),
    }
    if experiment.kind == "water_entry":
        density = liquid.density_kg_m3
        found |= {
            "bond": dimensionless.bond(diameter, density, liquid.surface_tension_n_m, gravity),
            "reynolds": dimensionless.reynolds(speed, diameter, density, liquid.viscosity_pa_s),
            "stiffness_ratio": dimensionless.stiffness_ratio(g_inf, speed, density),
        }
    return found


def _expected_speed(experiment: Experiment) -> float:
    """The speed that was given, else that of a fall from the height; NaN where neither is known."""
    release = experiment.drop
    if release.impact_speed_m_s is not None:
        return release.impact_speed_m_s
    if release.height_m is None:
        return math.nan
    return dimensionless.speed_from_height(release.height_m, experiment.gravity_m_s2)


def _taken_by_air(experiment: Experiment) -> float:
    """What air takes at most of the speed of a fall from the height; NaN where the speed itself was given."""
    given = experiment.drop.impact_speed_m_s is not None
    return math.nan if given else air_takes(experiment, _expected_speed(experiment))
