"""Corrections by hand against the clip: frames, times and heights that the recording does not have are refused."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from wentry_cli.config.blame import wrong_correction
from wentry_cli.config.campaign import Drop
from wentry_cli.pipeline import Stage
from wentry_cli.tables import read_table


def check_before(folder: Path, stage: Stage, drop: Drop) -> None:
    """Refuse what is known to be wrong before ``stage`` runs; ``ConfigurationError`` with the place.

    ``InputError`` with the table where that is what cannot be.
    """
    given = drop.corrections
    if stage.name == "track" and (given.frames or given.impact):
        listed = read_table(folder, "frames")
        check_times(drop, {view: listed["time_s"][listed["view"] == view].tolist() for view in drop.experiment.sides})
    if stage.name == "cavity" and given.events:
        _check_events(folder, drop)
    if stage.name == "model":
        from wentry_cli.stages.inputs.peak import check_first_peak

        check_first_peak(folder)


def check_times(drop: Drop, time_s: Mapping[str, Sequence[float]]) -> None:
    """Frames and impact against the times of the frames of each view.

    The impact may lie before the clip, which can begin later, but by no more than the clip lasts.
    """
    for number, entry in enumerate(drop.corrections.frames):
        last = len(time_s[entry.view]) - 1
        if entry.frames[1] > last:
            told = f"{list(entry.frames)} are not within the {entry.view} view, whose frames are 0 to {last}"
            raise wrong_correction(drop, ("frames", number, "frames"), told)
    first, last_s = min(item[0] for item in time_s.values()), max(item[-1] for item in time_s.values())
    for number, event in enumerate(drop.corrections.events):
        at = event.time_s
        if at is not None and not first - (last_s - first) <= at <= last_s:
            told = f"{at:g} s is not in the clip, which lasts from {first:.4g} to {last_s:.4g} s"
            raise wrong_correction(drop, ("events", number, "time_s"), told)


def check_heights(folder: Path, drop: Drop) -> None:
    """Heights of frames in m against what the picture spans, as soon as ``folder`` knows its scale."""
    by_hand = [(number, entry) for number, entry in enumerate(drop.corrections.frames) if entry.view == "side"]
    if not any({"y_b_m", "separation_y_m"} & entry.by_column.keys() for _, entry in by_hand):
        return
    tall = _picture_m(folder, drop)
    for number, entry in by_hand:
        for name in ("y_b_m", "separation_y_m"):
            value = entry.by_column.get(name, 0.0)
            if abs(value) > tall:
                raise wrong_correction(drop, ("frames", number, name), _too_far(value, tall))


def _check_events(folder: Path, drop: Drop) -> None:
    """Times after impact against the end of the clip, heights against what the picture spans."""
    listed, geometry = read_table(folder, "frames"), read_table(folder, "geometry")
    lasts = float(listed["time_s"].max()) - float(geometry["impact_time_s"].iloc[0])
    tall = _picture_m(folder, drop) if any(event.y_m is not None for event in drop.corrections.events) else math.inf
    for number, event in enumerate(drop.corrections.events):
        if event.t_s is not None and event.t_s > lasts:
            told = f"{event.t_s:g} s lies behind the end of the clip ({lasts:.4g} s after impact)"
            raise wrong_correction(drop, ("events", number, "t_s"), told)
        if event.y_m is not None and abs(event.y_m) > tall:
            raise wrong_correction(drop, ("events", number, "y_m"), _too_far(event.y_m, tall))


def _too_far(value: float, tall: float) -> str:
    return f"{value:g} m is not in the picture, which is {tall:.3g} m high; heights count from the surface, up positive"


def _picture_m(folder: Path, drop: Drop) -> float:
    """Height of the side view's picture in m; infinite where its scale is not known."""
    geometry = read_table(folder, "geometry").iloc[0]
    scales = [float(geometry[name]) for name in ("scale_px_per_m", "scale_water_px_per_m")]
    known = [scale for scale in scales if math.isfinite(scale) and scale > 0]
    return _picture_rows(drop) / min(known) if known else math.inf


def _picture_rows(drop: Drop) -> int:
    from wentry_cli.stages.ingest import open_view

    opened = open_view(drop, "side")
    opened.recording.close()
    return opened.info.height
