"""Figure 7: the velocity of the centre of mass by impact speed, and what the first period costs of it."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from wentry_cli.report.campaign import Campaign, DropResults, as_number, doubts_of
from wentry_cli.report.curves import Curve, conditions, grouped_points, mean_curve, measured
from wentry_cli.report.fits import exponent_text
from wentry_cli.report.legends import (
    ON_ANOTHER,
    clear_limits,
    crossed,
    draw_points,
    legend_above,
    plain_decades,
    point_handles,
    size_handles,
    span_of,
    stiffness_handles,
    uncover,
)  # fmt: skip
from wentry_cli.report.panel import NotDrawn, Panel, rows
from wentry_cli.report.style import BLACK, GREEN, GREY, QUOTED, line_width, stiffness_shade

TITLE = "Velocity of the centre of mass"
LATEST = 1.5  # t/t_p shown
APART = 1.1  # impact speeds that differ by less belong together


def velocity_panels(campaign: Campaign) -> list[Panel | NotDrawn]:
    """Panels 7a, 7b, 7c: |ẏ_c|/U₀ against t/t_p, one for each impact speed."""
    able = [drop for drop in campaign.of("water_entry") if velocity_curve(drop) is not None]
    if not able:
        reason = "no drop has a velocity of its centre, an impact speed and a time of pinch-off"
        return [NotDrawn("7a–c", TITLE, reason)]
    groups = speed_groups(able)
    panels = [_velocity_panel(f"7{letter}", group) for letter, group in zip("abc", groups, strict=False)]
    missing = "abc"[len(groups) :]
    reason = f"the drops have {len(groups)} distinct impact speed{'s' if len(groups) > 1 else ''}"
    return [*panels, *(NotDrawn(f"7{letter}", TITLE, reason) for letter in missing)]


def speed_groups(drops: list[DropResults]) -> list[list[DropResults]]:
    """Group drops by impact speed, slowest first: split at the widest ratios above 1.1, into three at most."""
    ordered = sorted(drops, key=lambda drop: (drop.number("impact_speed_m_s"), drop.name))
    speeds = [drop.number("impact_speed_m_s") for drop in ordered]
    ratios = [(later / earlier, place) for place, (earlier, later) in enumerate(pairwise(speeds), start=1)]
    widest = sorted((ratio for ratio in ratios if ratio[0] > APART), reverse=True)[:2]
    cuts = [0, *sorted(place for _, place in widest), len(ordered)]
    return [ordered[start:stop] for start, stop in pairwise(cuts)]


def velocity_curve(drop: DropResults) -> Curve | None:
    """|ẏ_c|/U₀ with its uncertainty against t/t_p, from the table that the summary names; None where there is none."""
    source = drop.text("velocity_source") or "kinematics"
    table = drop.table(source if source in {"kinematics", "kinematics_model"} else "kinematics")
    speed, t_p = drop.number("impact_speed_m_s"), drop.number("t_p_s")
    found = measured(table, ["t_s", "v_c_m_s", "v_c_m_s_unc"])
    found = found[(found["t_s"] >= 0.0) & (found["t_s"] <= LATEST * t_p)]
    if len(found) < 2 or not (speed > 0 and t_p > 0):
        return None
    return (
        found["t_s"].to_numpy() / t_p,
        np.abs(found["v_c_m_s"].to_numpy()) / speed,
        found["v_c_m_s_unc"].to_numpy() / speed,
    )


def _velocity_panel(key: str, drops: list[DropResults]) -> Panel:
    tables = []
    for group in conditions(drops):
        curves = [curve for curve in map(velocity_curve, group) if curve is not None]
        t, v, unc = mean_curve(curves)
        first = group[0]
        ends = [_first_period_end(drop) for drop in group]
        end = float(np.mean([value for value in ends if math.isfinite(value)] or [math.nan]))
        table = pd.DataFrame({"t_over_tp": t, "speed_over_u0": v, "speed_over_u0_unc": unc})
        table = table.assign(series="velocity", drop=" + ".join(drop.name for drop in group), repeats=len(group))
        table = table.assign(
            rigid=first.rigid, g_inf_pa=first.number("g_inf_pa"), diameter_m=first.number("diameter_m")
        )
        mark = table.head(1).assign(
            series="end of period 1", t_over_tp=end, speed_over_u0=math.nan, speed_over_u0_unc=math.nan
        )
        tables += [table, mark] if math.isfinite(end) else [table]
    data = pd.concat(tables, ignore_index=True)
    speeds = [drop.number("impact_speed_m_s") for drop in drops]
    span = span_of(min(speeds), max(speeds))
    caption = (
        f"Speed of the centre of mass over U₀ = {span} m/s against t/t_p. Grey: deformable spheres, lighter is softer; "
        "blue: rigid; thick: large. Vertical lines: end of the first period. Bands: standard uncertainty, of "
        "repeated drops the spread; nothing is drawn where it exceeds U₀."
    )
    caption += f" In doubt: {doubts}." if (doubts := doubts_of(drops)) else ""
    title = f"{TITLE}, {span} m/s"
    return Panel(key, f"fig_{key}_velocity", title, caption, data, partial(_draw_velocity, data=data))


def _first_period_end(drop: DropResults) -> float:
    periods = drop.table("periods")
    end = as_number(periods["t_end_s"].iloc[0]) if drop.deformable_entry and not periods.empty else math.nan
    return end / drop.number("t_p_s")


def _draw_velocity(figure: FigureBase, data: pd.DataFrame) -> None:
    ax = figure.subplots()
    for _, curve in data.groupby("drop", sort=False):
        first = curve.iloc[0]
        shade = stiffness_shade(float(first["g_inf_pa"]), bool(first["rigid"]))
        line = with_gaps(curve[curve["series"] == "velocity"], known_to=1.0)
        t, v, unc = line["t_over_tp"], line["speed_over_u0"], line["speed_over_u0_unc"]
        ax.fill_between(t, v - unc, v + unc, color=shade, alpha=0.25, linewidth=0, zorder=2)
        ax.plot(t, v, color=shade, linewidth=line_width(float(first["diameter_m"])), zorder=3)
        for end in curve.loc[curve["series"] == "end of period 1", "t_over_tp"]:
            ax.axvline(end, color=shade, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
    ax.set(xlabel="$t/t_p$", ylabel=r"$|\dot{y}_c|/U_0$", xlim=(0, min(LATEST, float(data["t_over_tp"].max()))))
    ax.set_ylim(0, 1.08 * max(1.0, float(data["speed_over_u0"].quantile(0.998))))
    legend_above(ax, [*stiffness_handles(data, line=True), *size_handles(data, line=True)])


def with_gaps(curve: pd.DataFrame, known_to: float = math.inf) -> pd.DataFrame:
    """Put an empty row where frames are missing, so that no line bridges what was not measured.

    The columns are abscissa, value, uncertainty. Rows that are not known to ``known_to``, the height of the axis, are
    empty too: their band would be a stripe across it.
    """
    value, unc = curve.columns[1:3]
    curve = curve.assign(**{value: curve[value].where(~(curve[unc] > known_to))})
    t = curve.iloc[:, 0].to_numpy(dtype=float)
    if t.size < 3:
        return curve
    steps = np.diff(t)
    holes = np.flatnonzero(steps > 2.5 * np.median(steps))
    empty = curve.iloc[holes].assign(**dict.fromkeys(curve.columns[1:3], math.nan))
    empty.index = empty.index.astype(float) + 0.5  # type: ignore[assignment]
    return pd.concat([curve, empty]).sort_index(kind="stable")


def velocity_change(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 7d: ΔU/U₀ over the first period against G∞/(ρ_w U₀²), with the −1/2 law and the added-mass band."""
    from wentry_cli.report.theory import (
        PAPER_DELTA_U_EXPONENT,
        PAPER_PREFACTOR,
        PAPER_STIFFNESS_LIMIT,
        PAPER_STRETCH_RANGE,
        added_mass_prefactor,
    )

    title = "Velocity lost over the first period"
    drops = [drop for drop in campaign.of("water_entry") if drop.deformable_entry]
    found = grouped_points(drops, _lost)
    if not found:
        lost = any(math.isfinite(drop.number("delta_u_over_u0")) for drop in drops)
        unknown = "no deformable drop with a velocity after its first period has a material, whose stiffness is known"
        return NotDrawn("7d", title, unknown if lost else "no deformable drop has a velocity after its first period")
    points = rows([{**row, "series": "experiment"} for row in found],
                  ["series", "drop", "repeats", "rigid", "g_inf_pa", "diameter_m", "seal_type", "doubts",
                   "stiffness_ratio", "delta_u_over_u0", "delta_u_over_u0_unc"])  # fmt: skip
    x = np.geomspace(
        0.5 * min(points["stiffness_ratio"].min(), 0.1), 2.0 * max(points["stiffness_ratio"].max(), 2.0), 60
    )
    law = x**PAPER_DELTA_U_EXPONENT
    high, low = (added_mass_prefactor(stretch) for stretch in PAPER_STRETCH_RANGE)
    relation = campaign.relation("delta_u")
    prefactor, exponent = as_number(relation.get("slope")), as_number(relation.get("exponent"))
    lines = {
        "law": pd.DataFrame({"delta_u_over_u0": law}),
        "added mass": pd.DataFrame({"delta_u_over_u0_low": low * law, "delta_u_over_u0_high": high * law}),
    }
    if math.isfinite(prefactor) and math.isfinite(exponent):
        fitted = np.where(x >= PAPER_STIFFNESS_LIMIT, prefactor * x**exponent, np.nan)
        lines["fit"] = pd.DataFrame({"delta_u_over_u0": fitted})
    tables = [table.assign(series=name, stiffness_ratio=x) for name, table in lines.items()]
    data = pd.concat([points, *tables], ignore_index=True)

    def draw(figure: FigureBase) -> None:
        _draw_change(figure.subplots(), data, points)

    caption = (
        "Velocity lost over the first period, ΔU/U₀, against G∞/(ρ_w U₀²). Solid: the scaling law with exponent −1/2 "
        "and "
        f"prefactor 1; band: the law with added mass, prefactor 1/(1 + C_m) = {low:.3f} to {high:.3f} for λ = "
        f"{PAPER_STRETCH_RANGE[1]} to {PAPER_STRETCH_RANGE[0]} (the paper states {PAPER_PREFACTOR[0]} to "
        f"{PAPER_PREFACTOR[1]}); "
        f"dotted: ΔU = U₀ and the ratio {PAPER_STIFFNESS_LIMIT} above which the law is expected. Own fit above it: "
        f"{exponent_text(relation)}.{ON_ANOTHER}{crossed(points)}"
    )
    return Panel("7d", "fig_7d_velocity_change", title, caption, data, draw)


