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


def pinch_off_columns(folder: Path, drop: Drop, event: Row, impact_speed: float) -> Row:
    """Return the columns of ``summary.csv`` that tell of the pinch-off ``event``, a row of ``events.csv``."""
    diameter, gravity = drop.experiment.sphere.diameter_m, drop.experiment.gravity_m_s2
    t_p, y_p, seal = number(event, "t_s"), number(event, "y_m"), text(event, "value")
    row: Row = {"t_p_s": t_p, "t_p_s_unc": number(event, "t_s_unc"), "y_p_m": y_p, "seal_type": seal or None}
    row["tp_u0_over_d"] = t_p * impact_speed / diameter
    stretch = math.nan, math.nan
    if drop.experiment.sphere.rigid:
        stretch = (1.0 if math.isfinite(t_p) and seal != "sphere_seal" else math.nan), 0.0
    elif math.isfinite(t_p) and seal != "surface_seal":
        cavity, peak = _cavity(folder, y_p)
        row |= {"pinch_off_cavity": cavity.number, "pinch_off_cavity_source": cavity.source or None}
        stretch = peak if seal != "sphere_seal" else stretch
    effective = dimensionless.effective_diameter(diameter, stretch[0])
    unc = math.hypot(diameter * stretch[1], stretch[0] * (drop.experiment.sphere.diameter_m_unc or 0.0))
    row |= {"diameter_eff_m": effective, "diameter_eff_m_unc": unc or math.nan}
    if math.isfinite(effective):
        row["froude_eff"] = dimensionless.froude(impact_speed, effective, gravity)
        row["tp_u0_over_deff"] = t_p * impact_speed / effective
    return row


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
