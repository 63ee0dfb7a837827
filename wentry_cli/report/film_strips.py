"""Film strips with what was measured drawn over them: from the tables, not from the fits themselves."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.patches import Ellipse, Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from wentry_cli.errors import WentryError
from wentry_cli.frames.reader import Recording, Region
from wentry_cli.report.campaign import DropResults, as_number, as_text
from wentry_cli.report.names import file_stem
from wentry_cli.report.numbers import fixed
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.strip_frames import SEPARATION_REACH, Shot, Strip, read_strip
from wentry_cli.report.style import (
    OVERLAY_BOTTOM,
    OVERLAY_CIRCLE,
    OVERLAY_ELLIPSE,
    OVERLAY_SEPARATION,
    WIDE_SIZE,
    plain,
)  # fmt: skip

OpenView = Callable[[str, str], Recording]
WIDTH_IN = WIDE_SIZE[0]
TITLE_IN = 0.4  # inches above the pictures, three lines
EDGE_PT = 0.6  # points, round the scale bar
TEXT_PT = 8.0  # points that its length takes above it
TEXT_ASPECT = 2.6  # and how much wider that is than high
UNLIKE = 48.0  # levels of 255 from those at the rim of a picture: no ground
SIDE_COLUMNS = ["center_x_px", "center_y_px", "radius_px", "stretch", "tilt_deg", "bottom_y_px", "bottom_local_y_px",
                "separation_y_px", "status"]  # fmt: skip
TOP_COLUMNS = ["center_x_px", "center_y_px", "radius_px", "status"]


def film_strips(drop: DropResults, open_view: OpenView) -> list[Panel | NotDrawn]:
    """A strip for each view of a drop that was tracked; ``open_view(drop, view)`` gives the recording."""
    return [_strip(drop, view, open_view) for view in ("side", "top") if not drop.table(view).empty]


def _strip(drop: DropResults, view: str, open_view: OpenView) -> Panel | NotDrawn:
    title = f"{drop.name}, {view} view"
    try:
        recording = open_view(drop.name, view)
    except (WentryError, OSError, KeyError):
        return NotDrawn("film strip", title, "the recording cannot be opened any more (moved or deleted)")
    try:
        strip = read_strip(drop, view, recording)
    except (WentryError, OSError):
        return NotDrawn("film strip", title, "the recording cannot be read any more")
    finally:
        recording.close()
    if not strip.shots:
        return NotDrawn("film strip", title, "no frame of a telling moment can be read")
    return _panel(drop, view, strip)


def _panel(drop: DropResults, view: str, strip: Strip) -> Panel:
    shots, region = strip.shots, strip.region
    columns = SIDE_COLUMNS if view == "side" else TOP_COLUMNS
    records = [
        {"view": view, "frame": shot.row["frame"], "t_s": as_number(shot.row["t_s"]), "label": shot.moment.label}
        | {name: shot.row.get(name) for name in columns}
        for shot in shots
    ]
    data = pd.DataFrame.from_records(records)
    height = 0.95 * WIDTH_IN / len(shots) * (region[3] - region[1]) / (region[2] - region[0]) + TITLE_IN
    scale = pixels_per_metre(drop, view)
    surface = _surface_row(drop, view)
    draw = partial(_draw_strip, shots=shots, region=region, view=view, scale=scale, surface=surface)
    what = "circle cyan" if view == "top" else "ellipse yellow, lowest point red cross"
    if math.isfinite(surface):
        what = what.replace("yellow", "yellow (after impact below the surface, through which it is seen)")
    if data.get("separation_y_px", pd.Series(dtype=float)).notna().any():
        what += ", separation line green"
    caption = f"Film strip of drop {drop.name}, {view} view, with the measurement drawn from {view}.csv: {what}."
    bar = scale_bar_mm(region, scale)
    caption += (
        f" Scale bar {bar:g} mm"
        + (" (scale through the water)." if view == "side" and drop.kind == "water_entry" else ".")
        if bar
        else ""
    )
    caption += f" Grey levels {strip.black:.0f} to {strip.white:.0f} of the recording are drawn from black to white."
    if drop.track_failure:
        caption += f" The drop could not be tracked ({drop.track_failure}): what is drawn is no measurement."
    stem = f"strip_{view}_{file_stem(drop.name)}"
    return Panel("film strip", stem, f"{drop.name}, {view} view", caption, data, draw, (WIDTH_IN, height), drop.name)


def pixels_per_metre(drop: DropResults, view: str) -> float:
    """Scale of a view: through the water for the side of a water entry, else in air; NaN where unknown."""
    rows = drop.table("geometry")
    rows = rows[rows["view"] == view]
    if rows.empty:
        return math.nan
    water, air = (as_number(rows[name].iloc[0]) for name in ("scale_water_px_per_m", "scale_px_per_m"))
    wet = view == "side" and drop.kind == "water_entry" and math.isfinite(water)
    return water if wet else air


def _surface_row(drop: DropResults, view: str) -> float:
    """Row of the free surface in the side view of a water entry; NaN elsewhere."""
    rows = drop.table("geometry")
    rows = rows[rows["view"] == view]
    wet = view == "side" and drop.kind == "water_entry" and not rows.empty
    return as_number(rows["surface_y_px"].iloc[0]) if wet else math.nan


def scale_bar_mm(region: Region, scale: float) -> float:
    """A round length of about a third of the image's width; 0 where the scale is unknown."""
    if not (math.isfinite(scale) and scale > 0):
        return 0.0
    third = 1e3 * (region[2] - region[0]) / scale / 3.0
    power = 10.0 ** math.floor(math.log10(third))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= third)


