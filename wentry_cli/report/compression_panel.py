"""Figure 11: the force of compressed spheres with the curve that their modulus comes from."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from wentry_cli.mechanics.compression import compression_force
from wentry_cli.report.campaign import Campaign, as_number
from wentry_cli.report.legends import legend_above
from wentry_cli.report.numbers import with_uncertainty
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.style import Look, plain

COMPRESSION_TITLE = "Quasi-static compression"
FINE = 200  # points of a curve


def compression(campaign: Campaign) -> Panel | NotDrawn:
    """Panel 11: force on displacement of every compression test, with the curve whose G∞ was fitted."""
    data = campaign.compression
    if data.empty:
        return NotDrawn("11", COMPRESSION_TITLE, "no compression test was made")
    data = data.fillna({"sphere_id": ""})
    data = data.assign(displacement_over_d=data["displacement_m"] / data["diameter_m"].astype(float))
    fitted = campaign.materials.fillna({"sphere_id": ""}).drop_duplicates(["material", "sphere_id"])
    columns = ["material", "sphere_id", "g_inf_pa", "g_inf_pa_unc"]
    data = data.merge(fitted[columns], on=["material", "sphere_id"], how="left").assign(series="measured")
    curves = [model_curve(rows) for _, rows in data.groupby(["material", "sphere_id"])]
    data = pd.concat([data, *curves], ignore_index=True)
    caption = (
        "Force of a sphere between two plates over its displacement d: measured (squares) and the curve of a "
        "neo-Hookean sphere without friction (lines), with G∞ and the zero of the displacement fitted."
    )
    return Panel("11", "fig_11_compression", COMPRESSION_TITLE, caption, data, partial(_draw_compression, data=data))


def _draw_compression(figure: FigureBase, data: pd.DataFrame) -> None:
    ax = figure.subplots()
    sized = bool(data["displacement_over_d"].notna().all())  # the paper's axis needs the diameters
    for number, (name, rows) in enumerate(data.groupby(["material", "sphere_id"])):
        shown, curve = (
            rows[rows["series"] == series].sort_values("displacement_m") for series in ("measured", "curve")
        )
        color, label = f"C{number % 10}", plain(" ".join(part for part in map(str, name) if part))
        x, fine = (one["displacement_over_d"] if sized else 1e3 * one["displacement_m"] for one in (shown, curve))
        g_inf, unc = (1e-3 * as_number(shown[column].iloc[0]) for column in ("g_inf_pa", "g_inf_pa_unc"))
        told = f", $G_\\infty$ = {with_uncertainty(g_inf, unc)} kPa" if np.isfinite(g_inf) else ""
        squares: Look = {"markersize": 2.8, "markerfacecolor": "none", "alpha": 0.5}  # lighter than the line in them
        ax.plot(x, shown["force_n"], "s", color=color, label=label, **squares)
        ax.plot(fine, curve["force_model_n"], color=color, linewidth=1.1, label=f"neo-Hookean{told}")
    ax.set(xlabel="$d/D$" if sized else "$d$ (mm)", ylabel="force (N)")
    legend_above(ax)


def model_curve(rows: pd.DataFrame) -> pd.DataFrame:
    """The fitted curve of one test on a fine grid, ``rows`` of the panel's table with ``series`` "curve".

    It is the table's own curve, drawn finely between its first and its last point with the zero of the displacement
    that the table holds; without one it is the table's points.
    """
    known = rows.dropna(subset=["displacement_m", "force_model_n"]).sort_values("displacement_m")
    kept = ["material", "sphere_id", "diameter_m", "displacement_m", "displacement_over_d", "force_model_n"]
    coarse = known[kept].assign(series="curve")
    if known.empty:
        return coarse
    size, zero = (as_number(known[name].iloc[0]) for name in ("diameter_m", "zero_m"))
    first, last = (as_number(known["displacement_m"].iloc[at]) for at in (0, -1))
    fine = np.linspace(first, last, FINE)
    force = compression_force((fine - zero) / size)
    if not force[-1] > 0.0:
        return coarse
    scale = as_number(known["force_model_n"].iloc[-1]) / force[-1]
    same = {name: known[name].iloc[0] for name in kept[:3]}
    return pd.DataFrame(
        {**same, "displacement_m": fine, "displacement_over_d": fine / size, "force_model_n": scale * force}
    ).assign(series="curve")
