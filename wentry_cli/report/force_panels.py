"""Figure 8: force coefficients, averaged over the periods of soft spheres and instantaneous for rigid ones."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from wentry_cli.report.campaign import Campaign, doubts_of
from wentry_cli.report.curves import conditions, mean_curve, measured
from wentry_cli.report.legends import EDGE, legend_above, size_handles, stiffness_handles
from wentry_cli.report.numbers import with_uncertainty
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.style import BLUE, GREY, PANEL_SIZE, line_width, marker_size, stiffness_shade
from wentry_cli.report.velocity_panels import LATEST, with_gaps

COLUMNS = ["t_mid_over_tp", "force_coefficient", "force_coefficient_unc"]
TITLE = "Force coefficient"


def force_coefficients(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 8: C̄_F of deformable and C_F of rigid spheres against t/t_p."""
    tables = _period_averages(campaign) + _rigid_curves(campaign)
    if not tables:
        return NotDrawn("8", TITLE, "no drop has force coefficients")
    data = pd.concat(tables, ignore_index=True)

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
        low, high = _limits(data)
        for _, curve in data[data["series"] == "rigid"].groupby("drop", sort=False):
            line = with_gaps(curve, known_to=high - low)
            t, c, unc = (line[name] for name in COLUMNS)
            ax.fill_between(t, c - unc, c + unc, color=BLUE, alpha=0.2, linewidth=0, zorder=1)
            ax.plot(t, c, color=BLUE, linewidth=line_width(float(curve["diameter_m"].iloc[0])), zorder=2)
        for row in data[data["series"] == "period average"].to_dict("records"):
            ax.errorbar(
                row[COLUMNS[0]], row[COLUMNS[1]], yerr=row[COLUMNS[2]], fmt="o", elinewidth=0.8, zorder=4,
                color=stiffness_shade(row["g_inf_pa"], False), markersize=marker_size(row["diameter_m"]), **EDGE,
            )  # fmt: skip
        latest = 1.04 * float(data["t_mid_over_tp"].max())
        ax.set(xlabel="$t/t_p$", ylabel=r"$\overline{C}_F,\ C_F$", xlim=(0, latest), ylim=(low, high))
        legend_above(ax, _handles(data))

    caption = (
        "Coefficient of the net force, mass times acceleration, against t/t_p; positive where the acceleration is "
        "upwards (ÿ_c > 0), against the travel. Symbols: deformable spheres, lighter is softer, over each period N: "
        "C̄_F = ρ_s V ⟨ÿ_c⟩/(½ ρ_w ⟨ẏ_b⟩² A) with A = π (λ_pN D/2)², V = π D³/6 and ⟨ ⟩ the mean over the period. "
        "Blue curves: rigid spheres, in each frame: C_F = ρ_s V ÿ_c/(½ ρ_w ẏ_c² A) with A = π D²/4. "
        "Bars and bands: standard uncertainty, of repeated rigid drops the spread; no curve where it exceeds the axis. "
        "The table behind the panel also has the hydrodynamic coefficient, with weight and buoyancy taken out."
    )
    caption += _extremes(data) + _cut(data)
    shown = {name for names in data["drop"] for name in names.split(" + ")}
    doubts = doubts_of(drop for drop in campaign.drops if drop.name in shown)
    caption += f" In doubt: {doubts}." if doubts else ""
    return Panel("8", "fig_8_force_coefficient", TITLE, caption, data, draw, size=PANEL_SIZE)


def _period_averages(campaign: Campaign) -> list[pd.DataFrame]:
    tables = []
    for drop in campaign.of("water_entry"):
        found = measured(drop.table("forces"), COLUMNS[:2])
        if drop.rigid or found.empty:
            continue
        forces = drop.table("forces")
        good = forces[(forces["t_mid_over_tp"] <= LATEST) & forces["force_coefficient"].notna()]
        if good.empty:
            continue
        kept = ["t_mid_over_tp", *[name for name in forces.columns if name.startswith("force_")], "period"]
        known = {"diameter_m": drop.number("diameter_m"), "g_inf_pa": drop.number("g_inf_pa"), "rigid": False}
        tables.append(good[kept].assign(series="period average", drop=drop.name, **known))
    return tables