def _draw_strip(figure: FigureBase, shots: list[Shot], region: Region, view: str, scale: float, surface: float) -> None:
    axes = figure.subplots(1, len(shots), squeeze=False, gridspec_kw={"wspace": 0.03})[0]
    x0, y0, x1, y1 = region
    span = as_number(shots[-1].row["t_s"]) - as_number(shots[0].row["t_s"])
    places = 1 if span > 0.008 else 3
    for ax, shot in zip(axes, shots, strict=True):
        box = (x0 - 0.5, x1 - 0.5, y1 - 0.5, y0 - 0.5)
        ax.imshow(shot.picture, cmap="gray", vmin=0, vmax=255, extent=box, interpolation="none")
        status = as_text(shot.row.get("status"))
        if status == "ok":
            if view == "side":
                _overlay_side(ax, shot.row, surface if as_number(shot.row["t_s"]) > 0.0 else math.nan)
            else:
                _overlay_top(ax, shot.row)
        ax.set(xlim=box[:2], ylim=box[2:])
        ax.set(xticks=[], yticks=[])
        ax.spines[:].set(color="#888888", linewidth=0.4)
        title = f"{fixed(1e3 * as_number(shot.row['t_s']), places)} ms\n{plain(shot.moment.label)}"
        title += "" if status == "ok" else f"\n({plain(status.replace('_', ' '))})"
        ax.set_title(title, fontsize=6.0, fontweight="normal", loc="center", pad=2.0, linespacing=1.1)
    _scale_bar(axes[-1], shots[-1].picture, region, scale)


