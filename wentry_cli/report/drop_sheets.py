"""One sheet for each drop: position, stretch, velocity and acceleration, as far as they were measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from wentry_cli.report.campaign import Campaign, DropResults, as_number
from wentry_cli.report.curves import measured
from wentry_cli.report.legends import legend_above
from wentry_cli.report.names import file_stem
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.stretch_curves import draw_stretch, measured_stretch, model_stretch
from wentry_cli.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, WIDE_SIZE, Look
from wentry_cli.report.velocity_panels import with_gaps

Drawer = Callable[[Axes, pd.DataFrame, float], None]
POSITIONS = {"lowest point": BLUE, "separation line": GREEN, "centre of mass": BLACK}
OUTERMOST = 0.005  # share of the values at either end that does not set an axis
ROW_IN = 2.4  # inches; two sheets of two rows fill a page of the PDF


def drop_sheets(campaign: Campaign) -> list[Panel | NotDrawn]:
    """A sheet for each drop that has anything measured in time."""
    return [_sheet(drop) for drop in campaign.drops if drop.kind != "free_flight"]


def _sheet(drop: DropResults) -> Panel | NotDrawn:
    title = f"Drop {drop.name}"
    if drop.track_failure:
        return NotDrawn("sheet", title, f"it could not be tracked: {drop.track_failure}")
    parts: dict[str, tuple[pd.DataFrame, Drawer]] = {
        "position": (_positions(drop), _draw_positions),
        "stretch": (pd.concat([measured_stretch(drop), model_stretch(drop)], ignore_index=True), _draw_stretch),
        "velocity": (_motion(drop, "v_c_m_s"), partial(_draw_motion, label="$\\dot{y}_c$ (m/s)")),
        "acceleration": (
            _motion(drop, "a_c_m_s2"),
            partial(_draw_motion, label="$\\ddot{y}_c$ (m/s$^2$)"),
        ),
    }
    parts = {name: part for name, part in parts.items() if not part[0].empty}
    if not parts:
        return NotDrawn("sheet", title, "nothing was measured in time")
    data = pd.concat([table.assign(part=name) for name, (table, _) in parts.items()], ignore_index=True)
    moments = [drop.number("t_p_s")] if math.isfinite(drop.number("t_p_s")) else []
    drawers = {name: drawer for name, (_, drawer) in parts.items()}
    caption = _caption(drop, {name: set(table["series"]) for name, (table, _) in parts.items()}, bool(moments))
    cut = [name for name in ("velocity", "acceleration") if name in parts and _leaves_axis(parts[name][0])]
    if cut:
        caption += f" Single values of {' and '.join(cut)} lie beyond the axis."
    draw = partial(_draw_sheet, data=data, drawers=drawers, moments=[1e3 * t for t in moments])
    size = (WIDE_SIZE[0], ROW_IN * math.ceil(len(parts) / _columns(len(parts))))
    return Panel("sheet", f"drop_{file_stem(drop.name)}", title, caption, data, draw, size, drop.name)


def _caption(drop: DropResults, shown: dict[str, set[str]], pinch_off: bool) -> str:
    """Say what each part shows (``shown``: its series), and no more."""
    modelled = any(name.startswith("model") for name in shown.get("stretch", ()))
    heights = [f"the {name}" for name in POSITIONS if name in shown.get("position", ())]
    words = {
        "position": "height of "
        + ", ".join(heights[:-1])
        + (" and " if len(heights) > 1 else "")
        + "".join(heights[-1:]),
        "stretch": "stretch, measured and by the model" if modelled else "stretch as measured",
        "velocity": "velocity of the centre of mass",
        "acceleration": "its acceleration",
    }
    told = "; ".join(words[name] for name in shown)
    caption = told[0].upper() + told[1:] + "."
    if modelled and drop.kind == "surface_impact":
        caption += (
            " The model is released at the first peak with λ_p = 1 there, though the sphere has flowed before, so that "
            "its later peaks come out too high; wentry calibrate impact leaves λ_p at the peak free."
        )
    if "velocity" in shown:
        caption += " Bands: standard uncertainty, no curve where it exceeds the axis."
    if modelled and not _is_scaled(drop):
        caption += " The time of the model is not scaled: T_exp/T_model is not known."
    elif not drop.table("kinematics_model").empty:
        caption += " Black: from the measured stretch; orange: the paper's route, from the time-scaled model."
    return caption + (" Dotted: pinch-off." if pinch_off else "")


def _draw_sheet(figure: FigureBase, data: pd.DataFrame, drawers: dict[str, Drawer], moments: list[float]) -> None:
    columns = _columns(len(drawers))
    axes = figure.subplots(math.ceil(len(drawers) / columns), columns, squeeze=False).ravel()
    width_in = WIDE_SIZE[0] / columns
    for ax, (name, drawer) in zip(axes, drawers.items(), strict=False):
        drawer(ax, data[data["part"] == name], width_in)
        for moment in moments:
            ax.axvline(moment, color=GREY, linewidth=0.8, linestyle=(0, (1, 1.6)), zorder=0)
        ax.set_xlabel("$t$ (ms)")
        ax.margins(x=0.02)
    for ax in axes[len(drawers) :]:
        ax.set_axis_off()


def _columns(parts: int) -> int:
    return parts if parts < 4 else 2


def _positions(drop: DropResults) -> pd.DataFrame:
    tables = []
    for series, table, column in (
        ("lowest point", "side", "y_b_m"),
        ("separation line", "side", "separation_y_m"),
        ("centre of mass", "kinematics", "y_c_m"),
    ):  # fmt: skip
        found = measured(drop.table(table), ["t_s", column])
        tables.append(pd.DataFrame({"t_ms": 1e3 * found["t_s"], "y_mm": 1e3 * found[column], "series": series}))
    return pd.concat([table for table in tables if not table.empty] or tables[:1], ignore_index=True)


def _draw_positions(ax: Axes, data: pd.DataFrame, width_in: float) -> None:
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    for name, color in POSITIONS.items():
        shown = data[data["series"] == name]
        if not shown.empty:
            # the separation line runs along the centre of mass and lies over it
            above: Look = {"markersize": 1.2, "zorder": 3} if name == "separation line" else {"markersize": 2.8}
            ax.plot(shown["t_ms"], shown["y_mm"], ".", color=color, label=name, **above)
    ax.set_ylabel("$y$ (mm)")
    handles = [Line2D([], [], marker="o", linestyle="", markersize=3.5, color=POSITIONS[name], label=name)
               for name in POSITIONS if bool((data["series"] == name).any())]  # fmt: skip
    legend_above(ax, handles, width_in, handlelength=0.8)


def _draw_stretch(ax: Axes, data: pd.DataFrame, width_in: float) -> None:
    draw_stretch(ax, data)
    ax.set_ylabel(r"$\lambda$")
    legend_above(ax, width_in=width_in)


def _is_scaled(drop: DropResults) -> bool:
    """Whether the time of the model could be scaled: without a ratio its motion is not that of a model anywhere."""
    return bool(drop.table("model_fit")["time_ratio"].map(as_number).notna().any())


def _motion(drop: DropResults, column: str) -> pd.DataFrame:
    tables = []
    sources = {"measured stretch": "kinematics"} | ({"model stretch": "kinematics_model"} if _is_scaled(drop) else {})
    for series, name in sources.items():
        found = measured(drop.table(name), ["t_s", column, f"{column}_unc"])
        table = pd.DataFrame({"t_ms": 1e3 * found["t_s"], "value": found[column], "value_unc": found[f"{column}_unc"]})
        tables.append(table.assign(series=series))
    return pd.concat([table for table in tables if not table.empty] or tables[:1], ignore_index=True)


def _span(data: pd.DataFrame) -> tuple[float, float, float]:
    """What an axis of velocity or acceleration must hold: all but the outermost values, and the room beside them."""
    values = data["value"].astype(float)
    low, high = float(values.quantile(OUTERMOST)), float(values.quantile(1.0 - OUTERMOST))
    return low, high, 0.15 * (high - low) or 1.0


def _leaves_axis(data: pd.DataFrame) -> bool:
    low, high, room = _span(data)
    return not data["value"].dropna().between(low - room, high + room).all()


def _draw_motion(ax: Axes, data: pd.DataFrame, width_in: float, label: str) -> None:
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    low, high, room = _span(data)
    for name, color in (("model stretch", ORANGE), ("measured stretch", BLACK)):
        line = with_gaps(data.loc[data["series"] == name, ["t_ms", "value", "value_unc"]], high - low + 2.0 * room)
        if line.empty:
            continue
        t, value, unc = line["t_ms"], line["value"], line["value_unc"]
        ax.fill_between(t, value - unc, value + unc, color=color, alpha=0.22, linewidth=0)
        ax.plot(t, value, color=color, linewidth=1.0, label=name)
    ax.set(ylabel=label, ylim=(low - room, high + room))
    if len(set(data["series"])) > 1:
        legend_above(ax, width_in=width_in)