def _lost(drop: DropResults) -> dict[str, float]:
    ratio = drop.number("stiffness_ratio")
    relative = 2.0 * drop.number("impact_speed_m_s_unc") / drop.number("impact_speed_m_s")
    columns = ("delta_u_over_u0", "delta_u_over_u0_unc")
    return {
        "stiffness_ratio": ratio,
        "stiffness_ratio_unc": ratio * relative,
        **{name: drop.number(name) for name in columns},
    }


def _draw_change(ax: Axes, data: pd.DataFrame, points: pd.DataFrame) -> None:
    from wentry_cli.report.theory import PAPER_STIFFNESS_LIMIT

    ax.set(xscale="log", yscale="log")
    band, law, fit = (data[data["series"] == name] for name in ("added mass", "law", "fit"))
    ax.fill_between(band["stiffness_ratio"], band["delta_u_over_u0_low"], band["delta_u_over_u0_high"],
                    color=GREEN, alpha=0.18, linewidth=0, zorder=0)  # fmt: skip
    ax.plot(law["stiffness_ratio"], law["delta_u_over_u0"], color=BLACK, linewidth=1.0, zorder=2)
    if not fit.empty:
        ax.plot(
            fit["stiffness_ratio"], fit["delta_u_over_u0"], color=GREY, linewidth=1.2, linestyle=(0, (5, 2)), zorder=2
        )
    ax.axhline(1.0, **QUOTED)
    ax.axvline(PAPER_STIFFNESS_LIMIT, **QUOTED)
    draw_points(ax, points, "stiffness_ratio", "delta_u_over_u0")
    clear_limits(ax, [0.1, 2.0, *points["stiffness_ratio"]], [0.3, 1.0, *points["delta_u_over_u0"]])
    uncover(ax)
    ax.set(xlabel=r"$G_\infty/\rho_w U_0^2$", ylabel=r"$\Delta U/U_0$")
    plain_decades(ax.xaxis)
    plain_decades(ax.yaxis)
    handles = [
        *point_handles(points),
        Line2D([], [], color=BLACK, linewidth=1, label="slope −1/2"),
    ]
    if not fit.empty:
        handles.append(Line2D([], [], color=GREY, linewidth=1.2, linestyle=(0, (5, 2)), label="own fit"))
    handles.append(Line2D([], [], color=GREEN, alpha=0.3, linewidth=5, label="with added mass"))
    legend_above(ax, handles)
