"""The telling moments of a drop: the frames of its film strip and the vertical lines of its curves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wentry_cli.report.campaign import DropResults, as_number, as_text

STRIP_LENGTH = 7
APART = 0.03  # of the time shown; events that are nearer to each other share a frame
WITHOUT_PICTURE = ("gap", "bad_frame")


@dataclass(frozen=True)
class Moment:
    """The time after impact of a frame of the leading view, and what happens there."""

    t_s: float
    label: str


def leading_view(drop: DropResults) -> str:
    """The view whose frames are the telling ones: the side, or the top where it is alone."""
    return "top" if drop.table("side").empty else "side"


def with_picture(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of a view's table whose frame can be shown, whatever was measured in it."""
    return table[table["t_s"].map(as_number).notna() & ~table["status"].isin(WITHOUT_PICTURE)]


def times_of(table: pd.DataFrame) -> NDArray[np.float64]:
    """Times of the rows of a table, s."""
    return table["t_s"].map(as_number).to_numpy(dtype=float)


def telling_moments(drop: DropResults, count: int = STRIP_LENGTH) -> list[Moment]:
    """Choose ``count`` frames of the leading view: those nearest to what happens, then measured ones far from them.

    A frame nearest to an event is chosen whatever was measured in it.
    """
    table = with_picture(drop.table(leading_view(drop)))
    times, measured = times_of(table), times_of(table[table["status"] == "ok"])
    start, stop = _worth_showing(drop, measured, times)
    measured = measured[(measured >= start) & (measured <= stop)]
    if measured.size < 2:
        return []
    chosen: dict[float, str] = {}
    for event in _events(drop, start, stop):
        frame = float(times[np.argmin(np.abs(times - event.t_s))])
        apart = all(abs(frame - other) > APART * (stop - start) for other in chosen)
        if apart and len(chosen) < count:
            chosen[frame] = event.label
    if not chosen:
        even = np.linspace(measured[0], measured[-1], count)
        chosen = {float(measured[np.argmin(np.abs(measured - time))]): "" for time in even}
    while len(chosen) < count:
        room = np.abs(measured[:, None] - np.array([measured[0], measured[-1], *chosen])).min(axis=1)
        if not room.max() > 0.0:
            break
        chosen[float(measured[np.argmax(room)])] = ""
    return [Moment(time, chosen[time] or _phase(drop, time)) for time in sorted(chosen)]


def _worth_showing(drop: DropResults, measured: NDArray[np.float64], times: NDArray[np.float64]) -> tuple[float, float]:
    """First and last time worth showing: from half a diameter before impact to a little after pinch-off.

    Without a pinch-off the last measured time is the end; with one it is in the strip though the sphere has left.
    """
    if measured.size == 0:
        return 0.0, 0.0
    start, stop = float(measured.min()), float(measured.max())
    if drop.kind == "free_flight":
        return start, stop
    early = 0.5 * drop.number("diameter_m") / drop.number("impact_speed_m_s")
    pinch_off = drop.number("t_p_s")
    start = max(start, -early) if math.isfinite(early) else start
    if not math.isfinite(pinch_off):
        return start, stop
    return start, min(max(stop, pinch_off), 1.15 * pinch_off, float(times.max()))


def _events(drop: DropResults, start: float, stop: float) -> list[Moment]:
    """What happens between two times, the most telling first, at the times of ``events.csv`` and ``periods.csv``."""
    if drop.kind == "free_flight":
        return []
    moments = [Moment(drop.number("t_p_s"), "pinch-off"), Moment(0.0, "impact")]
    periods = drop.table("periods").head(2).to_dict("records")
    for column, label in (("t_peak_s", "widest"), ("t_valley_s", "longest")):
        moments += [Moment(as_number(row[column]), f"{label}, N = {as_text(row['period'])}") for row in periods]
    events = drop.table("events")
    domes = events.loc[events["event"] == "dome_over", "t_s"].map(as_number)
    moments += [Moment(time, "dome-over") for time in domes if time > 0]
    return [moment for moment in moments if start <= moment.t_s <= stop]


def _phase(drop: DropResults, time: float) -> str:
    """What a frame shows in which nothing special happens."""
    if drop.kind == "free_flight":
        return "in flight"
    if time < 0.0:
        return "before impact"
    return "after pinch-off" if time > drop.number("t_p_s") else "after impact"
