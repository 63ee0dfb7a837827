"""The speeds of a drop, from its tables: U₀ at impact, U₁ after the first period, their difference and error bars."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.kinematics.entry import fall_before_impact, fall_speed, impact_velocity
from wentry_cli.kinematics.interpolation import hermite, nearest
from wentry_cli.scaling.dimensionless import velocity_loss
from wentry_cli.stages.inputs.air import fall_in_air, released
from wentry_cli.stages.inputs.columns import column, first_row, number
from wentry_cli.tables import has_table, read_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

SOURCES = ("kinematics", "kinematics_model")
LONGEST_GAP_FRAMES = 4.5
LEAST_OWN = 0.01  # share of the uncertainty of a height that is at least its own


@dataclass(frozen=True)
class Speeds:
    """U₀, U₁ (positive downwards), ΔU/U₀ and uncertainties; NaN where not known. ``source`` is the table used."""

    impact: float
    impact_unc: float
    after: float
    after_unc: float
    loss: float
    loss_unc: float
    source: str


NO_SPEEDS = Speeds(*(math.nan,) * 6, source="")


def measured_speeds(folder: Path, drop: Drop) -> Speeds:
    """Speeds of an entry, from the first of the tables that knows both (a rigid sphere: U₀), else U₀ alone."""
    found = [
        _speeds_from(read_table(folder, name), folder, name, drop)
        for name in preferred_sources(drop)
        if has_table(folder, name)
    ]
    complete = [s for s in found if math.isfinite(s.loss)]
    partial = [s for s in found if math.isfinite(s.impact)]
    return (complete or partial or [NO_SPEEDS])[0]


def preferred_sources(drop: Drop) -> tuple[str, ...]:
    """The tables of velocities, the one that ``analysis.stretch`` asks for first."""
    return SOURCES if drop.experiment.analysis.stretch == "measured" else SOURCES[::-1]


def impact_speed_alone(folder: Path, drop: Drop) -> Speeds:
    """U₀ of a drop on a rigid surface, from its heights before impact."""
    air, _ = scale_uncertainties(folder, drop)
    side = read_table(folder, "side")
    speed, unc = _speed_of_fall(side, "y_b_m", folder, drop)
    unc = math.hypot(unc, _doubted_fall(speed, folder, drop))
    speed, unc = _if_known(speed, math.hypot(unc, speed * air))
    return Speeds(speed, unc, math.nan, math.nan, math.nan, math.nan, "")


def _speed_of_fall(table: pd.DataFrame, height: str, folder: Path, drop: Drop) -> tuple[float, float]:
    """U₀ and its uncertainty from the heights of a table before impact alone; the row of y = 0 moves no speed."""
    experiment, geometry = drop.experiment, first_row(folder, "geometry", view="side")
    zero = number(geometry, "surface_y_px_unc", 0.0) / number(geometry, "scale_px_per_m", math.inf)
    unc = column(table, f"{height}_unc")
    unc = np.sqrt(np.maximum(unc**2 - zero**2, (LEAST_OWN * unc) ** 2))
    fall = fall_before_impact(
        experiment.gravity_m_s2,
        number({"v": experiment.drop.impact_speed_m_s}, "v", 5.0),
        experiment.sphere.radius_m,
        experiment.sphere.density or 1000.0,
    )
    return fall_speed(column(table, "t_s"), column(table, height), unc, fall, released(geometry))


def _if_known(speed: float, unc: float) -> tuple[float, float]:
    """A speed and its uncertainty, NaN where that is as great as the speed: then nothing is known of it."""
    return (speed, unc) if unc < abs(speed) else (math.nan, math.nan)


def _doubted_fall(speed: float, folder: Path, drop: Drop) -> float:
    """What U₀ may be wrong by where the fall before impact contradicts gravity."""
    fall = fall_in_air(drop, read_table(folder, "side"), first_row(folder, "geometry", view="side"))
    return fall.speed_doubt(speed) if fall is not None and math.isfinite(speed) else 0.0


def velocity_at(table: pd.DataFrame, when: float) -> tuple[float, float]:
    """Return v_c at a time between frames and its standard uncertainty; NaN in a gap or outside the record."""
    times = column(table, "t_s")
    gap = LONGEST_GAP_FRAMES * float(np.median(np.diff(times))) if times.size > 1 else 0.0
    value = hermite(times, column(table, "v_c_m_s"), column(table, "a_c_m_s2"), when, longest_gap=gap)
    unc = nearest(times, column(table, "v_c_m_s_unc"), when) if math.isfinite(value) else math.nan
    return value, unc


def bottom_at(table: pd.DataFrame, when: float) -> tuple[float, float]:
    """Return y_b at a time between frames and its standard uncertainty; NaN in a gap or outside the record."""
    times = column(table, "t_s")
    gap = LONGEST_GAP_FRAMES * float(np.median(np.diff(times))) if times.size > 1 else 0.0
    value = hermite(times, column(table, "y_b_m"), column(table, "v_b_m_s"), when, longest_gap=gap)
    unc = nearest(times, column(table, "y_b_m_unc"), when) if math.isfinite(value) else math.nan
    return value, unc


def velocity_at_impact(table: pd.DataFrame, folder: Path, drop: Drop) -> tuple[float, float]:
    """Return v_c(0⁻) and its standard uncertainty, from the smoothed velocities if their smoother knows of the impact.

    One that does not rounds it off: then the fall before it speaks for itself.
    """
    if drop.experiment.analysis.smoother == "impact_aware":
        return velocity_before_impact(table)
    speed, unc = _speed_of_fall(table, "y_c_m", folder, drop)
    return -speed, unc


def velocity_before_impact(table: pd.DataFrame) -> tuple[float, float]:
    """Return v_c(0⁻) and its standard uncertainty as the smoothed track has them."""
    return impact_velocity(
        column(table, "t_s"), column(table, "v_c_m_s"), column(table, "v_c_m_s_unc"), column(table, "a_c_m_s2")
    )


def _speeds_from(table: pd.DataFrame, folder: Path, source: str, drop: Drop) -> Speeds:
    """U₀ and U₁ of one table; the scale's error is common to both and drops out of ΔU/U₀ where the scales agree.

    A sphere that falls is faster where the impact is taken later: its uncertain moment counts in U₀. So does a fall
    that gravity does not explain.
    """
    air, water = scale_uncertainties(folder, drop)
    velocity, noise = velocity_at_impact(table, folder, drop)
    late = number(first_row(folder, "geometry", view="side"), "impact_time_s_unc", 0.0)
    impact = -velocity
    noise = math.hypot(noise, late * drop.experiment.gravity_m_s2, _doubted_fall(impact, folder, drop))
    impact, impact_unc = _if_known(impact, math.hypot(noise, impact * air))
    period = first_row(folder, "periods")
    end, end_unc = number(period, "t_end_s"), number(period, "t_end_s_unc", 0.0)
    after = after_unc = loss = loss_unc = math.nan
    if math.isfinite(end):
        velocity, after_noise = velocity_at(table, end)
        acceleration = nearest(column(table, "t_s"), column(table, "a_c_m_s2"), end)
        after = -velocity
        after_noise = math.hypot(after_noise, acceleration * end_unc)
        after_unc = math.hypot(after_noise, after * water)
        loss = velocity_loss(impact, after)
        apart = math.sqrt(abs(water**2 - air**2))
        loss_unc = math.hypot(after_noise / impact, after * noise / impact**2, after / impact * apart)
    return Speeds(impact, impact_unc, after, after_unc, loss, loss_unc, source)


def scale_uncertainties(folder: Path, drop: Drop) -> tuple[float, float]:
    """Relative uncertainties of the scales in air and water, no less than that of the diameter they rest on."""
    geometry = first_row(folder, "geometry", view="side")
    sphere = drop.experiment.sphere
    least = sphere.diameter_m_unc / sphere.diameter_m if scale_from_diameter(drop) else 0.0
    air = number(geometry, "scale_px_per_m_unc", 0.0) / number(geometry, "scale_px_per_m", math.inf)
    water = number(geometry, "scale_water_px_per_m_unc", 0.0) / number(geometry, "scale_water_px_per_m", math.inf)
    return max(air, least), max(water, least)


def scale_from_diameter(drop: Drop) -> bool:
    """Whether a scale of the side view is taken from the diameter."""
    view = drop.experiment.views.side
    return view is not None and "auto" in (view.scale_pair.air, view.scale_pair.water)
