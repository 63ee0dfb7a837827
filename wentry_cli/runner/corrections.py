"""Lay a person's corrections over the tables of a stage; what they touch has the status ``manual``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from wentry_cli.config.campaign import Drop
from wentry_cli.config.corrections import CORRECTIONS, Corrections, EventCorrection, FrameCorrection
from wentry_cli.errors import TooFewMeasurementsError
from wentry_cli.pipeline import Stage
from wentry_cli.runner.in_clip import check_heights
from wentry_cli.tables import has_table, new_table, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

_MEASURED_BY_VIEW = {"side": "side", "top": "top"}


def apply_corrections(folder: Path, stage: Stage, drop: Drop) -> None:
    """Correct the tables that ``stage`` has just written into ``folder``.

    Raises ``ConfigurationError`` for heights outside the picture, and ``TooFewMeasurementsError`` where too few frames
    are left.
    """
    corrections = drop.corrections
    if stage.name == "track":
        check_heights(folder, drop)
        _shift_impact(folder, corrections)
        for correction in corrections.frames:
            correct_frames(folder, correction)
        if corrections.frames:
            _count_left(folder, drop)
    if stage.name == "cavity":
        _correct_events(folder, corrections)


def _shift_impact(folder: Path, corrections: Corrections) -> None:
    impact = corrections.impact
    if impact is None or impact.time_s is None:
        return
    geometry = read_table(folder, "geometry")
    before = geometry["impact_time_s"].fillna(0.0).iloc[0]
    by_eye = _time_unc(geometry, impact)
    geometry["impact_time_s"] = impact.time_s
    geometry["impact_time_s_unc"] = geometry["impact_time_s_unc_random"] = by_eye
    write_table(folder, "geometry", geometry)
    for name in ("side", "top"):
        if has_table(folder, name):
            frame = read_table(folder, name)
            frame["t_s"] += before - impact.time_s
            write_table(folder, name, frame)


def _time_unc(geometry: pd.DataFrame, event: EventCorrection) -> float:
    """How well a person sees when something happens where it is not said: half the time between two frames."""
    return 0.5 / float(geometry["fps"].iloc[0]) if event.t_s_unc is None else event.t_s_unc


def correct_frames(folder: Path, correction: FrameCorrection) -> None:
    """Put the values of one correction into the table of its view in ``folder``."""
    name = _MEASURED_BY_VIEW[correction.view]
    if not has_table(folder, name):
        return
    frame = read_table(folder, name)
    rows = frame["frame"].between(*correction.frames)
    values = {column: value for column, value in correction.by_column.items() if column in frame}
    pixel = _by_eye(folder, correction.view)
    values = {f"{column}_unc": pixel[column] for column in values if column in pixel} | values
    values |= {f"{name}_random": value for name, value in values.items() if f"{name}_random" in frame}
    for column in [item for item in frame.columns if item not in ("frame", "t_s", "status")]:
        if correction.exclude:
            frame.loc[rows, column] = None
    for column, value in values.items():
        frame.loc[rows, column] = value
    frame.loc[rows, "status"] = "manual"
    write_table(folder, name, frame)


def _by_eye(folder: Path, view: str) -> dict[str, float]:
    """How well a person sees what is corrected, a pixel: its standard uncertainty where none is given."""
    geometry = read_table(folder, "geometry")
    row = geometry[geometry["view"] == view].iloc[0]
    metres = 1.0 / float(row["scale_px_per_m"])
    return {"stretch": 1.0 / float(row["radius_px"]), "y_b_m": metres, "separation_y_m": metres}


def _count_left(folder: Path, drop: Drop) -> None:
    least, left = drop.experiment.analysis.min_frames, 0
    for view in drop.experiment.sides:
        frame = read_table(folder, view)
        value = frame["y_b_m" if view == "side" else "stretch"]
        left = max(left, int(((frame["status"] == "ok") | ((frame["status"] == "manual") & value.notna())).sum()))
    if left < least:
        raise TooFewMeasurementsError(
            f"{drop.folder / CORRECTIONS}: leaves only {left} frames of {drop.name}, {least} are needed; exclude fewer"
        )


def _correct_events(folder: Path, corrections: Corrections) -> None:
    by_hand = [event for event in corrections.events if event.event != "impact"]
    if not corrections.events:
        return
    frame, geometry = read_table(folder, "events"), read_table(folder, "geometry")
    for event in by_hand:
        row: dict[str, Any] = {"event": event.event, "index": event.index, "t_s": event.t_s}
        row |= {"t_s_unc": _time_unc(geometry, event), "y_m": event.y_m, "value": event.value, "status": "manual"}
        if event.y_m is not None:
            row["y_m_unc"] = event.y_m_unc or _by_eye(folder, "side")["y_b_m"]
        frame = _replaced(frame, row)
    if corrections.impact is not None:
        frame.loc[frame["event"] == "impact", "status"] = "manual"
    write_table(folder, "events", frame)


def _replaced(frame: pd.DataFrame, row: dict[str, Any]) -> pd.DataFrame:
    import pandas as pd

    same = (frame["event"] == row["event"]) & (frame["index"].fillna(1) == row["index"])
    added = new_table("events", {name: [value] for name, value in row.items()})
    corrected: pd.DataFrame = pd.concat([frame[~same], added], ignore_index=True)
    return corrected
