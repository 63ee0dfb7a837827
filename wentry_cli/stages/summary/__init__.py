"""Stage ``summary``: one row of numbers for the drop and its force coefficients (``summary.csv``, ``forces.csv``)."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.pipeline import STAGES
from wentry_cli.records import read_stages
from wentry_cli.stages.inputs.air import fall_in_air
from wentry_cli.stages.inputs.columns import Row, column, first_row, number, text
from wentry_cli.stages.summary.cross_checks import doubt_of_flight, doubt_of_softness, doubt_of_speed
from wentry_cli.stages.summary.forces import forces_table
from wentry_cli.stages.summary.numbers import numbers_of
from wentry_cli.stages.summary.pinch_off import pinch_off_columns
from wentry_cli.stages.summary.speeds import NO_SPEEDS, Speeds, impact_speed_alone, measured_speeds
from wentry_cli.tables import has_table, new_table, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

PEAKS = 5
RISES = (
    "by its frames before impact the sphere would rise with {:.3g} m/s: no speed is given; see their status in side.csv"
)
logger = logging.getLogger(__name__)


def run(folder: Path, drop: Drop) -> None:
    """Write ``summary.csv`` and, for an entry seen from the side, ``forces.csv``."""
    experiment = drop.experiment
    speeds = found = _speeds(folder, drop)
    if rises := found.impact <= 0.0:  # it came down to where it was met
        speeds = NO_SPEEDS
    pinch_off = first_row(folder, "events", event="pinch_off")
    row = (
        _description(drop)
        | _counts(folder, drop)
        | _speed_columns(speeds)
        | numbers_of(drop, speeds)
        | _fall(folder, drop)
    )
    if experiment.kind == "free_flight":
        row |= _flight(folder, drop)
    if experiment.deformable:
        row |= _oscillation(folder)
    if experiment.kind == "water_entry":
        row |= pinch_off_columns(folder, drop, pinch_off, (speeds.impact, speeds.impact_unc))
        if has_table(folder, "kinematics"):
            write_table(folder, "forces", forces_table(folder, drop, speeds, number(pinch_off, "t_s")))
    doubts = [
        ("fall before impact", RISES.format(-found.impact) if rises else ""),
        ("speed of the drop", doubt_of_speed(drop, speeds, row)),
        ("acceleration", doubt_of_flight(drop, row)),
        ("soft sphere", doubt_of_softness(folder, drop, speeds.impact)),
    ]
    row["doubts"] = _doubts(folder, drop, doubts) or None
    row["status"] = _status(folder, drop, row, pinch_off)
    write_table(folder, "summary", new_table("summary", {name: [value] for name, value in row.items()}))


def _speeds(folder: Path, drop: Drop) -> Speeds:
    if drop.experiment.kind == "free_flight" or not has_table(folder, "side"):
        return NO_SPEEDS
    alone = drop.experiment.kind == "surface_impact"
    return impact_speed_alone(folder, drop) if alone else measured_speeds(folder, drop)


def _doubts(folder: Path, drop: Drop, found: list[tuple[str, str]]) -> str:
    """Warn of what was ``found``; what it and the warnings of the stages before put in doubt, in a few words."""
    record = read_stages(folder)
    known = [
        what for stage in STAGES if stage.name != "summary" for what in record.get(stage.name, {}).get("doubts", ())
    ]
    for what, sentence in found:
        if sentence:
            logger.warning("%s: %s", drop.name, sentence, extra=puts_in_doubt(what))
            known.append(what)
    return "; ".join(dict.fromkeys(known))


def _fall(folder: Path, drop: Drop) -> Row:
    """The acceleration before impact; with that of gravity it checks the scales of length and time."""
    if drop.experiment.kind == "free_flight" or not has_table(folder, "side"):
        return {}
    geometry = first_row(folder, "geometry", view="side")
    fall = fall_in_air(drop, read_table(folder, "side"), geometry)
    if fall is None:
        return {}
    scale = number(geometry, "scale_px_per_m_unc", 0.0) / number(geometry, "scale_px_per_m", math.inf)
    unc = math.hypot(fall.unc, fall.bend, fall.acceleration * scale)
    return {"fall_acceleration_m_s2": fall.acceleration, "fall_acceleration_m_s2_unc": unc}


def _description(drop: Drop) -> Row:
    """What was known before anything was measured."""
    experiment, sphere = drop.experiment, drop.experiment.sphere
    return {
        "drop": drop.name,
        "kind": experiment.kind,
        "condition": experiment.condition,
        "repeat": experiment.repeat,
        "sphere_id": sphere.group,
        "rigid": "true" if sphere.rigid else "false",
        "diameter_m": sphere.diameter_m,
        "density_kg_m3": sphere.density,
        "g_inf_pa": drop.material.g_inf_pa if drop.material is not None else math.nan,
    }


def _counts(folder: Path, drop: Drop) -> Row:
    """Frames of the leading view with status ok or a value set by hand, and frames in its clip."""
    leading = drop.experiment.sides[0]
    if not has_table(folder, leading):
        return {"frames_measured": 0, "frames_total": 0}
    view = read_table(folder, leading)
    total = len(view)
    if has_table(folder, "frames"):
        frames = read_table(folder, "frames")
        total = max(total, int((frames["view"] == leading).sum()))
    # a frame that a person left out is manual too, but has no value
    value = view["y_b_m" if leading == "side" else "stretch"]
    measured = (view["status"] == "ok") | ((view["status"] == "manual") & value.notna())
    return {"frames_measured": int(measured.sum()), "frames_total": total}


def _speed_columns(speeds: Speeds) -> Row:
    return {
        "impact_speed_m_s": speeds.impact,
        "impact_speed_m_s_unc": speeds.impact_unc,
        "speed_after_period_m_s": speeds.after,
        "speed_after_period_m_s_unc": speeds.after_unc,
        "delta_u_over_u0": speeds.loss,
        "delta_u_over_u0_unc": speeds.loss_unc,
        "velocity_source": speeds.source or None,
    }


def _flight(folder: Path, drop: Drop) -> Row:
    """Velocity and constant acceleration of a free flight; the scale's uncertainty is in theirs."""
    if not has_table(folder, "kinematics"):
        return {}
    table = read_table(folder, "kinematics")
    known = table[table["a_c_m_s2"].notna()]
    if known.empty:
        return {}
    middle = {str(k): v for k, v in known.iloc[len(known) // 2].items()}
    value, random = number(middle, "a_c_m_s2"), number(middle, "a_c_m_s2_unc")
    geometry = first_row(folder, "geometry", view=drop.experiment.sides[0])
    scale = number(geometry, "scale_px_per_m_unc", 0.0) / number(geometry, "scale_px_per_m", math.inf)
    velocity = number(middle, "v_c_m_s")
    return {
        "velocity_m_s": velocity,
        "velocity_m_s_unc": math.hypot(number(middle, "v_c_m_s_unc"), velocity * scale),
        "acceleration_m_s2": value,
        "acceleration_m_s2_unc": math.hypot(random, value * scale),
    }


def _oscillation(folder: Path) -> Row:
    """Free period, its ratio to the model's, the first peaks."""
    first = first_row(folder, "periods")
    row: Row = {
        "period_s": number(first, "peak_to_peak_s"),
        "period_s_unc": number(first, "peak_to_peak_s_unc"),
        "time_ratio": number(first_row(folder, "model_fit"), "time_ratio"),
    }
    if not has_table(folder, "periods"):
        return row
    periods = read_table(folder, "periods")
    peaks = zip(column(periods, "stretch_peak"), column(periods, "stretch_peak_unc"), strict=True)
    for n, (peak, unc) in enumerate(list(peaks)[:PEAKS], start=1):
        row[f"stretch_peak_{n}"], row[f"stretch_peak_{n}_unc"] = float(peak), float(unc)
    return row


def _status(folder: Path, drop: Drop, row: Row, pinch_off: Row) -> str:
    """The first reason why a number that this scene calls for is missing; ok where none is."""
    if row["frames_measured"] < drop.experiment.analysis.min_frames:
        return "too_few"
    if drop.experiment.kind == "free_flight":
        return "ok" if math.isfinite(row.get("acceleration_m_s2", math.nan)) else "too_few"
    reasons: list[tuple[Any, str]] = []
    if drop.experiment.kind == "water_entry" and drop.experiment.views.side is not None:
        reasons.append((row["t_p_s"], text(pinch_off, "status") or "no_neck"))
        impact_s = number(first_row(folder, "geometry", view="side"), "impact_time_s")
        reasons.append((row["impact_speed_m_s"], "not_identified" if math.isfinite(impact_s) else "no_object"))
        if row["seal_type"] == "deep_seal":
            reasons.append((row["diameter_eff_m"], "not_identified"))
        if drop.experiment.deformable:
            reasons.append((row["delta_u_over_u0"], text(first_row(folder, "periods"), "status") or "too_few"))
    if drop.experiment.deformable:
        reasons.append((row.get("period_s", math.nan), text(first_row(folder, "periods"), "status") or "too_few"))
    missing = [word for value, word in reasons if not math.isfinite(value)]
    return next((word for word in missing if word != "ok"), "not_identified" if missing else "ok")


def summary_of(folder: Path) -> pd.DataFrame | None:
    """The row of a drop, or ``None`` where its summary was not written."""
    return read_table(folder, "summary") if has_table(folder, "summary") else None
