"""Stage cavity: profile of the cavity (cavity.csv), its necks (neck.csv) and what happens to it (events.csv)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.crown import rim_width
from wentry_cli.cavity.detachment import find_apex, hidden_rows
from wentry_cli.cavity.dome_over import DomeOver, disc_level, find_dome_over, find_rim_closure
from wentry_cli.cavity.follow import measure_profiles, sphere_outlines
from wentry_cli.cavity.neck import NeckFollower, NeckTrack, find_necks
from wentry_cli.cavity.nested import CavityStart, find_cavity_starts, wall_numbers
from wentry_cli.cavity.profile import CavityProfile, SphereOutline
from wentry_cli.cavity.seal import EDGE_MODEL_PX, Scene, Seal, find_seal
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background
from wentry_cli.progress import tick
from wentry_cli.stages.clip import Clip, flat_field, open_clip
from wentry_cli.stages.track_scales import Scales, pixel_map
from wentry_cli.tables import has_table, new_table, read_table, write_table
from wentry_cli.tracking.scale import PixelMap, pixel_to_metre
from wentry_cli.tracking.source import read_patch

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

Floats = NDArray[np.float64]

ROWS_PER_RADIUS = 20  # cavity.csv keeps every third row of a sphere of 60 px
DOME_DISC = 0.5  # of the undeformed radius: within the sphere when it is slender
DOME_FRAMES = 600
CROWN_REACH, CROWN_FOOT_PX = 4.0, 6.0  # radii about the axis and above the surface; clear of the surface band


@dataclass(frozen=True)
class _SideView:
    """What side.csv and geometry.csv say: arrays per frame, the map to metres, surface and radius in pixels."""

    t_s: Floats
    spheres: list[SphereOutline | None]
    starts: list[CavityStart]
    separation_px: Floats
    pixels: PixelMap
    surface_unc_px: float
    radius_px: float
    exposure_s: float
    scale_unc: float
    impact_unc_s: float

    def metres(self, x_px: Floats | float, y_px: Floats | float) -> tuple[Floats, Floats]:
        """The one map from pixels to metres."""
        return pixel_to_metre(x_px, y_px, self.pixels)

    def apex(self, profile: CavityProfile) -> float:
        """Depth of the cavity's apex below the surface, px."""
        depth = profile.y_px - self.pixels.surface_y_px
        return find_apex(depth, profile.width_px, hidden_rows(self.surface_unc_px))

    def after_impact(self, t_s: float, t_unc_s: float) -> tuple[float, float]:
        """A time after impact with the uncertainty of the impact in it."""
        return t_s, float(np.hypot(t_unc_s, np.nan_to_num(self.impact_unc_s)))


@dataclass
class _Rows:
    """Columns of cavity.csv, collected frame by frame."""

    parts: list[dict[str, Any]]

    def add(self, frame: int, profile: CavityProfile, view: _SideView) -> None:
        """Add the walls of one frame: every ``step``-th row between the surface and the contact line."""
        sphere = view.spheres[frame]
        assert sphere is not None
        step = max(2, round(view.radius_px / ROWS_PER_RADIUS))
        foot = view.separation_px[frame]
        lowest = foot if np.isfinite(foot) else sphere.top_y_px
        kept = (profile.y_px % step == 0) & (profile.y_px <= lowest) & (profile.width_px > 0.0)
        if not kept.any():
            return
        rows = profile.y_px[kept]
        axis, y_m = view.metres(sphere.x_px, rows)
        self.parts.append({
            "frame": np.full(rows.size, frame),
            "t_s": np.full(rows.size, view.t_s[frame]),
            "wall": wall_numbers(y_m, float(view.t_s[frame]), view.starts),
            "y_m": y_m,
            "left_m": view.metres(profile.left_px[kept], rows)[0] - axis,
            "right_m": view.metres(profile.right_px[kept], rows)[0] - axis,
        })  # fmt: skip

    def table(self) -> dict[str, Any]:
        """All columns, a row per frame and row of the profile."""
        names = ("frame", "t_s", "wall", "y_m", "left_m", "right_m")
        return {name: np.concatenate([part[name] for part in self.parts]) if self.parts else [] for name in names}


