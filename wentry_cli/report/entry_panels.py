"""Figure 3: the bottom of the sphere and its stretch in time, for the drop nearest to the paper's."""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from wentry_cli.report.campaign import Campaign, DropResults, example_drop, why_shown
from wentry_cli.report.curves import measured
from wentry_cli.report.legends import clear_limits, legend_above, stiffness_handles
from wentry_cli.report.moments import telling_moments
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.style import BLACK, GREY, stiffness_shade


def bottom_position(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 3c: y_b/D against t/t_p."""
    title = "Position of the lowest point"
    able = [drop for drop in campaign.of("water_entry") if math.isfinite(drop.number("t_p_s"))]
    able = [drop for drop in able if not measured(drop.table("side"), ["t_s", "y_b_m"]).empty]
    if not able:
        return NotDrawn("3c", title, "no drop has both the position of its lowest point and a time of pinch-off")
    nearest = example_drop(able, "side")
    drop = nearest or able[0]
    needed = "the time of pinch-off t_p"
    why = why_shown(able, "side", needed)
    if nearest is None and len(able) > 1:
        why = f" (the first with {needed}; no soft sphere has it)"
    side = measured(drop.table("side"), ["t_s", "y_b_m", "y_b_m_unc"])
    t_p, size = drop.number("t_p_s"), drop.number("diameter_m")
    side = side[side["t_s"] <= 1.15 * t_p]
    data = pd.DataFrame(
        {
            "series": "measured",
            "t_over_tp": side["t_s"] / t_p,
            "y_b_over_d": side["y_b_m"] / size,
            "y_b_over_d_unc": side["y_b_m_unc"] / size,
        }
    )
    data = pd.concat([data, _moment_rows(drop, "t_over_tp", t_p)], ignore_index=True)

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        shown = data[data["series"] == "measured"]
        _moment_lines(ax, data, "t_over_tp")
        shade = stiffness_shade(drop.number("g_inf_pa"), drop.rigid)
        ax.axhline(0.0, color=GREY, linewidth=0.6)
        ax.errorbar(
            shown["t_over_tp"], shown["y_b_over_d"], yerr=shown["y_b_over_d_unc"],
            fmt="o", markersize=2.2, color=shade, ecolor=GREY, elinewidth=0.5, markeredgewidth=0.0,
        )  # fmt: skip
        ax.set(xlabel="$t/t_p$", ylabel="$y_b/D$")
        ax.margins(x=0.03)
        legend_above(ax, stiffness_handles(pd.DataFrame([{"rigid": drop.rigid, "g_inf_pa": drop.number("g_inf_pa")}])))
        clear_limits(ax, (), [0.0, *shown["y_b_over_d"]], pad=0.06)

    caption = (
        f"Lowest point y_b of drop {drop.name}{why} over the diameter D against time over t_p = "
        f"{1e3 * t_p:.1f} ms. Bars: standard uncertainty. Vertical lines: the frames of the film strip."
    )
    return Panel("3c", "fig_3c_bottom_position", title, caption, data, draw, drop=drop.name)


def stretch_in_time(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 3d: λ(t)."""
    title = "Stretch in time"
    drop = example_drop(campaign.drops, "stretch")
    if drop is None:
        return NotDrawn("3d", title, "no deformable sphere that enters water has a measured stretch")
    table = drop.table("stretch")
    table = table[pd.to_numeric(table["stretch"], errors="coerce").notna()]
    data = pd.DataFrame(
        {
            "series": table["source"].fillna("").astype(str),
            "t_ms": 1e3 * table["t_s"].astype(float),
            "stretch": table["stretch"].astype(float),
            "stretch_unc": table["stretch_unc"].astype(float),
        }
    )
    data = pd.concat([data, _moment_rows(drop, "t_ms", 1e-3)], ignore_index=True)

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        _moment_lines(ax, data, "t_ms")
        ax.axhline(1.0, color=GREY, linewidth=0.6)
        for source, marker, face in (("top", "o", "white"), ("side", "o", BLACK), ("both", "s", "#7F7F7F")):
            shown = data[data["series"] == source]
            if not shown.empty:
                ax.errorbar(
                    shown["t_ms"], shown["stretch"], yerr=shown["stretch_unc"], fmt=marker, markersize=2.6, color=BLACK,
                    markerfacecolor=face, markeredgewidth=0.5, ecolor=GREY, elinewidth=0.5,
                    label="both views" if source == "both" else f"{source} view",
                )  # fmt: skip
        ax.set(xlabel="$t$ (ms)", ylabel=r"$\lambda$")
        legend_above(ax)
        ax.margins(x=0.03)
        clear_limits(ax, (), [1.0, *data["stretch"]], pad=0.06)

    caption = (
        f"Principal stretch λ of drop {drop.name}{why_shown(campaign.drops, 'stretch', 'λ')}, {_sources(data)}. "
        "Bars: standard uncertainty. Vertical lines: the frames of the film strip."
    )
    return Panel("3d", "fig_3d_stretch", title, caption, data, draw, drop=drop.name)


def _sources(data: pd.DataFrame) -> str:
    """Which views λ comes from."""
    seen = [name for name in ("top", "side", "both") if bool((data["series"] == name).any())]
    if seen in (["top"], ["side"]):
        return f"from the {seen[0]} view"
    return "from both views where both see the sphere, elsewhere from the one that does"


def _moment_rows(drop: DropResults, column: str, unit: float) -> pd.DataFrame:
    moments = telling_moments(drop)
    return pd.DataFrame(
        {"series": "moment", column: [moment.t_s / unit for moment in moments], "label": [m.label for m in moments]}
    )


def _moment_lines(ax: Axes, data: pd.DataFrame, column: str) -> None:
    for row in data[data["series"] == "moment"].to_dict("records"):
        ax.axvline(row[column], color=GREY, linewidth=0.5, linestyle=(0, (4, 3)), zorder=0)
