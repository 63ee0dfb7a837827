"""Stage track: follow the sphere in each view (side.csv, top.csv) and say how large a pixel is (geometry.csv)."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wentry_cli.errors import TooFewMeasurementsError
from wentry_cli.stages.ingest import frame_rate
from wentry_cli.stages.inputs.clip import Clip, flat_field, open_clip
from wentry_cli.stages.track.out_of_view import warn_where_out_of_view
from wentry_cli.stages.track.scales import CLIPPED_EDGE
from wentry_cli.stages.track.side import measure_side
from wentry_cli.stages.track.side_result import SideResult
from wentry_cli.stages.track.top import TopResult, measure_top
from wentry_cli.tables import new_table, write_table

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop
    from wentry_cli.imaging.background import Background

logger = logging.getLogger(__name__)


def run(folder: Path, drop: Drop) -> None:
    """Write geometry.csv and, for the views that were filmed, side.csv and top.csv.

    Raises ``TooFewMeasurementsError`` after the tables are written where fewer than ``analysis.min_frames`` frames of
    every view could be measured, or the moment of impact could not be found.
    """
    side: SideResult | None = None
    top: TopResult | None = None
    rows: list[dict[str, Any]] = []
    if drop.experiment.views.side is not None:
        clip = open_clip(folder, drop, "side")
        try:
            ground, sampled = flat_field(drop, "side", clip)
            _warn_of_clipped_light(drop, "side", ground)
            side = measure_side(drop, clip, ground, sampled)
            rows.append(_side_row(drop, clip, side) | _noise(ground))
        finally:
            clip.close()
    if drop.experiment.views.top is not None:
        clip = open_clip(folder, drop, "top")
        try:
            ground, sampled = flat_field(drop, "top", clip)
            _warn_of_clipped_light(drop, "top", ground)
            top = measure_top(drop, clip, ground, sampled, side)
            rows.append(_top_row(drop, clip, top) | _noise(ground))
        finally:
            clip.close()
    write_table(folder, "geometry", new_table("geometry", {key: [row[key] for row in rows] for key in rows[0]}))
    for name, result in (("side", side), ("top", top)):
        if result is not None:
            write_table(folder, name, new_table(name, result.columns))
            warn_where_out_of_view(drop, name, result.columns)
    unknown = [str(row["view"]) for row in rows if math.isnan(row["exposure_s"])]
    _complain(drop, [item for item in (side, top) if item is not None], unknown)


def _warn_of_clipped_light(drop: Drop, name: str, ground: Background) -> None:
    if math.isfinite(ground.ceiling):
        logger.warning(
            f"{drop.name}: the light of the {name} view is brighter than its sensor records: edges are taken at half "
            f"of what was recorded, which leaves {CLIPPED_EDGE:.2%} of the diameter unknown; film with less light"
        )


def _noise(ground: Background) -> dict[str, Any]:
    """The noise of plain ground; clipped light has none, which tells nothing of the sensor's."""
    return {"ground_noise": ground.noise if ground.noise > 0.0 else math.nan}


def _row(drop: Drop, name: str, clip: Clip) -> dict[str, Any]:
    info = clip.opened.info
    exposure = drop.view(name).exposure_s or info.exposure_s
    return {
        "view": name,
        "width_px": clip.shape[1],
        "height_px": clip.shape[0],
        "fps": frame_rate(drop, name, info),
        "fps_source": info.fps_source,
        "exposure_s": math.nan if exposure is None else exposure,
    }


def _side_row(drop: Drop, clip: Clip, side: SideResult) -> dict[str, Any]:
    wet = drop.experiment.kind == "water_entry"
    found = side.surface.status == "ok" and drop.experiment.kind != "free_flight"
    rolled = found and side.surface.roll_rad != 0.0
    return _row(drop, "side", clip) | {
        "scale_px_per_m": side.scales.air,
        "scale_px_per_m_unc": side.scales.air_unc,
        "scale_water_px_per_m": side.scales.water if wet else math.nan,
        "scale_water_px_per_m_unc": side.scales.water_unc if wet else math.nan,
        "scale_source": side.scales.source,
        "surface_y_px": side.surface.y_px if found else math.nan,
        "surface_y_px_unc": side.surface.unc_px if found else math.nan,
        "surface_x_px": side.surface.x_px if rolled else math.nan,
        "roll_deg": math.degrees(side.surface.roll_rad),
        "optical_axis_y_px": side.axis.y_px,
        "optical_axis_y_px_unc": side.axis.unc_px,
        "radius_px": side.radius.value,
        "radius_px_unc": side.radius.unc,
        "impact_time_s": side.impact.time_s,
        "impact_time_s_unc": side.impact.time_unc_s,
        "impact_time_s_unc_random": side.impact.time_random_s,
        "release_time_s": side.released_s if math.isfinite(side.released_s) else math.nan,
    }


def _top_row(drop: Drop, clip: Clip, top: TopResult) -> dict[str, Any]:
    of_side = ("scale_water_px_per_m", "surface_y_px", "optical_axis_y_px")
    empty = dict.fromkeys([key for name in of_side for key in (name, f"{name}_unc")], math.nan)
    return (
        _row(drop, "top", clip)
        | empty
        | {
            "scale_px_per_m": top.scale.px_m,
            "scale_px_per_m_unc": top.scale.unc_px_m,
            "scale_source": top.scale.source,
            "radius_px": top.radius_px,
            "radius_px_unc": top.radius_px * top.scale.unc_px_m / top.scale.px_m,
            "surface_x_px": math.nan,
            "roll_deg": math.nan,
            "impact_time_s": top.impact_s[0],
            "impact_time_s_unc": top.impact_s[1],
            "impact_time_s_unc_random": math.nan,
            "release_time_s": math.nan,
        }
    )


def _complain(drop: Drop, results: Sequence[SideResult | TopResult], unexposed: Sequence[str]) -> None:
    """Raise where every view has too few good frames, or the main one has a problem that leaves no time axis.

    ``unexposed`` are the views whose exposure is not known.
    """
    least = drop.experiment.analysis.min_frames
    good = [sum(word == "ok" for word in item.columns["status"]) for item in results]
    if max(good) < least:
        words = Counter(word for item in results for word in item.columns["status"] if word != "ok")
        worst = ", ".join(f"{count} {word}" for word, count in words.most_common(3)) or "the clip has no more"
        reason = next((item.problem for item in results if item.problem), "see the status column")
        if unexposed and [word for word, _ in words.most_common(1)] == ["not_identified"]:
            reason += (
                f"; nothing is known of how long a frame of views.{unexposed[0]} is exposed: where motion blurs the "
                f"sphere give views.{unexposed[0]}.exposure_s"
            )
        raise TooFewMeasurementsError(
            f"{drop.name}: only {max(good)} frames could be measured, analysis.min_frames asks for {least} ({worst}); "
            f"{reason}"
        )
    for name, count, item in zip(drop.experiment.sides, good, results, strict=True):
        if not count:
            told = item.problem or "see its status column"
            logger.warning("%s: no frame of the %s view could be measured: %s", drop.name, name, told)
    if results[0].problem:
        raise TooFewMeasurementsError(f"{drop.name}: {results[0].problem}")
