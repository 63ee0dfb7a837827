"""Dome-over: when the splash crown closes, from the top view where there is one, and how high its rim is then."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.crown import Rim, find_rim
from wentry_cli.cavity.dome_over import STEADY, DomeOver, disc_level, find_dome_over, find_rim_closure
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background
from wentry_cli.stages.cavity.view import SideView
from wentry_cli.stages.inputs.clip import Clip, open_clip
from wentry_cli.tables import has_table, read_table
from wentry_cli.tracking.source import read_patch

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

Floats = NDArray[np.float64]

DOME_DISC = 0.5  # of the undeformed radius: within the sphere when it is slender
DOME_FRAMES = 600
CROWN_REACH, CROWN_FOOT_PX = 4.0, 6.0  # radii about the axis and above the surface; clear of the surface band
COARSE, NARROW = 4, 0.6  # frames from one coarse look to the next; of the greatest width: it may have closed between
# Radii by which a crown rises from one coarse look to the next; where it rises more, one looks again.
RISE, LEAST_RISE_PX = 0.6, 16.0
RIM_FRAMES = 6  # on either side of the closure, from which its height is taken
FEWEST_RIMS = 4
ABOUT_LEAST = 1.15  # a width that may be the least


@dataclass(frozen=True)
class Dome:
    """When the crown has closed, in which view that was seen, and the row of its rim then; NaN unless status is ok.

    ``y_unc_px`` is the standard uncertainty of that row, which moves while the time is not known.
    """

    over: DomeOver
    view: str
    y_px: float
    y_unc_px: float
    status: str


def find_dome(folder: Path, drop: Drop, clip: Clip, ground: Background, view: SideView) -> Dome:
    """Find the dome-over of a drop; ``clip`` and ``ground`` are those of the side view.

    The time is from the top view where the drop was filmed from there, else from the rim in the side view; the height
    is always from the side view.
    """
    below = [k for k, item in enumerate(view.spheres) if item and item.top_y_px > view.pixels.surface_y_px + 2.0]
    if has_table(folder, "top"):
        over, name, ended = _from_above(folder, drop), "top", True
        rims = _rims(clip, ground, view, _about(over.t_s, view.t_s, below))
    else:
        rims = _rims(clip, ground, view, below[:DOME_FRAMES:COARSE])
        rims |= _rims(clip, ground, view, _while_closing(rims, below[:DOME_FRAMES]))
        width = _widths(rims, view.t_s.size)
        over, name, ended = find_rim_closure(view.t_s, width), "side", _narrows_to_the_end(width, clip.count)
    if over.status == "clip_ended" and not ended:
        over = replace(over, status="not_identified")  # it stays wide for as long as a crown stands
    if over.status != "ok":
        return Dome(over, name, math.nan, math.nan, over.status)
    near = [(k, rims[k]) for k in _about(over.t_s, view.t_s, below) if k in rims]
    return Dome(over, name, *_height(near, view.t_s, (over.t_s, over.t_unc_s)))


def _widths(rims: dict[int, Rim], count: int) -> Floats:
    return np.array([rims[k].width_px if k in rims else np.nan for k in range(count)])


def _narrows_to_the_end(width: Floats, count: int) -> bool:
    """Whether the crown was seen up to the end of a clip of ``count`` frames, and was no narrower before."""
    seen = np.flatnonzero(np.isfinite(width))
    if seen.size == 0 or seen[-1] < count - 1 - COARSE:
        return False
    return bool(width[seen[-1]] <= ABOUT_LEAST * np.nanmin(width[int(np.nanargmax(width)) :]))


def _while_closing(rims: dict[int, Rim], frames: list[int]) -> list[int]:
    """Those of ``frames`` not looked at yet in which the crown closes, if it may, by the rims of every few."""
    width = _widths(rims, max(frames, default=-1) + 1)
    seen = np.flatnonzero(np.isfinite(width))
    if seen.size == 0:
        return []
    widest = int(np.nanargmax(width))
    later = seen[seen >= widest]
    least = width[later].min()
    if least > NARROW * width[widest]:
        return []
    closed = int(later[width[later] <= ABOUT_LEAST * least][0])
    return [k for k in frames if widest - COARSE < k < closed + 2 * COARSE + STEADY and k not in rims]


def _about(t_s: float, times_s: Floats, frames: list[int]) -> list[int]:
    """Those of ``frames`` that lie about the time ``t_s``."""
    if not frames or not np.isfinite(t_s):
        return []
    half = (RIM_FRAMES + 0.5) * float(np.nanmedian(np.diff(times_s)))
    return [k for k in frames if abs(times_s[k] - t_s) <= half]


def _rims(clip: Clip, ground: Background, view: SideView, frames: Iterable[int]) -> dict[int, Rim]:
    """The rim of the crown in frames of the side view; without those that cannot be read.

    No more rows are read above the crown of the frame before than it may have risen by.
    """
    found: dict[int, Rim] = {}
    reach, foot = CROWN_REACH * view.radius_px, view.pixels.surface_y_px - CROWN_FOOT_PX
    rise, top = max(RISE * view.radius_px, LEAST_RISE_PX), 0.0
    for frame in frames:
        sphere = view.spheres[frame]
        assert sphere is not None
        patch = read_patch(clip, frame, ground, (sphere.x_px - reach, top, sphere.x_px + reach, foot))
        if isinstance(patch, str):
            continue
        rim = find_rim(patch, sphere.x_px)
        if rim.highest_y_px == patch.y0 > 0:  # it has risen by more
            whole = read_patch(clip, frame, ground, (sphere.x_px - reach, 0.0, sphere.x_px + reach, foot))
            rim = rim if isinstance(whole, str) else find_rim(whole, sphere.x_px)
        found[frame] = rim
        top = max(rim.highest_y_px - rise, 0.0)
    return found


def _height(rims: list[tuple[int, Rim]], times_s: Floats, when: tuple[float, float]) -> tuple[float, float, str]:
    """Row of the rim at a time (and its uncertainty), s: a line through the rows about it; or why there is none."""
    seen = [(times_s[k] - when[0], rim.top_y_px) for k, rim in rims if rim.status == "ok"]
    if len(seen) < FEWEST_RIMS:
        words = {rim.status for _, rim in rims}
        return math.nan, math.nan, "out_of_frame" if "out_of_frame" in words else "no_edge"
    time, rows = np.array(seen).T
    speed, row = np.polyfit(time, rows, 1)
    # a rim is uneven: the rows of neighbouring frames are those of the same jets, and their mean no better than one
    scatter = float(np.std(rows - row - speed * time))
    return float(row), math.hypot(scatter, 1.0, speed * when[1]), "ok"


def _from_above(folder: Path, drop: Drop) -> DomeOver:
    """When the crown closes over the sphere, from grey levels of the top view about the last frame that shows it."""
    top = read_table(folder, "top")
    shown = np.flatnonzero((top["status"] == "ok").to_numpy() & (top["t_s"] > 0).to_numpy(bool))
    if shown.size == 0:
        return DomeOver(np.nan, np.nan, "no_edge")
    last = int(shown[-1])
    x, y = (float(top[name].iloc[last]) for name in ("center_x_px", "center_y_px"))
    geometry = read_table(folder, "geometry")
    radius = DOME_DISC * float(geometry.loc[geometry["view"] == "top", "radius_px"].iloc[0])
    if not np.isfinite(radius):
        radius = DOME_DISC * float(top["radius_px"].iloc[shown].median())
    frames = range(max(last - 6, 0), min(last + DOME_FRAMES, len(top)))
    levels = _disc_levels(folder, drop, frames, (x, y, radius))
    return find_dome_over(top["t_s"].to_numpy(float)[frames.start : frames.stop], levels)


def _disc_levels(folder: Path, drop: Drop, frames: range, disc: tuple[float, float, float]) -> Floats:
    x, y, radius = disc
    levels = np.full(len(frames), np.nan)
    clip = open_clip(folder, drop, "top")
    try:
        rows, columns = clip.shape
        x0, x1 = max(int(x - radius), 0), min(int(x + radius) + 2, columns)
        y0, y1 = max(int(y - radius), 0), min(int(y + radius) + 2, rows)
        for k, frame in enumerate(frames):
            try:
                levels[k] = disc_level(clip.read(frame, (x0, y0, x1, y1)), x - x0, y - y0, radius)
            except FrameUnreadableError:
                continue
    finally:
        clip.close()
    return levels