def _rigid_curves(campaign: Campaign) -> list[pd.DataFrame]:
    tables = []
    for group in conditions(drop for drop in campaign.of("water_entry") if drop.rigid):
        found = [measured(drop.table("forces"), COLUMNS) for drop in group]
        curves = [tuple(table[name].to_numpy() for name in COLUMNS) for table in found if len(table) > 1]
        if curves:
            columns = dict(zip(COLUMNS, mean_curve(curves), strict=True))  # type: ignore[arg-type]
            name = " + ".join(drop.name for drop in group)
            size = group[0].number("diameter_m")
            curve = pd.DataFrame(columns).assign(series="rigid", drop=name, diameter_m=size, rigid=True)
            tables.append(curve[(curve["t_mid_over_tp"] >= 0) & (curve["t_mid_over_tp"] <= LATEST)])
    return tables


def _limits(data: pd.DataFrame) -> tuple[float, float]:
    """Limits that hold every average and the bulk of the rigid curves.

    The slam spike of a few frames may leave, and so may an error bar that is longer than what the averages span.
    """
    values = data["force_coefficient"].astype(float)
    rigid = values[data["series"] == "rigid"]
    bulk = [float(np.nanquantile(rigid, part)) for part in (0.02, 0.96)] if len(rigid) else []
    soft = data[data["series"] == "period average"]
    inner = [*bulk, *soft["force_coefficient"], 0.0]
    bars = soft["force_coefficient_unc"].astype(float).fillna(0.0).clip(upper=0.25 * (max(inner) - min(inner)))
    ends = [*inner, *(soft["force_coefficient"] - bars), *(soft["force_coefficient"] + bars)]
    low, high = min(ends), max(ends)
    return low - 0.1 * (high - low), high + 0.15 * (high - low) or 1.0


def _cut(data: pd.DataFrame) -> str:
    """Say what of curves and bars lies beyond the axis; empty where nothing does."""
    low, high = _limits(data)
    told = ""
    rigid = data[(data["series"] == "rigid") & ~(data["force_coefficient_unc"] > high - low)]
    for word, beyond in (
        ("up", rigid[rigid["force_coefficient"] > high].nlargest(1, "force_coefficient")),
        ("down", rigid[rigid["force_coefficient"] < low].nsmallest(1, "force_coefficient")),
    ):
        for row in beyond.to_dict("records"):
            far, when = (
                with_uncertainty(row["force_coefficient"], digits=3),
                with_uncertainty(row[COLUMNS[0]], digits=2),
            )
            told += f" The axis cuts the rigid curves off, which reach {word} to C_F = {far} (at t/t_p = {when})."
    soft = data[data["series"] == "period average"]
    value, unc = soft["force_coefficient"], soft["force_coefficient_unc"]
    if bool(((value + unc > high) | (value - unc < low)).any()):
        told += " A bar that reaches the frame goes on beyond it."
    return told


def _extremes(data: pd.DataFrame) -> str:
    """Name the drops of the highest and of the lowest symbol; empty for fewer than three."""
    soft = data[data["series"] == "period average"].sort_values("force_coefficient", kind="stable")
    if len(soft) < 3:
        return ""
    told = []
    for word, place in (("Highest", -1), ("lowest", 0)):
        row = soft.iloc[place]
        told.append(f"{word} symbol: {row['drop']}, N = {row['period']:.0f}")
    return f" {'; '.join(told)}."


def _handles(data: pd.DataFrame) -> list[Line2D]:
    handles: list[Line2D] = []
    soft = data[data["series"] == "period average"]
    handles += stiffness_handles(soft) if len(soft) else []
    if bool((data["series"] == "rigid").any()):
        handles.append(Line2D([], [], color=BLUE, linewidth=1.2, label="rigid, instantaneous"))
    return [*handles, *size_handles(data)]
