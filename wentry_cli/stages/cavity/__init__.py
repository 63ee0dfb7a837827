"""Stage cavity: profile of the cavity (cavity.csv), its necks (neck.csv) and what happens to it (events.csv)."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.follow import measure_profiles
from wentry_cli.cavity.neck import Neck, NeckFollower, NeckTrack, find_necks
from wentry_cli.cavity.nested import wall_numbers
from wentry_cli.cavity.profile import CavityProfile
from wentry_cli.cavity.seal import EDGE_MODEL_PX, Scene, Seal, find_seal
from wentry_cli.progress import tick
from wentry_cli.stages.cavity.crown import Dome, find_dome
from wentry_cli.stages.cavity.view import SideView, read_side_view
from wentry_cli.stages.inputs.clip import flat_field, open_clip
from wentry_cli.tables import new_table, write_table

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

Floats = NDArray[np.float64]

NOTHING_SEEN = (
    "below the surface neither cavity nor sphere stands out from the ground in any frame, so nothing is said of how "
    "the cavity closes: film with more contrast, or check surface_y_px of views.side"
)
logger = logging.getLogger(__name__)

ROWS_PER_RADIUS = 20  # cavity.csv keeps every third row of a sphere of 60 px


class _Rows:
    """Columns of cavity.csv, collected frame by frame: every some row between the surface and the contact line."""

    def __init__(self, view: SideView) -> None:
        self._view = view
        self._step = max(2, round(view.radius_px / ROWS_PER_RADIUS))
        self._frames: list[int] = []
        self._parts: list[tuple[Floats, Floats, Floats]] = []  # rows, left and right edges, px

    def add(self, frame: int, profile: CavityProfile) -> None:
        """Add the walls of one frame."""
        sphere = self._view.spheres[frame]
        assert sphere is not None
        foot = self._view.separation_px[frame]
        self._frames.append(frame)
        self._parts.append(profile.rows_above(foot if np.isfinite(foot) else sphere.top_y_px, self._step))

    def table(self) -> dict[str, Any]:
        """All columns, a row per frame and row of the profile."""
        if not self._parts:
            return {name: [] for name in ("frame", "t_s", "wall", "y_m", "left_m", "right_m")}
        view = self._view
        sizes = [part[0].size for part in self._parts]
        frame = np.repeat(self._frames, sizes)
        y_px, left_px, right_px = (np.concatenate([part[k] for part in self._parts]) for k in range(3))
        centres = [(sphere.x_px, sphere.y_px) for sphere in map(view.spheres.__getitem__, self._frames) if sphere]
        x_px, at_px = np.repeat(centres, sizes, axis=0).T
        axis, y_m = view.metres(view.plumb(x_px, at_px, y_px), y_px)
        t_s = view.t_s[frame]
        return {
            "frame": frame,
            "t_s": t_s,
            "wall": wall_numbers(y_m, t_s, view.starts),
            "y_m": y_m,
            "left_m": view.metres(left_px, y_px)[0] - axis,
            "right_m": view.metres(right_px, y_px)[0] - axis,
        }


def run(folder: Path, drop: Drop) -> None:
    """Write cavity.csv, neck.csv and events.csv of one drop that was filmed from the side.

    Frames are read one after the other, only between surface and sphere; memory does not grow with their number beyond
    the rows of the tables. In cavity.csv a frame without a profile has no rows.
    """
    clip = open_clip(folder, drop, "side")
    try:
        view = read_side_view(folder, drop, clip)
        rows, follower = _Rows(view), NeckFollower()
        count = view.t_s.size
        tops, apexes = np.full(count, np.nan), np.full(count, np.nan)
        ground, _ = flat_field(drop, "side", clip)
        clip.release()
        profiles = measure_profiles(
            clip, ground, view.spheres, surface_y_px=view.pixels.surface_y_px, radius_px=view.radius_px
        )
        for frame, profile in profiles:
            tick(frame, count)
            if profile.status == "ok":
                rows.add(frame, profile)
                follower.add(frame, _necks(profile))
                tops[frame] = profile.top_y_px
                apexes[frame] = view.apex(profile)
        dome = find_dome(folder, drop, clip, ground, view)
    finally:
        clip.close()
    if not np.isfinite(tops).any() and any(view.spheres):
        logger.warning(f"{drop.name}: {NOTHING_SEEN}")
    tracks = follower.tracks()
    seal = find_seal(tracks, _scene(view, (tops, apexes), dome, frozenset(frame for frame, _ in clip.unreadable)))
    write_table(folder, "cavity", new_table("cavity", rows.table()))
    write_table(folder, "neck", new_table("neck", _neck_columns(tracks, seal, view)))
    events = _events(view, seal, dome)
    write_table(folder, "events", new_table("events", {name: [row[name] for row in events] for name in events[0]}))


def _necks(profile: CavityProfile) -> list[Neck]:
    return find_necks(
        profile.y_px,
        profile.width_px,
        edge_unc_px=profile.edge_unc_px,
        blur_px=profile.blur_px,
        ledges_y_px=profile.ledges_y_px,
    )


def _scene(view: SideView, tops: tuple[Floats, Floats], dome: Dome, unreadable: frozenset[int]) -> Scene:
    return Scene(
        time_s=view.t_s,
        sphere_top_px=np.array([np.nan if sphere is None else sphere.top_y_px for sphere in view.spheres]),
        cavity_top_px=tops[0],
        apex_px=tops[1],
        surface_px=view.pixels.surface_y_px,
        radius_px=view.radius_px,
        exposure_s=view.exposure_s,
        surface_unc_px=view.surface_unc_px,
        dome_over_s=dome.over.t_s - dome.over.t_unc_s,
        unreadable=unreadable,
    )


def _neck_columns(tracks: Sequence[NeckTrack], seal: Seal, view: SideView) -> dict[str, Any]:
    """Necks of the open cavity: none after its closure, none inside the sphere, numbered by first appearance."""
    parts: list[tuple[NDArray[Any], ...]] = []
    for track in tracks:
        tops = np.array([view.spheres[frame].top_y_px for frame in track.frame])  # type: ignore[union-attr]
        kept = track.y_px < tops
        if seal.status == "ok":
            kept &= (view.t_s[track.frame] < seal.t_s) & (track.radius_px > 0.0)
        if kept.sum() >= 3:
            number = np.full(kept.sum(), len(parts) + 1)
            values = (track.frame, track.y_px, track.radius_px, track.radius_unc_px)
            parts.append((number, *(column[kept] for column in values)))
    if not parts:
        return {name: [] for name in ("frame", "t_s", "neck", "y_m", "radius_m", "radius_m_unc")}
    neck, frame, y_px, radius_px, unc_px = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((neck, frame))
    neck, frame, y_px, radius_px, unc_px = neck[order], frame[order], y_px[order], radius_px[order], unc_px[order]
    x_px = view.plumb(view.pixels.surface_x_px, view.pixels.surface_y_px, y_px)
    axis, y_m = view.metres(x_px, y_px)
    radius = view.metres(x_px + radius_px, y_px)[0] - axis
    pixel = view.metres(x_px + 1.0, y_px)[0] - axis
    unc = np.hypot(unc_px, EDGE_MODEL_PX) * pixel
    return {
        "frame": frame,
        "t_s": view.t_s[frame],
        "neck": neck,
        "y_m": y_m,
        "radius_m": radius,
        "radius_m_unc": np.hypot(unc, radius * view.scale_unc),
    }


def _events(view: SideView, seal: Seal, dome: Dome) -> list[dict[str, Any]]:
    """Rows of events.csv: impact, dome-over, starts of nested cavities before the closure, pinch-off."""
    closed = seal.t_s if seal.status == "ok" else np.inf
    known = bool(np.isfinite(view.impact_unc_s))
    contact = (0.0 if known else np.nan, view.impact_unc_s)
    over = view.after_impact(dome.over.t_s, dome.over.t_unc_s)
    rows = [
        _event("impact", 1, contact, 0.0) | _told("first_contact" if known else "", "ok" if known else "no_object"),
        _event("dome_over", 1, over, view.height(dome.y_px), view.height_unc(dome.y_px, dome.y_unc_px))
        | _told(dome.view if np.isfinite(over[0]) else "", dome.status),
    ]
    for index, start in enumerate(start for start in view.starts if start.t_s < closed):
        time = view.after_impact(start.t_s, start.t_unc_s)
        rows.append(_event("second_cavity", index + 1, time, start.y_m) | _told(str(index + 2), start.status))
    time = view.after_impact(seal.t_s, seal.t_unc_s)
    height = view.height(seal.y_px), view.height_unc(seal.y_px, seal.y_unc_px)
    rows.append(_event("pinch_off", 1, time, *height) | _told(seal.value, seal.status))
    return rows


def _event(name: str, index: int, time: tuple[float, float], y_m: float, unc_m: float = math.nan) -> dict[str, Any]:
    return {"event": name, "index": index, "t_s": time[0], "t_s_unc": time[1], "y_m": y_m, "y_m_unc": unc_m}


def _told(value: str, status: str) -> dict[str, str]:
    return {"value": value, "status": status}
