"""Figure 6: the time of pinch-off with the sphere's diameter and with its effective diameter."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.curves import grouped_points
from wentry_cli.report.fits import fit_rows, slope_text
from wentry_cli.report.legends import ON_ANOTHER, crossed, draw_points, legend_above, point_handles, uncover
from wentry_cli.report.panel import NotDrawn, Panel, rows
from wentry_cli.report.style import BLACK, GREEN, QUOTED
from wentry_cli.report.theory import PAPER_PINCH_OFF, PUBLISHED_BETA, published_pinch_off_band, ring_model_pinch_off

COLUMNS = ["series", "drop", "repeats", "rigid", "g_inf_pa", "diameter_m", "seal_type", "doubts"]


def pinch_off_diameter(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 6a: t_p U₀/D against Fr, with lines for rigid spheres."""
    title = "Pinch-off time, undeformed diameter"
    points = _points(campaign, "froude", "tp_u0_over_d")
    if points.empty:
        return NotDrawn("6a", title, "no drop has a time of pinch-off together with an impact speed")
    line = np.linspace(0.0, 1.12 * float(points["froude"].max()), 60)[1:]
    low, high = published_pinch_off_band(line)
    band = {"series": "published prefactors", "froude": line, "tp_u0_over_d_low": low, "tp_u0_over_d_high": high}
    closing = ring_model_pinch_off(line)
    ring = {"series": "ring model", "froude": line, "tp_u0_over_d": closing}
    data = pd.concat([points, pd.DataFrame(band), pd.DataFrame(ring)], ignore_index=True)

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        ax.fill_between(line, low, high, color="#000000", alpha=0.07, linewidth=0, zorder=0)
        ax.plot(line, closing, color=GREEN, linestyle=(0, (5, 2)), linewidth=1.0, zorder=2)
        draw_points(ax, points, "froude", "tp_u0_over_d")
        lines: list[Line2D | Patch] = [
            Line2D([], [], color=GREEN, linestyle=(0, (5, 2)), label="rigid: independent rings"),
            Patch(facecolor="#000000", alpha=0.07, label="rigid: published prefactors"),
        ]
        _finish(ax, points, ("froude", "tp_u0_over_d"), lines)
        ax.set(xlabel=r"$Fr = U_0/\sqrt{gD}$", ylabel="$t_p U_0/D$")

    caption = (
        "Time of pinch-off over D/U₀ against the Froude number. For rigid spheres: a cavity of independent rings, "
        "computed by this program (each ring born at radius D/2 with speed U₀/2, no deceleration, t from first "
        "contact), and the band of published prefactors "
        f"t_p √(g/R) = {PUBLISHED_BETA[0]} to {PUBLISHED_BETA[1]}. Bars: standard uncertainty, of repeated drops the "
        f"spread.{ON_ANOTHER}{crossed(points)}"
    )
    return Panel("6a", "fig_6a_pinch_off_d", title, caption, data, draw)


def pinch_off_effective(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 6b: t_p U₀/D_eff against Fr with D_eff, with the fitted line."""
    title = "Pinch-off time, effective diameter"
    points = _points(campaign, "froude_eff", "tp_u0_over_deff")
    if points.empty:
        return NotDrawn("6b", title, "no drop has a time of pinch-off together with an effective diameter")
    line = np.array([0.0, 1.12 * float(points["froude_eff"].max())])
    fitted = fit_rows("fit", campaign.relation("pinch_off_deff"), line, "froude_eff", "tp_u0_over_deff")
    quoted = pd.DataFrame({"series": "paper", "froude_eff": line, "tp_u0_over_deff": PAPER_PINCH_OFF * line})
    data = pd.concat([points, fitted, quoted], ignore_index=True)

    def draw(figure: FigureBase) -> None:
        ax = figure.subplots()
        ax.plot(line, quoted["tp_u0_over_deff"], zorder=2, **QUOTED)
        lines: list[Line2D | Patch] = [Line2D([], [], label=f"paper: slope {PAPER_PINCH_OFF}", **QUOTED)]
        if not fitted.empty:
            known = bool(fitted["tp_u0_over_deff_low"].notna().all())
            label = "fit and its 95 % interval" if known else "fit"
            ax.fill_between(
                line,
                fitted["tp_u0_over_deff_low"],
                fitted["tp_u0_over_deff_high"],
                color=BLACK,
                alpha=0.12,
                linewidth=0,
            )
            ax.plot(line, fitted["tp_u0_over_deff"], color=BLACK, linewidth=1.0, zorder=2)
            lines.append(Line2D([], [], color=BLACK, linewidth=1.0, label=label))
        draw_points(ax, points, "froude_eff", "tp_u0_over_deff")
        _finish(ax, points, ("froude_eff", "tp_u0_over_deff"), lines)
        ax.set(xlabel=r"$U_0/\sqrt{gD_\mathrm{eff}}$", ylabel=r"$t_p U_0/D_\mathrm{eff}$")

    caption = (
        "The same with D_eff = λ_pN D, N the cavity that closes (rigid: D). Line through the origin: "
        f"{slope_text(campaign.relation('pinch_off_deff'))}; with an intercept: "
        f"{slope_text(campaign.relation('pinch_off_deff_intercept'))}. Dotted: the paper's slope {PAPER_PINCH_OFF}. "
        "Drops "
        f"that seal at the sphere have no D_eff and are not in the fit.{crossed(points)}"
    )
    return Panel("6b", "fig_6b_pinch_off_deff", title, caption, data, draw)


def _points(campaign: Campaign, x: str, y: str) -> pd.DataFrame:
    found = grouped_points(campaign.of("water_entry"), _numbers(x, y))
    return rows([{**row, "series": "experiment"} for row in found], [*COLUMNS, x, f"{x}_unc", y, f"{y}_unc"])


def _numbers(x: str, y: str) -> Callable[[DropResults], dict[str, float]]:
    """Both numbers of a drop with uncertainties carried from t_p, U₀ and D_eff."""

    def numbers(drop: DropResults) -> dict[str, float]:
        speed = drop.number("impact_speed_m_s_unc") / drop.number("impact_speed_m_s")
        time = drop.number("t_p_s_unc") / drop.number("t_p_s")
        sizes = [_size_relative(drop) if "eff" in name else 0.0 for name in (x, y)]
        x_value, y_value = drop.number(x), drop.number(y)
        return {
            x: x_value,
            f"{x}_unc": abs(x_value) * math.hypot(speed, 0.5 * sizes[0]),
            y: y_value,
            f"{y}_unc": abs(y_value) * math.hypot(speed, time, sizes[1]),
        }

    return numbers


def _size_relative(drop: DropResults) -> float:
    """Relative uncertainty of D_eff; 0 where it is not stated."""
    relative = drop.number("diameter_eff_m_unc") / drop.number("diameter_eff_m")
    return relative if math.isfinite(relative) else 0.0


def _finish(ax: Axes, points: pd.DataFrame, names: tuple[str, str], lines: list[Line2D | Patch]) -> None:
    x, y = (float(points[name].max()) for name in names)
    ax.set(xlim=(0, 1.12 * x), ylim=(0, 1.12 * max(y, 1.3 * x)))
    uncover(ax)
    legend_above(ax, [*point_handles(points), *lines])
