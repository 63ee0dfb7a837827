"""The pinch-off of a drop for its summary: when, where, how, which cavity closes, the diameter that scales it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.cavity.cavity_number import (
    UNKNOWN,
    CavityNumber,
    Periods,
    find_cavity_number,
    find_passage,
    stretch_peak_of,
)
from wentry_cli.scaling import dimensionless
from wentry_cli.stages.inputs.columns import Row, column, number, text
from wentry_cli.tables import has_table, read_table

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop


def pinch_off_columns(folder: Path, drop: Drop, event: Row, impact: tuple[float, float]) -> Row:
    """Return the columns of ``summary.csv`` that tell of the pinch-off ``event``, a row of ``events.csv``.

    ``impact`` is U₀ and its uncertainty. Speed, time, diameter, peak and gravity count as independent.
    """
    sphere, gravity = drop.experiment.sphere, drop.experiment.gravity_m_s2
    diameter = sphere.diameter_m
    t_p, y_p, seal = number(event, "t_s"), number(event, "y_m"), text(event, "value")
    late = number(event, "t_s_unc")
    row: Row = {"t_p_s": t_p, "t_p_s_unc": late, "y_p_m": y_p, "y_p_m_unc": number(event, "y_m_unc")}
    row["seal_type"] = seal or None
    by_time = math.hypot(late / t_p, impact[1] / impact[0])
    row |= _with_unc("tp_u0_over_d", t_p * impact[0] / diameter, math.hypot(by_time, sphere.diameter_m_unc / diameter))
    stretch = math.nan, math.nan
    if sphere.rigid:
        stretch = (1.0 if math.isfinite(t_p) and seal != "sphere_seal" else math.nan), 0.0
    elif math.isfinite(t_p) and seal != "surface_seal":
        cavity, peak = _cavity(folder, y_p)
        row |= {"pinch_off_cavity": cavity.number, "pinch_off_cavity_source": cavity.source or None}
        stretch = peak if seal != "sphere_seal" else stretch
    effective = dimensionless.effective_diameter(diameter, stretch[0])
    unc = math.hypot(diameter * stretch[1], stretch[0] * sphere.diameter_m_unc)
    row |= {"diameter_eff_m": effective, "diameter_eff_m_unc": unc or math.nan}
    if math.isfinite(effective):
        size = unc / effective
        by_size = math.hypot(impact[1] / impact[0], 0.5 * size, 0.5 * drop.experiment.gravity_m_s2_unc / gravity)
        row |= _with_unc("froude_eff", dimensionless.froude(impact[0], effective, gravity), by_size)
        row |= _with_unc("tp_u0_over_deff", t_p * impact[0] / effective, math.hypot(by_time, size))
    return row


def _with_unc(name: str, value: float, relative: float) -> Row:
    return {name: value, f"{name}_unc": value * relative}


def _cavity(folder: Path, neck_y_m: float) -> tuple[CavityNumber, tuple[float, float]]:
    """Return the number of the cavity whose neck closes at ``neck_y_m``, and the peak of its period with its error."""
    nothing = math.nan, math.nan
    if not (has_table(folder, "periods") and has_table(folder, "side")):
        return UNKNOWN, nothing
    side, table = read_table(folder, "side"), read_table(folder, "periods")
    names = ("t_end_s", "t_end_s_unc", "peak_to_peak_s", "stretch_peak", "stretch_valley")
    periods = Periods(*(column(table, name) for name in names))
    passage = find_passage(neck_y_m, column(side, "t_s"), column(side, "separation_y_m"))
    found = find_cavity_number(*passage, periods)
    if found.number is None:
        return UNKNOWN, nothing
    return found, stretch_peak_of(found.number, periods, np.nan_to_num(column(table, "stretch_peak_unc")))
