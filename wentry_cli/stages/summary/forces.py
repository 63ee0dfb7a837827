"""``forces.csv``: force coefficients averaged over the periods of a soft sphere, per frame of a rigid one."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wentry_cli.config.moved import moved
from wentry_cli.kinematics.forces import (
    Body,
    ForceCoefficient,
    PeriodEnds,
    period_force_coefficient,
    rigid_force_coefficient,
)
from wentry_cli.stages.inputs.columns import Row, column, number
from wentry_cli.stages.summary.speeds import (
    Speeds,
    bottom_at,
    preferred_sources,
    scale_from_diameter,
    scale_uncertainties,
    velocity_at,
    velocity_at_impact,
)
from wentry_cli.tables import has_table, new_table, read_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop


def forces_table(folder: Path, drop: Drop, speeds: Speeds, t_p_s: float) -> pd.DataFrame:
    """Return ``forces.csv`` of an entry; without a known density it has no rows."""
    experiment = drop.experiment
    if experiment.sphere.density is None:
        return new_table("forces", {})
    bodies = _bodies(drop)
    if experiment.sphere.rigid:
        return _rigid(read_table(folder, "kinematics"), bodies, t_p_s, _scale_unc(folder, drop))
    if not has_table(folder, "periods"):
        return new_table("forces", {})
    source = speeds.source or preferred_sources(drop)[0]
    periods = read_table(folder, "periods")
    table, scale_unc = read_table(folder, source), _scale_unc(folder, drop)
    before = velocity_at_impact(table, folder, drop)
    rows = [_row({str(k): v for k, v in p.items()}, table, bodies, scale_unc, before) for _, p in periods.iterrows()]
    columns: dict[str, Any] = {name: [row.get(name) for row in rows] for name in _names(rows)}
    if rows:
        columns["t_mid_over_tp"] = np.array([number(row, "t_mid_s") for row in rows]) / t_p_s
    return new_table("forces", columns)


def _bodies(drop: Drop) -> list[Body]:
    """Sphere and liquid, then once for each number measured by hand with that number moved by its uncertainty.

    Where the scale is taken from the diameter, an error of the diameter is in the uncertainty of the scale already.
    """
    fixed = ("sphere.diameter_m",) if scale_from_diameter(drop) else ()
    return [
        Body(e.sphere.diameter_m, e.sphere.density or math.nan, e.liquid.density_kg_m3, e.gravity_m_s2)
        for e in (drop.experiment, *moved(drop.experiment, but=fixed))
    ]


def _scale_unc(folder: Path, drop: Drop) -> float:
    """Relative uncertainty of lengths in water."""
    return scale_uncertainties(folder, drop)[1]


def _names(rows: list[Row]) -> list[str]:
    return sorted({name for row in rows for name in row})


def _rigid(table: pd.DataFrame, bodies: list[Body], t_p_s: float, scale_unc: float) -> pd.DataFrame:
    """C_F(t) from impact on."""
    wet = table[(table["t_s"] >= 0.0).to_numpy(dtype=bool, na_value=False)]
    times = column(wet, "t_s")
    speed = column(wet, "v_c_m_s"), column(wet, "v_c_m_s_unc")
    acceleration = column(wet, "a_c_m_s2"), column(wet, "a_c_m_s2_unc")
    found = _with_bodies([rigid_force_coefficient(speed, acceleration, body, scale_unc=scale_unc) for body in bodies])
    return new_table("forces", {"t_mid_s": times, "t_mid_over_tp": times / t_p_s} | _coefficients(found))


def _with_bodies(found: list[ForceCoefficient]) -> ForceCoefficient:
    """The first of ``found``, with what the others differ from it in its uncertainties."""
    nominal, others = found[0], found[1:]
    return replace(
        nominal,
        net_unc=np.sqrt(nominal.net_unc**2 + sum((other.net - nominal.net) ** 2 for other in others)),
        hydrodynamic_unc=np.sqrt(
            nominal.hydrodynamic_unc**2 + sum((other.hydrodynamic - nominal.hydrodynamic) ** 2 for other in others)
        ),
    )


def _coefficients(found: ForceCoefficient) -> dict[str, Any]:
    return {
        "force_coefficient": found.net,
        "force_coefficient_unc": found.net_unc,
        "force_coefficient_hydro": found.hydrodynamic,
        "force_coefficient_hydro_unc": found.hydrodynamic_unc,
    }


def _row(period: Row, table: pd.DataFrame, bodies: list[Body], scale_unc: float, before: tuple[float, float]) -> Row:
    """C̄_F of one period; empty where an end, a velocity or the peak is not known. ``before`` is v_c at impact."""
    row: Row = {"period": int(number(period, "period", 1.0))}
    start, end = number(period, "t_start_s"), number(period, "t_end_s")
    peak, peak_unc = number(period, "stretch_peak"), number(period, "stretch_peak_unc", 0.0)
    if not (math.isfinite(start) and math.isfinite(end)):
        return row
    row["t_mid_s"] = 0.5 * (start + end)
    first = start <= 0.0
    velocity = [before if first else velocity_at(table, start), velocity_at(table, end)]
    bottom = [(0.0, 0.0) if first else bottom_at(table, start), bottom_at(table, end)]
    values = [v for pair in (*velocity, *bottom) for v in pair]
    if not all(map(math.isfinite, [*values, peak])):
        return row
    ends = PeriodEnds(
        start_s=start,
        end_s=end,
        velocity_start=velocity[0][0],
        velocity_end=velocity[1][0],
        bottom_start=bottom[0][0],
        bottom_end=bottom[1][0],
        velocity_start_unc=velocity[0][1],
        velocity_end_unc=velocity[1][1],
        bottom_start_unc=bottom[0][1],
        bottom_end_unc=bottom[1][1],
        duration_unc=number(period, "t_end_s_unc", 0.0),
    )
    found = _with_bodies([period_force_coefficient(ends, peak, peak_unc, body, scale_unc=scale_unc) for body in bodies])
    return row | {name: float(value) for name, value in _coefficients(found).items()}