def _overlay_side(ax: Axes, row: dict[str, Any], surface: float) -> None:
    """Draw the measurement; below a ``surface`` only, where one is given: above it the sphere is seen through air."""
    x, y, radius = (as_number(row[name]) for name in ("center_x_px", "center_y_px", "radius_px"))
    stretch, tilt = as_number(row["stretch"]), as_number(row["tilt_deg"])
    stretch = stretch if math.isfinite(stretch) else 1.0
    if math.isfinite(x + y + radius):
        # Rows run downwards and a positive tilt moves the lower pole to the right.
        angle = -tilt if math.isfinite(tilt) else 0.0
        outline = Ellipse((x, y), 2 * stretch * radius, 2 * radius / stretch**2, angle=angle, fill=False)
        outline.set(edgecolor=OVERLAY_ELLIPSE, linewidth=0.9)
        ax.add_patch(outline)
        if math.isfinite(surface):
            below = Rectangle((x - 4 * radius, surface), 8 * radius, 1e5, transform=ax.transData)
            outline.set_clip_path(below)
    separation = as_number(row["separation_y_px"])
    if math.isfinite(separation + x + radius):
        reach = SEPARATION_REACH * stretch * radius
        ax.plot([x - reach, x + reach], [separation, separation], color=OVERLAY_SEPARATION, linewidth=0.9)
    bottom = as_number(row["bottom_local_y_px"])
    bottom = bottom if math.isfinite(bottom) else as_number(row["bottom_y_px"])
    if math.isfinite(bottom + x):
        ax.plot(x, bottom, "+", color=OVERLAY_BOTTOM, markersize=5.5, markeredgewidth=1.1)


def _overlay_top(ax: Axes, row: dict[str, Any]) -> None:
    x, y, radius = (as_number(row[name]) for name in ("center_x_px", "center_y_px", "radius_px"))
    if math.isfinite(x + y + radius):
        circle = Ellipse((x, y), 2 * radius, 2 * radius, fill=False)
        circle.set(edgecolor=OVERLAY_CIRCLE, linewidth=0.9)
        ax.add_patch(circle)


def _scale_bar(ax: Axes, picture: NDArray[np.uint8], region: Region, scale: float) -> None:
    """Draw the bar in the corner with the most ground: black where that is bright, white where it is dark.

    An edge of the other colour shows bar and length where the ground below them changes.
    """
    length = scale_bar_mm(region, scale)
    if not length:
        return
    x0, _, x1, _ = region
    width, thick = 1e-3 * length * scale, 0.025 * (x1 - x0)
    figure = ax.get_figure(root=True)
    assert figure is not None
    text = TEXT_PT * (x1 - x0) / (72.0 * figure.get_figwidth() * ax.get_position().width)
    left, top, bright = _place_of_bar(picture, region, (width, thick, text))
    inner, outer = ("black", "white") if bright else ("white", "black")
    ax.add_patch(Rectangle((left, top), width, thick, facecolor=outer, edgecolor=outer, linewidth=2 * EDGE_PT))
    ax.add_patch(Rectangle((left, top), width, thick, facecolor=inner, linewidth=0))
    at, side = (left + width, "right") if left > 0.5 * (x0 + x1 - width) else (left, "left")
    label = ax.annotate(
        f"{length:g} mm", (at, top), (0.0, 1.2), textcoords="offset points", ha=side, va="bottom", fontsize=5.5,
        color=inner,
    )  # fmt: skip
    label.set_path_effects([withStroke(linewidth=2 * EDGE_PT, foreground=outer)])


def _place_of_bar(
    picture: NDArray[np.uint8], region: Region, size: tuple[float, float, float]
) -> tuple[float, float, bool]:
    """Left and top of the bar in the corner with the most ground, px, and whether that is bright.

    ``size`` is its width, its thickness and the height of the text above it, px; ground is as the rim of the picture.
    """
    x0, y0, x1, y1 = region
    width, thick, text = size
    room, shrink = 0.06 * (x1 - x0), picture.shape[1] / (x1 - x0)
    reach = max(width, TEXT_ASPECT * text)
    rim = np.median(np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]]))
    found: list[tuple[float, float, float, bool]] = []
    for top in (y1 - room - thick, y0 + room + text):
        for left, start in ((x1 - room - width, x1 - room - reach), (x0 + room, x0 + room)):
            edges = np.array([start - x0, start + reach - x0, top - text - y0, top + thick - y0]) * shrink
            first, last, upper, lower = np.maximum(edges, 0.0).astype(int)
            below = picture[upper : lower + 1, first : last + 1]
            busy = float((np.abs(below - rim) > UNLIKE).mean())
            found.append((busy, left, top, bool(below.mean() > 127.0)))
    return min(found, key=lambda place: place[0])[1:]
