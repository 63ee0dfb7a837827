"""A free flight: the path of the centre, the parabola through it, and what is left."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.curves import measured
from wentry_cli.report.flight_motion import flight_acceleration, flight_velocity
from wentry_cli.report.legends import legend_above
from wentry_cli.report.names import file_stem
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.style import BLUE, GREY, VERMILION

TITLE = "Free flight"
SIZE = (7.2, 3.2)


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
        "residuals with the standard uncertainty of the height. Velocity in the middle of the clip: "
        f"{flight_velocity(drop).in_words('m/s')}. Acceleration: {flight_acceleration(drop).in_words('m/s²')}. The "
        "uncertainty of the scale is common to all frames."
    )
    stem = f"free_flight_{file_stem(drop.name)}"
    return Panel("free flight", stem, title, caption, data, partial(_draw_flight, data=data), SIZE, drop.name)


def _draw_flight(figure: FigureBase, data: pd.DataFrame) -> None:
    axes = figure.subplots(2, 2, sharex=True, gridspec_kw={"height_ratios": [2.2, 1]})
    for column, name in enumerate("xy"):
        upper, lower = axes[0, column], axes[1, column]
        upper.plot(
            data["t_ms"], data[f"{name}_fit_mm"], color=VERMILION, linewidth=1.0, label=("line", "parabola")[column]
        )
        upper.plot(data["t_ms"], data[f"{name}_mm"], "o", color=BLUE, markersize=3.0, label="measured")
        bars = data["y_unc_um"] if name == "y" else None
        lower.axhline(0.0, color=GREY, linewidth=0.6)
        lower.errorbar(
            data["t_ms"], data[f"{name}_residual_um"], yerr=bars, fmt="o", color=BLUE, markersize=2.6, elinewidth=0.7
        )
        upper.set_ylabel(f"${name}_c$ (mm)")
        lower.set(xlabel="$t$ (ms)", ylabel="residual (µm)")
        legend_above(upper)
