"""Stage ``stretch``: both views' λ become one λ(t) and its periods (``stretch.csv``, ``periods.csv``)."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.kinematics.extremum import Extremum
from wentry_cli.kinematics.merging import MergedStretch, find_offset, merge_stretch
from wentry_cli.kinematics.oscillation import Oscillation, Period, find_oscillation
from wentry_cli.stages.inputs.columns import column
from wentry_cli.tables import has_table, new_table, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

Array = NDArray[np.float64]
logger = logging.getLogger(__name__)
LATEST_PEAK = 1.4  # periods after a peak at which the next one must have been seen, were it there to be seen
COMMON_FRAMES, APART, CLEARLY = 5, 0.01, 4.0  # beyond these, 1 and standard uncertainties, two views disagree
SCALE_OFF = 0.03  # a scale given by hand is as good as that
UNUSABLE = ("no_object", "poor_fit", "bad_frame", "gap")


def run(folder: Path, drop: Drop) -> None:
    """Merge λ of the views that were filmed and find its oscillation; no tables where nothing was tracked."""
    views = {name: read_table(folder, name) for name in ("side", "top") if has_table(folder, name)}
    if not views:
        return
    frame, common = _merge(views, _dome_over(folder), drop)
    write_table(folder, "stretch", frame)
    found = find_oscillation(column(frame, "t_s"), column(frame, "stretch"), column(frame, "stretch_unc"))
    write_table(folder, "periods", _periods_table(found, common))


def _measured(view: pd.DataFrame) -> tuple[Array, Array]:
    """λ of a view and its uncertainty, NaN where the row's status says that it is no measurement."""
    bad = view["status"].isin(UNUSABLE).to_numpy(dtype=bool)
    stretch, unc = column(view, "stretch"), column(view, "stretch_unc")
    return np.where(bad, np.nan, stretch), np.where(bad, np.nan, unc)


def _dome_over(folder: Path) -> float:
    """Time of dome-over after impact; NaN where it was not seen."""
    if not has_table(folder, "events"):
        return float("nan")
    events = read_table(folder, "events")
    times = events.loc[events["event"] == "dome_over", "t_s"].dropna()
    return float(times.iloc[0]) if len(times) else float("nan")


def _merge(views: dict[str, pd.DataFrame], dome_over: float, drop: Drop) -> tuple[pd.DataFrame, float]:
    """The rows of stretch.csv, and how far the views contradict each other in all of them (0: they do not)."""
    leading = views.get("side", views.get("top"))
    assert leading is not None
    times = column(leading, "t_s")
    nothing = np.full(times.shape, np.nan)
    side = _measured(views["side"]) if "side" in views else (nothing, nothing)
    top_times, top = times, (nothing, nothing)
    if "top" in views:
        top_times, top = column(views["top"], "t_s"), _measured(views["top"])
        if "side" in views:
            late, unsure = _refined_offset(times, side, top_times, top)
            top_times, top = top_times + late, (top[0], np.hypot(top[1], unsure * _rate(top_times, top[0])))
    merged = merge_stretch(times, side, top_times, top, dome_over_s=dome_over)
    _check_scale(drop, merged)
    common = _contradiction(merged, (side[1], top[1]))
    alone = common > 0.0 and np.isfinite(find_oscillation(times, *side).free_period_s[0])
    if common > 0.0:
        _tell_contradiction(drop.name, common, "the side view alone is used" if alone else "all frames are as doubtful")
    if alone:
        # the top view errs: its clock, scale and depth are given by hand, those of the side view follow from its frames
        own = merge_stretch(times, side, times, (nothing, nothing))
        merged, common = replace(own, top=merged.top), 0.0
    elif np.any(merged.source == "both"):
        slow = 0.5 * find_oscillation(times, merged.stretch, merged.stretch_unc).free_period_s[0]
        if np.isfinite(slow):
            merged = merge_stretch(times, side, top_times, top, dome_over_s=dome_over, slow_s=slow)
    table = new_table(
        "stretch",
        {
            "frame": leading["frame"].to_numpy(),
            "t_s": times,
            "stretch": merged.stretch,
            "stretch_unc": np.hypot(merged.stretch_unc, common),
            "source": [word or None for word in merged.source],
            "stretch_top": merged.top,
            "stretch_side": merged.side,
        },
    )
    return table, common


