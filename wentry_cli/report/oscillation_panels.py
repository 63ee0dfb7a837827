"""Figure 4: the period, the peaks and the decay of the sphere's oscillation."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from wentry_cli.report.campaign import Campaign, DropResults, as_number, example_drop, why_shown
from wentry_cli.report.curves import grouped_points, measured
from wentry_cli.report.fits import fit_rows, slope_text
from wentry_cli.report.legends import (
    EDGE,
    ON_ANOTHER,
    clear_limits,
    crossed,
    doubt_handles,
    draw_points,
    legend_above,
    mark_doubts,
    plain_decades,
    point_handles,
    size_handles,
    uncover,
)  # fmt: skip
from wentry_cli.report.numbers import with_uncertainty
from wentry_cli.report.panel import NotDrawn, Panel, rows
from wentry_cli.report.stretch_curves import draw_stretch, measured_stretch, model_stretch
from wentry_cli.report.style import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    QUOTED,
    QUOTED_MODEL,
    SKY,
    VERMILION,
    Look,
    line_width,
    marker_size,
)  # fmt: skip
from wentry_cli.report.theory import (
    PAPER_PERIOD_EXPERIMENT,
    PAPER_PERIOD_MODEL,
    PERIOD_IN_AIR,
    PERIOD_IN_WATER,
    PERIOD_OF_TABLE_1,
    SLOPE_OF_TABLE_1,
)  # fmt: skip

PERIOD_LINES: dict[int, Look] = {  # of the model's peaks N; blue is for rigid spheres
    2: {"color": VERMILION, "linestyle": "-"},
    3: {"color": GREEN, "linestyle": (0, (5, 1.5))},
    4: {"color": PURPLE, "linestyle": (0, (2, 1.2))},
    5: {"color": ORANGE, "linestyle": (0, (1, 1))},
}
IDENTITY = ["series", "drop", "repeats", "rigid", "g_inf_pa", "diameter_m", "seal_type", "doubts"]


def oscillation_period(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 4b: the free period against D/√(G∞/ρ_s), experiment and model."""
    title = "Oscillation period"
    drops = [drop for drop in campaign.of("water_entry") if drop.deformable_entry]
    found = [{**row, "series": "experiment"} for row in grouped_points(drops, _measured_period)]
    found += [{**row, "series": "model"} for row in grouped_points(drops, _model_period)]
    if not found:
        return NotDrawn("4b", title, "no drop has a measured free period together with a known stiffness")
    points = rows(found, [*IDENTITY, "scale_ms", "period_ms", "period_ms_unc"])
    stop = 1.12 * float(points["scale_ms"].max())
    line = np.array([0.0, stop])
    lines = [fit_rows(f"fit {name}", campaign.relation(f"period_{key}"), line, "scale_ms", "period_ms", 1e3)
             for name, key in (("experiment", "exp"), ("model", "model"))]  # fmt: skip
    quoted = [("paper experiment", PAPER_PERIOD_EXPERIMENT), ("paper model", PAPER_PERIOD_MODEL)]
    bands = [("theory in air", PERIOD_IN_AIR), ("theory in water", PERIOD_IN_WATER)]
    lines += [pd.DataFrame({"series": name, "scale_ms": line, "period_ms": slope * line}) for name, slope in quoted]
    lines += [
        pd.DataFrame({"series": name, "scale_ms": line, "period_ms_low": low * line, "period_ms_high": high * line})
        for name, (low, high) in bands
    ]
    data = pd.concat([points, *lines], ignore_index=True)
    experiment, model = campaign.relation("period_exp"), campaign.relation("period_model")

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        _period_lines(ax, data)
        draw_points(ax, data[data["series"] == "experiment"], "scale_ms", "period_ms")
        for row in data[data["series"] == "model"].to_dict("records"):
            ax.plot(
                row["scale_ms"], row["period_ms"], "^", markersize=0.9 * marker_size(row["diameter_m"]),
                color="none", markeredgecolor=VERMILION, markeredgewidth=0.9, zorder=3,
            )  # fmt: skip
        ax.set(xlabel=r"$D/\sqrt{G_\infty/\rho_s}$ (ms)", ylabel="$T$ (ms)", xlim=(0, stop), ylim=(0, 1.55 * stop))
        uncover(ax)
        legend_above(ax, _period_legend(data))

    caption = (
        f"Free period T, first to second peak of λ. Experiment: {slope_text(experiment)}; model: {slope_text(model)}. "
        f"Dotted: the slope that the paper quotes for its experiments, {PAPER_PERIOD_EXPERIMENT}; dash-dotted: "
        f"{PAPER_PERIOD_MODEL} for its model, whose equation gives {SLOPE_OF_TABLE_1} with the spheres of its Table 1 "
        f"({PERIOD_OF_TABLE_1[0]} to {PERIOD_OF_TABLE_1[1]}, for λ₀ from 1.05 to 2.2). "
        f"Bands, small oscillations: sphere in air {PERIOD_IN_AIR[0]:.2f} (G∞ + G_T, ellipsoid) to "
        f"{PERIOD_IN_AIR[1]:.2f} "
        f"(G∞, exact n = 2 mode); loaded by water {PERIOD_IN_WATER[0]:.2f} (half wetted, ellipsoid; an estimate) to "
        f"{PERIOD_IN_WATER[1]:.2f} (wetted all round, exact).{ON_ANOTHER}{crossed(points)}"
    )
    return Panel("4b", "fig_4b_period", title, caption, data, draw)


