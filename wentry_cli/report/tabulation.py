"""The tables of the report as rows of text: drops, materials."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import pandas as pd

from wentry_cli.report.campaign import Campaign, DropResults, as_number, as_text
from wentry_cli.report.numbers import DASH, MINUS, fixed, or_reason, with_uncertainty


@dataclass(frozen=True)
class TextTable:
    """A table ready to print; every cell is text from the tables, to be escaped by whoever prints it."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def _cell(column: str, factor: float = 1.0, digits: int = 4) -> Callable[[DropResults], str]:
    def write(drop: DropResults) -> str:
        text = with_uncertainty(factor * drop.number(column), factor * drop.number(f"{column}_unc"), digits)
        return or_reason(text, _reason(drop, column))

    return write


def _word(column: str) -> Callable[[DropResults], str]:
    return lambda drop: drop.text(column).replace("_", " ") or DASH


def _frames(drop: DropResults) -> str:
    counts = [drop.number(column) for column in ("frames_measured", "frames_total")]
    return " / ".join(with_uncertainty(count) for count in counts)


def _plain(column: str) -> Callable[[DropResults], str]:
    return lambda drop: with_uncertainty(drop.number(column), drop.number(f"{column}_unc"))


def _off_told(drop: DropResults) -> str:
    """How far the measured impact speed is off that of the height, or off the one that was given."""
    off = fixed(100.0 * (drop.number("impact_speed_m_s") / drop.number("speed_from_height_m_s") - 1.0), 1)
    return DASH if off == "nan" else f"{'' if off.startswith(MINUS) or off == '0.0' else '+'}{off} %"


Columns = dict[str, Callable[[DropResults], str]]

DROP_COLUMNS: Columns = {
    "drop": lambda drop: drop.name,
    "kind": lambda drop: drop.text("kind").replace("_", " ") + (", rigid" if drop.rigid else ""),
    "D (mm)": _cell("diameter_m", 1e3),
    "G∞ (kPa)": _cell("g_inf_pa", 1e-3),
    "U₀ (m/s)": _cell("impact_speed_m_s"),
    "Fr": _cell("froude", digits=3),
    "G∞/(ρ_w U₀²)": _cell("stiffness_ratio", digits=3),
    "T (ms)": _cell("period_s", 1e3),
    "λ_p1": _cell("stretch_peak_1"),
    "frames": _frames,
    "status": lambda drop: (
        (drop.text("status").replace("_", " ") or "not finished") + (", in doubt" if drop.text("doubts") else "")
    ),
}
STRETCH_OF = {"kinematics": "measured", "kinematics_model": "model"}
CHECK_COLUMNS: Columns = {
    "drop": lambda drop: drop.name,
    "U₀ (m/s)": _cell("impact_speed_m_s"),
    "by the drop (m/s)": _plain("speed_from_height_m_s"),
    "U₀ off it": _off_told,
    "a in air (m/s²)": _plain("fall_acceleration_m_s2"),
    "in doubt": lambda drop: drop.text("doubts") or DASH,
}
FLIGHT_COLUMNS: Columns = {
    "drop": lambda drop: drop.name,
    "v, mid-clip (m/s)": _cell("velocity_m_s"),
    "a (m/s²)": _cell("acceleration_m_s2"),
}
ENTRY_COLUMNS: Columns = {
    "drop": lambda drop: drop.name,
    "t_p (ms)": _cell("t_p_s", 1e3),
    "y_p (mm)": _cell("y_p_m", 1e3),
    "seal": _word("seal_type"),
    "cavity N": _cell("pinch_off_cavity"),
    "D_eff (mm)": _cell("diameter_eff_m", 1e3),
    "t_p U₀/D": _cell("tp_u0_over_d", digits=3),
    "t_p U₀/D_eff": _cell("tp_u0_over_deff", digits=3),
    "U₁ (m/s)": _cell("speed_after_period_m_s"),
    "ΔU/U₀": _cell("delta_u_over_u0", digits=3),
    "λ of velocities": lambda drop: DASH if drop.rigid else STRETCH_OF.get(drop.text("velocity_source"), DASH),
}
WATER_ONLY = {"froude", "stiffness_ratio"}
EFFECTIVE = {"diameter_eff_m", "tp_u0_over_deff"}
PINCH_OFF = {"t_p_s", "y_p_m", "tp_u0_over_d", "pinch_off_cavity", *EFFECTIVE}
OF_MATERIAL = {"g_inf_pa", "stiffness_ratio"}
FIRST_PERIOD = {"period_s", "stretch_peak_1", "speed_after_period_m_s", "delta_u_over_u0"}
SIDE_ONLY = {"impact_speed_m_s", "froude", "stiffness_ratio", "speed_after_period_m_s", "delta_u_over_u0", *PINCH_OFF}
OTHER_SEALS = {"sphere_seal", "surface_seal"}
SOFT_ONLY = {"pinch_off_cavity", *OF_MATERIAL, *FIRST_PERIOD}


