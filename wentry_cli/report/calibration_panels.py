"""Figure 12b: impacts on a rigid surface, from which the material's parameters come."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import FigureBase

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.curves import measured
from wentry_cli.report.legends import clear_limits, legend_above
from wentry_cli.report.names import file_stem
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.stretch_curves import measured_stretch, model_stretch
from wentry_cli.report.style import GREY, WIDE_SIZE, plain

IMPACT_TITLE = "Impact on a rigid surface"
CALIBRATED = "model, calibrated"
LINES = (CALIBRATED, "model, time scaled")


def surface_impacts(campaign: Campaign) -> list[Panel | NotDrawn]:
    """Panel 12b: λ(t) after impacts on a rigid surface with the model, one for each sphere; shaded by speed."""
    drops = [
        drop for drop in campaign.of("surface_impact") if not measured(drop.table("stretch"), ["t_s", "stretch"]).empty
    ]
    if not drops:
        return [NotDrawn("12b", IMPACT_TITLE, "no drop on a rigid surface has a measured stretch")]
    spheres = sorted({drop.text("sphere_id") or drop.name for drop in drops})
    groups = {name: [drop for drop in drops if (drop.text("sphere_id") or drop.name) == name] for name in spheres}
    return [_impact_panel(name, group, campaign.calibration) for name, group in groups.items()]


def _fitted(drop: DropResults, calibration: pd.DataFrame) -> pd.DataFrame:
    """The line of a drop: the model as calibrated, else from the first peak with its time scaled."""
    own = calibration[calibration["drop"] == drop.name]
    if own.empty:
        return model_stretch(drop)
    return pd.DataFrame({"series": CALIBRATED, "t_ms": 1e3 * own["t_s"], "stretch": own["stretch"]})


def _impact_panel(sphere: str, drops: list[DropResults], calibration: pd.DataFrame) -> Panel:
    ordered = sorted(drops, key=lambda drop: (drop.number("impact_speed_m_s"), drop.name))
    tables = []
    for drop in ordered:
        both = pd.concat([measured_stretch(drop), _fitted(drop, calibration)], ignore_index=True)
        tables.append(both.assign(drop=drop.name, impact_speed_m_s=drop.number("impact_speed_m_s")))
    data = pd.concat(tables, ignore_index=True)
    caption = (
        f"Stretch of sphere {sphere} after impact on a rigid surface: measured (squares, with standard uncertainty) "
        "and the "
        "viscoelastic model (lines). The darker, the faster. "
    )
    shown = set(data["series"])
    if CALIBRATED in shown:
        caption += "The lines are the joint fit of all heights, with λ and its viscous part at the first peak free."
    elif any(name.startswith("model") for name in shown):
        caption += "The lines are the material's, released from the first peak with time scaled; they are not fitted."
    else:
        caption += "No line: the model did not run for these drops."
    stem = f"fig_12b_{file_stem(sphere)}"
    return Panel(
        "12b", stem, f"{IMPACT_TITLE}, sphere {sphere}", caption, data, partial(_draw_impacts, data=data), WIDE_SIZE
    )


def _draw_impacts(figure: FigureBase, data: pd.DataFrame) -> None:
    ax = figure.subplots()
    ax.axhline(1.0, color=GREY, linewidth=0.6, zorder=0)
    groups = list(data.groupby("drop", sort=False))
    shades = [f"{level:.3f}" for level in np.linspace(0.65, 0.0, len(groups))] if len(groups) > 1 else ["0.2"]
    for shade, label, (_, rows) in zip(shades, _labels(groups), groups, strict=True):
        shown = rows[rows["series"] == "measured"]
        ax.errorbar(
            shown["t_ms"], shown["stretch"], yerr=shown["stretch_unc"], fmt="s", markersize=2.8, color=shade,
            elinewidth=0.5, markerfacecolor="none", markeredgewidth=0.7, label=label,
        )  # fmt: skip
        line = rows[rows["series"].isin(LINES)]
        ax.plot(line["t_ms"], line["stretch"], color=shade, linewidth=1.1)
    for name in LINES:
        if bool((data["series"] == name).any()):
            ax.plot([], [], color=shades[-1], linewidth=1.1, label=name)
    ax.set(xlabel="$t$ (ms)", ylabel=r"$\lambda$")
    ax.margins(x=0.02)
    clear_limits(ax, (), [1.0, *data["stretch"]], pad=0.06)
    legend_above(ax, width_in=WIDE_SIZE[0])


def _labels(groups: Sequence[tuple[object, pd.DataFrame]]) -> list[str]:
    """What the legend calls each drop: its impact speed, its name where that is not known, both where two share it."""
    names = [plain(str(name)).lstrip("_") for name, _ in groups]
    speeds = [float(rows["impact_speed_m_s"].iloc[0]) for _, rows in groups]
    told = [f"$U_0$ = {speed:.2f} m/s" if np.isfinite(speed) else "" for speed in speeds]
    return [
        text if text and told.count(text) == 1 else ", ".join(filter(None, (text, name)))
        for text, name in zip(told, names, strict=True)
    ]