def _period_scale_ms(drop: DropResults) -> float:
    stiffness, density = drop.number("g_inf_pa"), drop.number("density_kg_m3")
    return 1e3 * drop.number("diameter_m") * math.sqrt(density / stiffness) if stiffness > 0 else math.nan


def _measured_period(drop: DropResults) -> dict[str, float]:
    period, unc = drop.number("period_s"), drop.number("period_s_unc")
    return {"scale_ms": _period_scale_ms(drop), "period_ms": 1e3 * period, "period_ms_unc": 1e3 * unc}


def _model_period(drop: DropResults) -> dict[str, float]:
    fit = drop.table("model_fit")
    period = as_number(fit["period_model_s"].iloc[0]) if not fit.empty else math.nan
    return {"scale_ms": _period_scale_ms(drop), "period_ms": 1e3 * period}


def _period_lines(ax: Axes, data: pd.DataFrame) -> None:
    for name, color in (("theory in air", VERMILION), ("theory in water", SKY)):
        band = data[data["series"] == name]
        ax.fill_between(
            band["scale_ms"],
            band["period_ms_low"],
            band["period_ms_high"],
            color=color,
            alpha=0.16,
            linewidth=0,
            zorder=0,
        )
    for name, color in (("fit experiment", BLACK), ("fit model", VERMILION)):
        fitted = data[data["series"] == name]
        ax.plot(fitted["scale_ms"], fitted["period_ms"], linewidth=1.0, zorder=2, color=color)
    for name, look in (("paper experiment", QUOTED), ("paper model", QUOTED_MODEL)):
        quoted = data[data["series"] == name]
        ax.plot(quoted["scale_ms"], quoted["period_ms"], zorder=2, **look)


def _period_legend(data: pd.DataFrame) -> list[Line2D | Patch]:
    points = data[data["series"].isin(["experiment", "model"])]
    fitted = {name for name in ("experiment", "model") if bool((data["series"] == f"fit {name}").any())}
    handles: list[Line2D | Patch] = [*point_handles(points)]
    if bool((points["series"] == "model").any()):
        look: Look = {"marker": "^", "markersize": 5, "markeredgecolor": VERMILION, "color": VERMILION, "mfc": "none"}
        with_line: Look = {"linewidth": 1.0} if "model" in fitted else {"linestyle": ""}
        handles.append(Line2D([], [], label="model, fit" if "model" in fitted else "model", **with_line, **look))
    if "experiment" in fitted:
        handles.append(Line2D([], [], color=BLACK, linewidth=1.0, label="fit"))
    handles += [
        Line2D([], [], label=f"paper: {PAPER_PERIOD_EXPERIMENT}", **QUOTED),
        Line2D([], [], label=f"paper's model: {PAPER_PERIOD_MODEL}", **QUOTED_MODEL),
        Patch(facecolor=VERMILION, alpha=0.16, label="theory, in air"),
        Patch(facecolor=SKY, alpha=0.16, label="theory, in water"),
    ]
    return handles