def _check_scale(drop: Drop, merged: MergedStretch) -> None:
    """Warn where the sphere is larger or smaller from above than from the side by one factor in all common frames."""
    given = drop.view("top").scale_pair.air if drop.experiment.views.top is not None else "auto"
    ratio = (merged.top / merged.side)[merged.source == "both"]
    if given == "auto" or ratio.size < COMMON_FRAMES:
        return
    off = float(np.median(ratio)) - 1.0
    if abs(off) > max(SCALE_OFF, CLEARLY * float(np.median(np.abs(ratio - 1.0 - off)))):
        logger.warning(
            "%s: top view: its scale is %.0f %% off what the side view says of the sphere's width; check "
            "views.top.scale_px_per_m (%g, where %.4g would agree) and views.top.camera_distance_m",
            drop.name, 100.0 * abs(off), given, given * (1.0 + off), extra=puts_in_doubt("scale of the top view"),
        )  # fmt: skip


def _contradiction(merged: MergedStretch, uncertainties: tuple[Array, Array]) -> float:
    """How far λ(t) of the two views differs in the frames that both measure; 0 unless that is clearly too far."""
    apart = np.abs(merged.top - merged.side)[merged.source == "both"]
    if apart.size < COMMON_FRAMES:
        return 0.0
    usual, unc = float(np.median(apart)), sum(float(np.nanmedian(one)) for one in uncertainties)
    return usual if usual > max(APART, CLEARLY * unc) else 0.0


def _tell_contradiction(name: str, apart: float, consequence: str) -> None:
    logger.warning(
        "%s: λ of the top view and of the side view differ by %.3f in the frames that both measure, far beyond their "
        "uncertainties: %s; check views.top: offset_s, fps, scale_px_per_m, camera_distance_m",
        name, apart, consequence, extra=puts_in_doubt("both views"),
    )  # fmt: skip


def _refined_offset(
    times: Array, side: tuple[Array, Array], top_times: Array, top: tuple[Array, Array]
) -> tuple[float, float]:
    """What to add to the top view's times and its uncertainty: 0 unless both views' λ determine it clearly."""
    if times.size < 2:
        return 0.0, 0.0
    found = find_offset(times, side, top_times, top, interval_s=float(np.median(np.diff(times))))
    return (found.seconds, found.uncertainty_s) if found.determined else (0.0, 0.0)


def _rate(times: Array, stretch: Array) -> Array:
    """Rate of a stretch, 1/s; 0 beside frames that were not measured."""
    return np.nan_to_num(np.gradient(stretch, times)) if times.size > 1 else np.zeros_like(stretch)


def _periods_table(found: Oscillation, common: float) -> pd.DataFrame:
    """The rows of periods.csv; ``common`` is an error of λ that all frames may share, which no peak averages away."""
    rows = [_row(period, _status(k, found)) for k, period in enumerate(found.periods)]
    rows = [row | {"stretch_peak_unc": float(np.hypot(row["stretch_peak_unc"], common))} for row in rows]
    rows = rows or [{"period": 1, "status": found.status}]
    names = sorted({name for row in rows for name in row})
    return new_table("periods", {name: [row.get(name) for row in rows] for name in names})


def _status(k: int, found: Oscillation) -> str:
    """Status of period ``k``: ok only where all of it is known, as it is not for the last peak that was found.

    Its next peak came after the record (``clip_ended``), or was too low to be told from what is measured
    (``not_identified``).
    """
    period, valley = found.periods[k], found.periods[k].valley
    whole = np.isfinite([period.peak_to_peak_s, period.end_s, valley.stretch if valley else np.nan]).all()
    if whole or period.status in ("no_unit_crossing", "not_identified"):
        return period.status
    before = found.periods[k - 1].peak_to_peak_s if k else np.nan
    interval = before if np.isfinite(before) else 2.0 * (valley.time_s - period.peak.time_s) if valley else np.nan
    assert found.track is not None
    ended = found.track.frames.times_s[-1]
    return "not_identified" if period.peak.time_s + LATEST_PEAK * interval < ended else "clip_ended"


def _row(period: Period, status: str) -> dict[str, Any]:
    """A row of ``periods.csv``."""
    valley = period.valley or Extremum(np.nan, np.nan, np.nan, np.nan, False)
    return {
        "period": period.number,
        "t_start_s": period.start_s,
        "t_end_s": period.end_s,
        "t_end_s_unc": period.end_unc_s,
        "t_peak_s": period.peak.time_s,
        "t_valley_s": valley.time_s,
        "peak_to_peak_s": period.peak_to_peak_s,
        "peak_to_peak_s_unc": period.peak_to_peak_unc_s,
        "stretch_peak": period.peak.stretch,
        "stretch_peak_unc": period.peak.stretch_unc,
        "stretch_valley": valley.stretch,
        "status": status,
    }
