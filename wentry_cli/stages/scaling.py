"""Stage ``scaling`` of a campaign: all drops in one ``summary.csv``, and the paper's relations (``scaling.csv``)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.scaling.dimensionless import elastic_time
from wentry_cli.scaling.regression import Points, Regression, fit_line, fit_power_law
from wentry_cli.stages.inputs.columns import column
from wentry_cli.stages.summary import summary_of
from wentry_cli.tables import new_table, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

Array = NDArray[np.float64]
SOFTEST = 0.2  # below this stiffness ratio the paper's ΔU/U₀ goes to 1 and follows no power law
OTHER_SEALS = ("sphere_seal", "surface_seal")  # they close by another way than a neck at depth


@dataclass(frozen=True)
class Relation:
    """A relation to be fitted: its name, the columns of x and y, the paper's value (slope, or exponent)."""

    name: str
    x: str
    y: str
    paper_value: float = float("nan")
    power_law: bool = False


LINES = (
    Relation("period_exp", "elastic_time_s", "period_s", 1.4),
    Relation("period_model", "elastic_time_s", "period_model_s", 1.2),
    Relation("pinch_off_d", "froude", "tp_u0_over_d"),
    Relation("pinch_off_deff", "froude_eff", "tp_u0_over_deff", 1.3),
    Relation("pinch_off_deff_froude", "froude", "tp_u0_over_deff", 1.3),
)
LOSS = Relation("delta_u", "stiffness_ratio", "delta_u_over_u0", -0.5, power_law=True)


def run(results: Path, drops: list[Drop]) -> None:
    """Collect the summaries of ``drops`` and fit every relation, through the origin and with an intercept."""
    import pandas as pd

    rows = [summary_of(results / drop.name) for drop in sorted(drops, key=lambda d: d.name)]
    known = [row for row in rows if row is not None]
    table = pd.concat(known, ignore_index=True) if known else new_table("summary", {})
    write_table(results, "summary", table)
    write_table(results, "scaling", scaling_table(table))


def scaling_table(summary: pd.DataFrame) -> pd.DataFrame:
    """Return ``scaling.csv`` of a campaign from its ``summary.csv``."""
    values, reasons = _values(summary), _reasons(summary)
    names = summary["drop"].to_numpy(dtype=str)
    doubts = summary["doubts"].fillna("").str.replace("; ", " and ").to_numpy(dtype=str)
    spheres, conditions = _labels(summary)
    rows = []
    for relation in (*LINES, LOSS):
        x, y = values[relation.x], values[relation.y]
        known = np.isfinite(x) & np.isfinite(y)
        why = reasons[relation.y]
        notes = {
            "left_out": "; ".join(f"{names[i]}: {why[i]}" for i in np.flatnonzero(~known) if why[i]) or None,
            "doubtful": "; ".join(f"{names[i]}: {doubts[i]}" for i in np.flatnonzero(known) if doubts[i]) or None,
        }
        for intercept in (False,) if relation.power_law else (False, True):
            points = Points(x, y, spheres, conditions)
            found = fit_power_law(points) if relation.power_law else fit_line(points, intercept=intercept)
            rows.append(_row(relation, found, "_intercept" if intercept else "") | notes)
    return new_table("scaling", {name: [row[name] for row in rows] for name in rows[0]})


def _labels(summary: pd.DataFrame) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of the sphere and of the condition of each drop; one without a condition is a condition of its own."""
    spheres = summary["sphere_id"].fillna("").to_numpy(dtype=str)
    conditions = summary["condition"].fillna("").to_numpy(dtype=str)
    names = summary["drop"].to_numpy(dtype=str)
    # a slash stands in no name, so that a drop is never taken for a condition
    repeats = [f"{c}/{s}" if c else n for n, s, c in zip(names, spheres, conditions, strict=True)]
    by_sphere, by_condition = (np.unique(labels, return_inverse=True)[1] for labels in (spheres, np.array(repeats)))
    return by_sphere.astype(np.int64), by_condition.astype(np.int64)


def _flags(summary: pd.DataFrame) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Which drops enter water, which spheres deform there, which cavities closed in another way than at depth."""
    entry = (summary["kind"] == "water_entry").to_numpy(dtype=bool, na_value=False)
    rigid = (summary["rigid"] == "true").to_numpy(dtype=bool, na_value=False)
    other = summary["seal_type"].isin(OTHER_SEALS).to_numpy(dtype=bool, na_value=False)
    return entry, entry & ~rigid, other