def _reason(drop: DropResults, column: str) -> str:
    """Why a number is missing: what this number needs; nothing where none is expected.

    The status of a drop is the first reason of all its numbers, so that it tells of this one only where few frames
    leave nothing measured.
    """
    if (column in WATER_ONLY and drop.kind != "water_entry") or (column in SOFT_ONLY and drop.rigid):
        return ""
    if column in OF_MATERIAL and not math.isfinite(drop.number("g_inf_pa")):
        return "no material"
    if column in SIDE_ONLY and drop.kind == "water_entry" and drop.table("side").empty:
        return "not filmed from the side"
    if drop.kind == "free_flight" or drop.text("status") in {"", "too_few"}:
        return drop.text("status")
    if column in PINCH_OFF:
        return _why_no_pinch_off(drop, column)
    if column in FIRST_PERIOD:
        words = [as_text(word) for word in drop.table("periods")["status"]]
        return "not_identified" if words[:1] == ["ok"] else (words or ["too_few"])[0]
    return "no_object"


def _why_no_pinch_off(drop: DropResults, column: str) -> str:
    """The word of the event; of what follows from it, the seal that has no such number."""
    events = drop.table("events")
    found = [as_text(word) for word in events.loc[events["event"] == "pinch_off", "status"]] or ["no_neck"]
    if found[0] != "ok":
        return found[0]
    return drop.seal.replace("_", " ") if column in EFFECTIVE and drop.seal in OTHER_SEALS else "not_identified"


def drop_table(campaign: Campaign) -> TextTable:
    """What each drop is and how its sphere oscillates, with uncertainties; columns that no drop fills are left out."""
    return _filled(DROP_COLUMNS, list(campaign.drops))


def check_table(campaign: Campaign) -> TextTable:
    """What was told of each drop beside what was measured; empty where there is nothing to compare."""
    table = _filled(CHECK_COLUMNS, list(campaign.drops))
    return table if {*table.header} - {"drop", "U₀ (m/s)"} else TextTable((), ())


def check_note(campaign: Campaign) -> str:
    """What the columns of ``check_table`` are."""
    parts = []
    speeds = [(drop.number("speed_taken_by_air_m_s"), drop.number("speed_from_height_m_s")) for drop in campaign.drops]
    if any(math.isfinite(told) for _, told in speeds):
        shares = [100.0 * air / told for air, told in speeds if math.isfinite(air / told)]
        air = f", of which the air takes {fixed(max(shares), 1)} % at most" if shares else ""
        parts.append(f"By the drop: √(2gh) of the height that was given{air}, or the speed that was.")
    if any(math.isfinite(drop.number("fall_acceleration_m_s2")) for drop in campaign.drops):
        parts.append(
            "The acceleration before impact, a in air, is that of gravity less the drag of the air where the scales of "
            "length and time are right."
        )
    return " ".join(parts)


def entry_table(campaign: Campaign) -> TextTable:
    """Pinch-off and loss of velocity of each drop that enters water, with uncertainties."""
    return _filled(ENTRY_COLUMNS, campaign.of("water_entry"))


def flight_table(campaign: Campaign) -> TextTable:
    """Velocity in the middle of the clip and acceleration of each free flight, up positive, with uncertainties."""
    return _filled(FLIGHT_COLUMNS, campaign.of("free_flight"))


def _filled(columns: Columns, drops: list[DropResults]) -> TextTable:
    return _without_empty(tuple(columns), [tuple(write(drop) for write in columns.values()) for drop in drops])


def _without_empty(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> TextTable:
    kept = [place for place in range(len(header)) if any(row[place] not in {"", DASH} for row in rows)]
    return TextTable(tuple(header[i] for i in kept), tuple(tuple(row[i] for i in kept) for row in rows))


MATERIAL_COLUMNS = {
    "G∞ (Pa)": "g_inf_pa",
    "G_T (Pa)": "g_t_pa",
    "ξ": "xi",
    "τ₀ (Pa)": "tau0_pa",
    "m": "m",
    "n": "n",
    "ε̇₀ (1/s)": "eps0_dot_1_s",
    "ε̇₀ .12ⁿ (1/s)": "flow_1_s",
}


def material_table(materials: pd.DataFrame) -> TextTable:
    """Parameters of the materials, as in the paper's Table 1; columns that no row fills are left out."""
    header = ("material", "sphere", "D (mm)", *MATERIAL_COLUMNS, "source")
    return _without_empty(header, [_material_row(row) for row in materials.to_dict("records")])


def _material_row(row: dict[Hashable, Any]) -> tuple[str, ...]:
    numbers = [
        with_uncertainty(as_number(row.get(name)), as_number(row.get(f"{name}_unc")))
        for name in MATERIAL_COLUMNS.values()
    ]
    size, status = with_uncertainty(1e3 * as_number(row["diameter_m"])), as_text(row.get("status"))
    source = as_text(row["source"]) or DASH
    told = source if status in {"", "ok"} else f"{source}: {status}"
    return (as_text(row["material"]), as_text(row["sphere_id"]) or DASH, size, *numbers, told)
