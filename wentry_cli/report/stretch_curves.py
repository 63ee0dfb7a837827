"""λ(t) as measured and by the model: rows to draw and how they are drawn."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes

from wentry_cli.report.campaign import DropResults, as_number
from wentry_cli.report.curves import measured
from wentry_cli.report.legends import clear_limits
from wentry_cli.report.style import BLACK, GREEN, GREY


def measured_stretch(drop: DropResults) -> pd.DataFrame:
    """Rows of λ(t) as measured: series, t_ms, stretch, stretch_unc."""
    found = measured(drop.table("stretch"), ["t_s", "stretch"])
    unc = drop.table("stretch")[["t_s", "stretch_unc"]].apply(pd.to_numeric, errors="coerce").astype(float)
    found = found.merge(unc.drop_duplicates("t_s"), on="t_s", how="left")
    return pd.DataFrame(
        {
            "series": "measured",
            "t_ms": 1e3 * found["t_s"],
            "stretch": found["stretch"],
            "stretch_unc": found["stretch_unc"],
        }
    )


def model_stretch(drop: DropResults) -> pd.DataFrame:
    """Rows of λ(t) by the model: on its own clock from the first peak on, and with its time scaled where it can be."""
    found = measured(drop.table("model"), ["t_s", "stretch"])
    peaks = drop.table("periods")["t_peak_s"].map(as_number).dropna()
    if found.empty or peaks.empty:
        return pd.DataFrame({"series": [], "t_ms": [], "stretch": []})
    end = 1e3 * float(pd.to_numeric(drop.table("stretch")["t_s"], errors="coerce").max())
    late = 1e3 * (float(peaks.iloc[0]) + found["t_s"])
    own = pd.DataFrame({"series": "model", "t_ms": late, "stretch": found["stretch"]})
    timed = measured(drop.table("model"), ["t_scaled_s", "stretch"])
    scaled = pd.DataFrame(
        {"series": "model, time scaled", "t_ms": 1e3 * timed["t_scaled_s"], "stretch": timed["stretch"]}
    )
    both = pd.concat([own, scaled], ignore_index=True)
    return both[~(both["t_ms"] > end)]


def draw_stretch(ax: Axes, data: pd.DataFrame) -> None:
    """Draw the rows of ``measured_stretch`` and ``model_stretch``: grey triangles, dashed and solid lines.

    The limits follow the values; the error bar of a frame that tells little may leave the axis.
    """
    ax.axhline(1.0, color=GREY, linewidth=0.6, zorder=0)
    shown = data[data["series"] == "measured"]
    ax.errorbar(
        shown["t_ms"], shown["stretch"], yerr=shown["stretch_unc"], fmt="^", markersize=2.8, color="#9A9A9A",
        ecolor="#BBBBBB", elinewidth=0.5, markeredgewidth=0.0, label="measured", zorder=2,
    )  # fmt: skip
    for name, look in (("model", {"linestyle": (0, (4, 2)), "color": GREEN}), ("model, time scaled", {"color": BLACK})):
        line = data[data["series"] == name]
        if not line.empty:
            ax.plot(line["t_ms"], line["stretch"], linewidth=1.0, label=name, zorder=3, **look)
    ax.margins(x=0.03)
    clear_limits(ax, (), [1.0, *data["stretch"]], pad=0.06)