def stretch_peaks(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 4c: λ_pN against G∞/(ρ_w U₀²), coloured by N; lines through the peaks of the model."""
    title = "Peaks of the stretch"
    drops = [drop for drop in campaign.drops if drop.deformable_entry]
    found: list[dict[str, object]] = []
    for period in range(1, 6):
        points = grouped_points(drops, lambda drop, period=period: _measured_peak(drop, period))  # type: ignore[misc]
        found += [{**row, "series": "experiment", "period": period} for row in points]
        if points:  # a prediction that no measurement meets would only crowd the line of 1
            model = grouped_points(drops, lambda drop, period=period: _model_peak(drop, period))  # type: ignore[misc]
            found += [{**row, "series": "model", "period": period} for row in model]
    data = rows(found, [*IDENTITY, "period", "stiffness_ratio", "stretch_peak", "stretch_peak_unc"])
    if data[data["series"] == "experiment"].empty:
        return NotDrawn("4c", title, "no drop has a measured peak of λ together with G∞/(ρ_w U₀²)")

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        ax.set_xscale("log")
        _peak_lines(ax, data[data["series"] == "model"])
        for row in data[data["series"] == "experiment"].to_dict("records"):
            ax.errorbar(
                row["stiffness_ratio"], row["stretch_peak"], yerr=row["stretch_peak_unc"], fmt="o", elinewidth=0.8,
                color=_period_color(row["period"]), markersize=marker_size(row["diameter_m"]), zorder=4, **EDGE,
            )  # fmt: skip
        mark_doubts(ax, data[data["series"] == "experiment"], "stiffness_ratio", "stretch_peak")
        ax.set(xlabel=r"$G_\infty/\rho_w U_0^2$", ylabel=r"$\lambda_{pN}$")
        clear_limits(ax, data["stiffness_ratio"], [1.0, *data["stretch_peak"]])
        ax.axhline(1.0, color=GREY, linewidth=0.6, zorder=0)  # a single point has no limits of its own to draw it in
        plain_decades(ax.xaxis)
        legend_above(ax, _peak_legend(data), handlelength=2.6)

    caption = (
        "Greatest stretch λ_pN of period N, a colour each. Symbols: experiment; lines, of one material each, or dashes "
        "where it has one drop: model, which starts from the measured first peak, so that it predicts from N = 2 on. "
        "Thin lines and small symbols: small spheres; thick and large: large spheres. Bars: standard uncertainty, of "
        f"repeated drops the spread.{crossed(data)}"
    )
    return Panel("4c", "fig_4c_stretch_peaks", title, caption, data, draw)


def _period_color(period: int) -> str:
    """Black for the first peak, which the model starts from; then the colour of the model's line."""
    return str(PERIOD_LINES[period]["color"]) if period in PERIOD_LINES else BLACK


def _measured_peak(drop: DropResults, period: int) -> dict[str, float]:
    found = drop.table("periods")
    found = found[found["period"] == period]
    values = {
        name: as_number(found[name].iloc[0]) if len(found) else math.nan
        for name in ("stretch_peak", "stretch_peak_unc")
    }
    return {"stiffness_ratio": drop.number("stiffness_ratio"), **values}


def _model_peak(drop: DropResults, period: int) -> dict[str, float]:
    """Peak N of the model's stretch: the start, then its local maxima."""
    stretch = measured(drop.table("model"), ["t_s", "stretch"])["stretch"].to_numpy()
    inner = 1 + np.flatnonzero((stretch[1:-1] > stretch[:-2]) & (stretch[1:-1] >= stretch[2:]))
    peaks = np.append(stretch[:1], stretch[inner])
    peak = float(peaks[period - 1]) if period <= len(peaks) else math.nan
    return {"stiffness_ratio": drop.number("stiffness_ratio"), "stretch_peak": peak}


def _peak_lines(ax: Axes, data: pd.DataFrame) -> None:
    """Draw a line through the model's peaks N of each material and size of sphere, a dash where it has one drop."""
    for _, found in data[data["period"] > 1].groupby(["period", "g_inf_pa", "diameter_m"]):
        line = found.sort_values("stiffness_ratio", kind="stable")
        period, size = int(line["period"].iloc[0]), float(line["diameter_m"].iloc[0])
        look = {**PERIOD_LINES[period], "linewidth": 1.2 * line_width(size), "zorder": 3}
        if len(line) == 1:
            look |= {"marker": "_", "markersize": 2.0 * marker_size(size), "markeredgewidth": look["linewidth"]}
        ax.plot(line["stiffness_ratio"], line["stretch_peak"], **look)


def _peak_legend(data: pd.DataFrame) -> list[Line2D]:
    """An entry for each N: its symbol, on the model's line where there is one."""
    lines = set(data.loc[data["series"] == "model", "period"])
    handles = []
    for n in sorted(set(data.loc[data["series"] == "experiment", "period"])):
        line = PERIOD_LINES[n] if n > 1 and n in lines else {"linestyle": "", "color": BLACK}
        look: Look = {**line, "marker": "o", "markersize": 4.5, "markerfacecolor": _period_color(n), **EDGE}
        handles.append(Line2D([], [], linewidth=1.2, label=f"$N$ = {n}", **look))
    if lines - {1}:
        handles.append(Line2D([], [], linewidth=1.2, label="lines: model", **PERIOD_LINES[2]))
    return [*handles, *size_handles(data), *doubt_handles(data)]


def stretch_model(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 4d: λ(t) measured, by the model and by the model with its time scaled."""
    title = "Stretch and model"
    with_model = [drop for drop in campaign.drops if not drop.table("model").empty]
    drop = example_drop(with_model, "stretch")
    if drop is None:
        return NotDrawn("4d", title, "no drop has both a measured stretch and a model of it")
    data = pd.concat([measured_stretch(drop), model_stretch(drop)], ignore_index=True)
    fit = drop.table("model_fit")
    ratio, unc = (
        as_number(fit[name].iloc[0]) if not fit.empty else math.nan for name in ("time_ratio", "time_ratio_unc")
    )
    # Without a ratio there is no scaled curve either.
    scaled = (
        f", and the model with its time scaled by T_exp/T_model = {with_uncertainty(ratio, unc)} (solid)."
        if math.isfinite(ratio)
        else "; the ratio T_exp/T_model by which its time would be scaled is not known."
    )

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        draw_stretch(ax, data)
        ax.set(xlabel="$t$ (ms)", ylabel=r"$\lambda$")
        legend_above(ax)

    caption = (
        f"Stretch of drop {drop.name}{why_shown(with_model, 'stretch', 'λ and a model')}: measured (triangles), the "
        "viscoelastic model from its first peak on "
        f"(dashed){scaled}"
    )
    return Panel("4d", "fig_4d_stretch_model", title, caption, data, draw, drop=drop.name)