def run(folder: Path, drop: Drop) -> None:
    """Write cavity.csv, neck.csv and events.csv of one drop that was filmed from the side.

    Frames are read one after the other, only between surface and sphere; memory does not grow with their number beyond
    the rows of the tables. In cavity.csv a frame without a profile has no rows.
    """
    view = _side_view(folder, drop)
    rows, follower = _Rows([]), NeckFollower()
    count = view.t_s.size
    tops, apexes = np.full(count, np.nan), np.full(count, np.nan)
    clip = open_clip(folder, drop, "side")
    try:
        ground, _ = flat_field(drop, "side", clip)
        clip.release()
        profiles = measure_profiles(
            clip, ground, view.spheres, surface_y_px=view.pixels.surface_y_px, radius_px=view.radius_px
        )
        for frame, profile in profiles:
            tick(frame, count)
            if profile.status == "ok":
                rows.add(frame, profile, view)
                follower.add(frame, find_necks(profile.y_px, profile.width_px, edge_unc_px=profile.edge_unc_px))
                tops[frame] = profile.top_y_px
                apexes[frame] = view.apex(profile)
        dome = _dome_over(folder, drop) if has_table(folder, "top") else _crown_closure(clip, ground, view)
    finally:
        clip.close()
    tracks = follower.tracks()
    seal = find_seal(tracks, _scene(view, (tops, apexes), dome))
    write_table(folder, "cavity", new_table("cavity", rows.table()))
    write_table(folder, "neck", new_table("neck", _neck_columns(tracks, seal, view)))
    events = _events(view, seal, dome)
    write_table(folder, "events", new_table("events", {name: [row[name] for row in events] for name in events[0]}))


def _side_view(folder: Path, drop: Drop) -> _SideView:
    side, geometry = read_table(folder, "side"), read_table(folder, "geometry")
    row = geometry[geometry["view"] == "side"].iloc[0]
    column = {name: side[name].to_numpy(float) for name in side.columns if name not in {"status", "y_b_source"}}
    air, water = float(row["scale_px_per_m"]), float(row["scale_water_px_per_m"])
    water_unc = float(row["scale_water_px_per_m_unc"])
    scales = Scales(air, float(row["scale_px_per_m_unc"]), water, water_unc, "")
    clip = open_clip(folder, drop, "side")
    pixels = pixel_map(drop, scales, float(row["surface_y_px"]), clip.opened.middle_px)
    clip.close()
    radius = water * drop.experiment.sphere.radius_m
    starts = find_cavity_starts(column["t_s"], column["stretch"], column["stretch_unc"], column["separation_y_m"])
    spheres = sphere_outlines(column["center_x_px"], column["center_y_px"], radius, column["stretch"])
    if not np.isfinite([radius, pixels.surface_y_px, *column["t_s"]]).all():
        spheres = [None] * len(side)  # without scale, surface or impact there is nothing to measure against
    return _SideView(
        t_s=column["t_s"],
        spheres=spheres,
        starts=starts,
        separation_px=column["separation_y_px"],
        pixels=pixels,
        surface_unc_px=float(np.nan_to_num(row["surface_y_px_unc"])),
        radius_px=radius,
        exposure_s=float(np.nan_to_num(row["exposure_s"])),
        scale_unc=water_unc / water,
        impact_unc_s=float(row["impact_time_s_unc"]),
    )


def _scene(view: _SideView, tops: tuple[Floats, Floats], dome: DomeOver) -> Scene:
    return Scene(
        time_s=view.t_s,
        sphere_top_px=np.array([np.nan if sphere is None else sphere.top_y_px for sphere in view.spheres]),
        cavity_top_px=tops[0],
        apex_px=tops[1],
        surface_px=view.pixels.surface_y_px,
        radius_px=view.radius_px,
        exposure_s=view.exposure_s,
        surface_unc_px=view.surface_unc_px,
        dome_over_s=dome.t_s - dome.t_unc_s,
    )