def _values(summary: pd.DataFrame) -> dict[str, Array]:
    """Abscissas and ordinates; NaN where a drop takes no part in a relation."""
    names = (
        "period_s",
        "tp_u0_over_d",
        "tp_u0_over_deff",
        "froude",
        "froude_eff",
        "stiffness_ratio",
        "delta_u_over_u0",
    )
    values = {name: column(summary, name) for name in names}
    entry, soft, other = _flags(summary)
    sizes = zip(*(column(summary, n) for n in ("diameter_m", "g_inf_pa", "density_kg_m3")), strict=True)
    values["elastic_time_s"] = np.array([elastic_time(*size) for size in sizes])
    values["period_s"] = np.where(soft, values["period_s"], np.nan)
    values["period_model_s"] = values["period_s"] / column(summary, "time_ratio")
    for name in ("tp_u0_over_d", "tp_u0_over_deff"):
        values[name] = np.where(entry & ~other, values[name], np.nan)
    stiff = soft & (values["stiffness_ratio"] > SOFTEST)
    values["delta_u_over_u0"] = np.where(stiff, values["delta_u_over_u0"], np.nan)
    return values


def _reasons(summary: pd.DataFrame) -> dict[str, NDArray[np.object_]]:
    """Why a drop may be missing from a relation, by ordinate; empty where the relation is not about it.

    The status of a drop tells of its pinch-off first, and says nothing of other numbers where that is missing. A drop
    with status ok whose value is empty was not asked for it.
    """
    entry, soft, other = _flags(summary)
    status = _spoken(summary["status"].replace("ok", ""))
    missing = {
        name: ~np.isfinite(column(summary, name))
        for name in ("g_inf_pa", "density_kg_m3", "t_p_s", "period_s", "impact_speed_m_s")
    }
    of_pinch_off = missing["t_p_s"] & (status != "") & (status != "too few")
    later = np.where(of_pinch_off, "not measured", status)
    stiffness = {"no material": missing["g_inf_pa"], "no density": missing["density_kg_m3"]}
    seal = np.where(other, _spoken(summary["seal_type"]), status)
    below = column(summary, "stiffness_ratio") <= SOFTEST
    asked = ~missing["impact_speed_m_s"] | (status != "")
    period = _first({"": ~soft, **stiffness, "no model": ~missing["period_s"]}, later)
    loss = {"": ~soft, f"G∞/(ρ_w U₀²) below {SOFTEST}": below, "no material": missing["g_inf_pa"] & asked}
    pinch_off = np.where(entry, seal, "")
    return {
        "period_s": period,
        "period_model_s": period,
        "tp_u0_over_d": pinch_off,
        "tp_u0_over_deff": pinch_off,
        "delta_u_over_u0": _first(loss, later),
    }


def _spoken(words: pd.Series[str]) -> NDArray[np.object_]:
    """Words of a table as a reader has them: without underscores."""
    return words.fillna("").str.replace("_", " ").to_numpy(dtype=object)


def _first(reasons: dict[str, NDArray[np.bool_]], otherwise: NDArray[np.object_]) -> NDArray[np.object_]:
    """The first reason that holds for each drop."""
    words = [np.full(otherwise.shape, word, dtype=object) for word in reasons]
    return np.select(list(reasons.values()), words, otherwise)


def _row(relation: Relation, found: Regression, suffix: str) -> dict[str, Any]:
    return {
        "relation": relation.name + suffix,
        "x": relation.x,
        "y": relation.y,
        "slope": found.slope,
        "slope_unc": found.slope_unc,
        "slope_low": found.slope_low,
        "slope_high": found.slope_high,
        "intercept": found.intercept,
        "intercept_unc": found.intercept_unc,
        "exponent": found.exponent,
        "exponent_unc": found.exponent_unc,
        "exponent_low": found.exponent_low,
        "exponent_high": found.exponent_high,
        "dof": found.dof,
        "r_squared": found.r_squared,
        "residual_scatter": found.residual_scatter,
        "n": found.n,
        "n_conditions": found.n_conditions,
        "n_spheres": found.n_spheres,
        "paper_value": relation.paper_value,
        "status": found.status,
    }
