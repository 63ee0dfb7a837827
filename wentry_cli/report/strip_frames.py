"""The frames of a film strip: which ones, which part of them, small and with one grey scale."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.reader import Recording, Region
from wentry_cli.report.campaign import DropResults, as_number
from wentry_cli.report.moments import Moment, telling_moments, times_of, with_picture

WIDEST_PX = 200  # of one image of a strip
SEPARATION_REACH = 1.25  # half length of the separation line over the sphere's horizontal semi-axis
MARGIN = 0.12  # of the radius, kept free around an outline
GREYS = 48  # levels kept: enough to look at, half the size in the file


@dataclass(frozen=True)
class Shot:
    """One frame of a strip: its picture (8 bit, smaller than the recording) and its row of the table."""

    picture: NDArray[np.uint8]
    row: dict[str, Any]
    moment: Moment


@dataclass(frozen=True)
class Strip:
    """The frames of a strip, the region of the recording that they show (px) and its levels drawn black and white."""

    shots: list[Shot]
    region: Region
    black: float
    white: float


def read_strip(drop: DropResults, view: str, recording: Recording) -> Strip:
    """Read the telling frames of ``view``, cut to the region where things happen."""
    chosen = _chosen_rows(drop.table(view), telling_moments(drop))
    region = _region(drop, view, recording, [row for _, row in chosen])
    found: list[tuple[NDArray[Any], dict[str, Any], Moment]] = []
    for moment, row in chosen:
        try:
            found.append((_small(recording.read(int(row["frame"]), region)), row, moment))
        except (FrameUnreadableError, IndexError):
            continue
    if not found:
        return Strip([], region, math.nan, math.nan)
    levels = np.concatenate([picture.ravel()[::7] for picture, _, _ in found])
    black, white = (float(value) for value in np.percentile(levels, (0.2, 99.5)))
    return Strip([Shot(_greys(picture, black, white), row, moment) for picture, row, moment in found],
                 region, black, white)  # fmt: skip


def _chosen_rows(table: pd.DataFrame, moments: list[Moment]) -> list[tuple[Moment, dict[str, Any]]]:
    """The row of the frame at each moment, whatever its status; none where the view has no frame at that time."""
    shown = with_picture(table)
    times, rows = times_of(shown), shown.to_dict("records")
    if times.size < 2:
        return []
    step = float(np.median(np.diff(times)))
    chosen: dict[int, tuple[Moment, dict[str, Any]]] = {}
    for moment in moments:
        away = np.abs(times - moment.t_s)
        nearest = int(np.argmin(away))
        if away[nearest] <= step and nearest not in chosen:
            chosen[nearest] = (moment, {str(key): value for key, value in rows[nearest].items()})
    return [chosen[place] for place in sorted(chosen)]


def _region(drop: DropResults, view: str, recording: Recording, shown: list[dict[str, Any]]) -> Region:
    """Where the sphere goes, with room for its cavity, its splash and what is drawn over the rows ``shown``."""
    info = recording.info
    table = drop.table(view)
    x, y = (table[name].map(as_number).dropna().to_numpy(dtype=float) for name in ("center_x_px", "center_y_px"))
    radius = float(table["radius_px"].map(as_number).median()) if len(table) else math.nan
    if x.size == 0 or not math.isfinite(radius):
        return (0, 0, info.width, info.height)
    room = {"free_flight": 1.6, "surface_impact": 2.2}.get(drop.kind, 2.4)
    left, right = np.median(x) - room * radius, np.median(x) + room * radius
    left, right = min(left, x.min() - 1.3 * radius), max(right, x.max() + 1.3 * radius)
    top, bottom = y.min() - 1.5 * radius, y.max() + 1.6 * radius
    surface = _surface(drop, view)
    if view == "side" and drop.kind == "water_entry" and math.isfinite(surface):
        top, bottom = min(top, surface - 2.6 * radius), _deepest(drop, table, radius, bottom)
    boxes = np.array([_drawn_box(row, view) for row in shown] + [(left, top, right, bottom)])
    (left, top), (right, bottom) = np.nanmin(boxes[:, :2], axis=0), np.nanmax(boxes[:, 2:], axis=0)
    edges = (max(left, 0), max(top, 0), min(right, info.width), min(bottom, info.height))
    x0, y0, x1, y1 = (round(float(edge)) for edge in edges)
    return (x0, y0, x1, y1) if x1 - x0 > 4 and y1 - y0 > 4 else (0, 0, info.width, info.height)


def _drawn_box(row: dict[str, Any], view: str) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of the outline drawn over a row, with a little room, px; NaN where there is none."""
    x, y, radius = (as_number(row[name]) for name in ("center_x_px", "center_y_px", "radius_px"))
    wide = tall = radius
    if view == "side":
        stretch, tilt = as_number(row.get("stretch")), math.radians(as_number(row.get("tilt_deg")))
        across = radius * (stretch if math.isfinite(stretch) else 1.0)
        along = radius**3 / across**2
        turn = tilt if math.isfinite(tilt) else 0.0
        wide = math.hypot(across * math.cos(turn), along * math.sin(turn))
        tall = math.hypot(across * math.sin(turn), along * math.cos(turn))
        if math.isfinite(as_number(row.get("separation_y_px"))):
            wide = SEPARATION_REACH * across
    wide, tall = wide + MARGIN * radius, tall + MARGIN * radius
    return x - wide, y - tall, x + wide, y + tall


def _deepest(drop: DropResults, table: pd.DataFrame, radius: float, otherwise: float) -> float:
    t_p = drop.number("t_p_s")
    seen = table[table["t_s"].map(as_number) <= 1.2 * t_p] if math.isfinite(t_p) else table
    deepest = seen["center_y_px"].map(as_number).max()
    return float(deepest) + 1.6 * radius if math.isfinite(deepest) else otherwise


def _surface(drop: DropResults, view: str) -> float:
    geometry = drop.table("geometry")
    rows = geometry[geometry["view"] == view]
    return as_number(rows["surface_y_px"].iloc[0]) if len(rows) else math.nan


def _small(picture: NDArray[Any]) -> NDArray[Any]:
    shrink = WIDEST_PX / picture.shape[1]
    if shrink >= 1.0:
        return picture
    size = (WIDEST_PX, max(round(picture.shape[0] * shrink), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))


def _greys(picture: NDArray[Any], black: float, white: float) -> NDArray[np.uint8]:
    part = np.clip((picture.astype(np.float32) - black) / max(white - black, 1e-6), 0.0, 1.0)
    level = np.round(part * (GREYS - 1)) * (255.0 / (GREYS - 1))
    return np.asarray(np.round(level), dtype=np.uint8)