def _neck_columns(tracks: Sequence[NeckTrack], seal: Seal, view: _SideView) -> dict[str, Any]:
    """Necks of the open cavity: none after its closure, none inside the sphere, numbered by first appearance."""
    names = ("frame", "t_s", "neck", "y_m", "radius_m", "radius_m_unc")
    rows: list[dict[str, Any]] = []
    number = 0
    for track in tracks:
        tops = np.array([view.spheres[frame].top_y_px for frame in track.frame])  # type: ignore[union-attr]
        closed = seal.t_s if seal.status == "ok" else np.inf
        kept = (view.t_s[track.frame] < closed) & (track.y_px < tops)
        if kept.sum() < 3:
            continue
        number += 1
        for k in np.flatnonzero(kept):
            rows.append(_neck_row(track, int(k), number, view))
    rows.sort(key=lambda row: (row["frame"], row["neck"]))
    return {name: [row[name] for row in rows] for name in names}


def _neck_row(track: NeckTrack, k: int, number: int, view: _SideView) -> dict[str, Any]:
    axis, y_m = view.metres(0.0, track.y_px[k])
    radius = float(view.metres(track.radius_px[k], track.y_px[k])[0] - axis)
    pixel = float(view.metres(1.0, track.y_px[k])[0] - axis)
    unc = np.hypot(track.radius_unc_px[k], EDGE_MODEL_PX) * pixel
    return {
        "frame": int(track.frame[k]),
        "t_s": float(view.t_s[track.frame[k]]),
        "neck": number,
        "y_m": float(y_m),
        "radius_m": radius,
        "radius_m_unc": float(np.hypot(unc, radius * view.scale_unc)),
    }


def _dome_over(folder: Path, drop: Drop) -> DomeOver:
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


def _crown_closure(clip: Clip, ground: Background, view: _SideView) -> DomeOver:
    """When the rim of the crown meets on the axis in the side view, once the sphere has left the crown."""
    surface, reach = view.pixels.surface_y_px, CROWN_REACH * view.radius_px
    inside = [k for k, item in enumerate(view.spheres) if item is not None and item.top_y_px > surface + 2.0]
    widths = np.full(view.t_s.size, np.nan)
    for frame in inside[:DOME_FRAMES]:
        sphere = view.spheres[frame]
        assert sphere is not None
        box = (sphere.x_px - reach, surface - reach, sphere.x_px + reach, surface - CROWN_FOOT_PX)
        patch = read_patch(clip, frame, ground, box)
        if not isinstance(patch, str):
            widths[frame] = rim_width(patch, sphere.x_px)
    return find_rim_closure(view.t_s, widths)


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


def _events(view: _SideView, seal: Seal, dome: DomeOver) -> list[dict[str, Any]]:
    """Rows of events.csv: impact, dome-over, starts of nested cavities before the closure, pinch-off."""
    closed = seal.t_s if seal.status == "ok" else np.inf
    known = bool(np.isfinite(view.impact_unc_s))
    rows = [
        _event("impact", (1, "ok" if known else "no_object"), (0.0 if known else np.nan, view.impact_unc_s), 0.0),
        _event("dome_over", (1, dome.status), view.after_impact(dome.t_s, dome.t_unc_s), np.nan),
    ]
    for index, start in enumerate(start for start in view.starts if start.t_s < closed):
        time = view.after_impact(start.t_s, start.t_unc_s)
        rows.append(_event("second_cavity", (index + 1, start.status), time, start.y_m))
    y_m = float(view.metres(0.0, seal.y_px)[1]) if seal.status == "ok" else np.nan
    rows.append(_event("pinch_off", (1, seal.status), view.after_impact(seal.t_s, seal.t_unc_s), y_m))
    rows[-1]["value"] = seal.value
    return rows


def _event(name: str, said: tuple[int, str], time: tuple[float, float], y_m: float) -> dict[str, Any]:
    index, status = said
    return {
        "event": name, "index": index, "t_s": time[0], "t_s_unc": time[1], "y_m": y_m, "value": "", "status": status,
    }  # fmt: skip
