"""The telling moments of a drop: the frames of its film strip and the vertical lines of its curves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from wentry_cli.report.campaign import DropResults, as_number, as_text

STRIP_LENGTH = 7


@dataclass(frozen=True)
class Moment:
    """A time after impact and what happens there; ``label`` is empty for a frame that only fills the strip."""

    t_s: float
    label: str


def telling_moments(drop: DropResults, view: str = "side", count: int = STRIP_LENGTH) -> list[Moment]:
    """Choose ``count`` moments of what was measured in ``view``: what happens first, then the middle of wide gaps.

    Where there is no side view, the top view serves.
    """
    start, stop = measured_span(drop, view)
    if not start < stop:
        return []
    span = stop - start
    chosen: list[Moment] = []
    for moment in _events(drop):
        apart = all(abs(moment.t_s - other.t_s) > 0.03 * span for other in chosen)
        if start <= moment.t_s <= stop and apart and len(chosen) < count:
            chosen.append(moment)
    if not chosen:
        return [Moment(float(t), "") for t in np.linspace(start, stop, count)]
    while len(chosen) < count:
        times = sorted({start, stop, *(moment.t_s for moment in chosen)})
        gaps = np.diff(times)
        wide = int(np.argmax(gaps))
        chosen.append(Moment(float(times[wide] + gaps[wide] / 2), ""))
    return sorted(chosen, key=lambda moment: moment.t_s)


def measured_span(drop: DropResults, view: str = "side") -> tuple[float, float]:
    """First and last time worth showing: from half a diameter before impact to a little after pinch-off."""
    table = drop.table("top" if drop.table("side").empty else view)
    times = table.loc[table["status"] == "ok", "t_s"].map(as_number).dropna().to_numpy(dtype=float)
    if times.size == 0:
        return 0.0, 0.0
    start, stop = float(times.min()), float(times.max())
    if drop.kind == "free_flight":
        return start, stop
    early = 0.5 * drop.number("diameter_m") / drop.number("impact_speed_m_s")
    start = max(start, -early) if math.isfinite(early) else start
    late = 1.15 * drop.number("t_p_s")
    return start, min(stop, late) if math.isfinite(late) else stop


def _events(drop: DropResults) -> list[Moment]:
    if drop.kind == "free_flight":
        return []
    moments = [Moment(t, "pinch-off") for t in [drop.number("t_p_s")] if math.isfinite(t)]
    moments.append(Moment(0.0, "impact"))
    periods = drop.table("periods")
    for column, label in (("t_peak_s", "widest"), ("t_valley_s", "longest")):
        moments += [Moment(t, f"{label}, N = {n}") for n, t in _times(periods.head(2), column)]
    domes = drop.table("events")
    domes = domes[domes["event"] == "dome_over"] if not domes.empty else domes
    moments += [Moment(t, "dome-over") for t in domes.get("t_s", pd.Series(dtype=float)).map(as_number) if t > 0]
    return moments


def _times(periods: pd.DataFrame, column: str) -> list[tuple[str, float]]:
    pairs = [(as_text(row["period"]), as_number(row[column])) for row in periods.to_dict("records")]
    return [(number, t) for number, t in pairs if math.isfinite(t)]
