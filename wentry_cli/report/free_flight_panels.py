"""A free flight: the path of the centre, the parabola through it, and what is left."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.curves import measured
from wentry_cli.report.flight_motion import flight_acceleration, flight_velocity
from wentry_cli.report.legends import clear_limits, legend_above
from wentry_cli.report.names import file_stem
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.style import BLUE, GREY, VERMILION

TITLE = "Free flight"
SIZE = (7.2, 3.2)
ROOM = 0.06  # kept free at each end of an axis


def free_flights(campaign: Campaign) -> list[Panel | NotDrawn]:
    """x(t) and y(t) with the least-squares line and parabola, and their residuals, one panel for each free flight."""
    return [_flight(drop) for drop in campaign.of("free_flight")]


def _flight(drop: DropResults) -> Panel | NotDrawn:
    title = f"{TITLE}, {drop.name}"
    path = measured(drop.table("kinematics"), ["t_s", "x_c_m", "y_c_m", "y_c_m_unc"])
    if len(path) < 4:
        return NotDrawn("free flight", title, "fewer than four frames have a position of the centre")
    t = path["t_s"].to_numpy()
    weights = 1.0 / np.maximum(path["y_c_m_unc"].to_numpy(), 1e-12)
    x_fit = np.polyval(np.polyfit(t, path["x_c_m"], 1), t)
    y_fit = np.polyval(np.polyfit(t, path["y_c_m"], 2, w=weights), t)
    data = pd.DataFrame(
        {
            "t_ms": 1e3 * t,
            "x_mm": 1e3 * path["x_c_m"], "x_fit_mm": 1e3 * x_fit, "x_residual_um": 1e6 * (path["x_c_m"] - x_fit),
            "y_mm": 1e3 * path["y_c_m"], "y_fit_mm": 1e3 * y_fit, "y_residual_um": 1e6 * (path["y_c_m"] - y_fit),
            "y_unc_um": 1e6 * path["y_c_m_unc"],
        }
    )  # fmt: skip
    caption = (
        f"Centre of the sphere in drop {drop.name}, t = 0 at the first frame; least-squares line and parabola, and the "
        f"residuals, which scatter by {_scatter_um(data, 'x', 2):.1f} µm in x and by {_scatter_um(data, 'y', 3):.1f} "
        "µm in y. Bars: standard uncertainty of the height; the tables have none of x. Velocity in the middle of the "
        f"clip: {flight_velocity(drop).in_words('m/s')}. Acceleration: {flight_acceleration(drop).in_words('m/s²')}. "
        "The uncertainty of the scale is common to all frames."
    )
    stem = f"free_flight_{file_stem(drop.name)}"
    return Panel("free flight", stem, title, caption, data, partial(_draw_flight, data=data), SIZE, drop.name)


def _scatter_um(data: pd.DataFrame, name: str, parameters: int) -> float:
    """Standard deviation of the residuals of a fit with so many parameters."""
    return float(np.sqrt((data[f"{name}_residual_um"] ** 2).sum() / (len(data) - parameters)))


def _draw_flight(figure: FigureBase, data: pd.DataFrame) -> None:
    size = min(3.0, max(1.0, 120.0 / len(data)))  # points; many frames would hide the line that goes through them
    axes = figure.subplots(2, 2, sharex=True, gridspec_kw={"height_ratios": [2.2, 1]})
    for column, name in enumerate("xy"):
        upper, lower = axes[0, column], axes[1, column]
        fitted, label = data[f"{name}_fit_mm"], ("line", "parabola")[column]
        upper.plot(data["t_ms"], fitted, color=VERMILION, linewidth=1.0, label=label, zorder=3)
        upper.plot(data["t_ms"], data[f"{name}_mm"], "o", color=BLUE, markersize=size, label="measured")
        bars = data["y_unc_um"].fillna(0.0) if name == "y" else pd.Series(0.0, index=data.index)
        lower.axhline(0.0, color=GREY, linewidth=0.6)
        lower.errorbar(
            data["t_ms"], data[f"{name}_residual_um"], yerr=bars if name == "y" else None, fmt="o", color=BLUE,
            markersize=0.85 * size, elinewidth=0.25 * size,
        )  # fmt: skip
        ends = [*(data[f"{name}_residual_um"] - bars), *(data[f"{name}_residual_um"] + bars)]
        clear_limits(lower, data["t_ms"], ends, pad=ROOM)
        clear_limits(upper, data["t_ms"], data[f"{name}_mm"], pad=ROOM)
        upper.set_ylabel(f"${name}_c$ (mm)")
        lower.set(xlabel="$t$ (ms)", ylabel="residual (µm)")
        legend_above(upper)
