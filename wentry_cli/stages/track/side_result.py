"""What the side view gave, in metres and seconds: from sightings to the columns of side.csv."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.axis import NO_AXIS, OpticalAxis
from wentry_cli.stages.track.exposure import exposure_frames
from wentry_cli.stages.track.rows import (
    blurred_stretch,
    local_bottom_holds,
    local_bottom_unc,
    lowest_points,
    lowest_rows,
    side_columns,
)
from wentry_cli.stages.track.scales import Scales, height_unc
from wentry_cli.tables import vouched
from wentry_cli.tracking.impact import Impact
from wentry_cli.tracking.prediction import plausible
from wentry_cli.tracking.scale import PixelMap, PooledRadius, pixel_to_metre
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop


@dataclass(frozen=True)
class SideResult:
    """What the side view gave: columns of side.csv, scales, surface, radius in air, impact, the map to metres.

    ``released_s`` is when a sphere that was held is let go, on the camera clock; −inf where none was.
    """

    columns: dict[str, Any]
    scales: Scales
    surface: SurfaceRow
    radius: PooledRadius
    impact: Impact
    problem: str = ""
    shape_offset: float = 0.0
    axis: OpticalAxis = NO_AXIS
    released_s: float = -math.inf


def dated(columns: dict[str, Any], t_s: NDArray[np.float64]) -> dict[str, Any]:
    """The columns with their times, and with status words that keep their promise."""
    columns = columns | {"t_s": t_s}
    return columns | {"status": vouched("side", columns)}


def state_radius(columns: dict[str, Any], air: PooledRadius, water: PooledRadius) -> None:
    """Where the radius was held in the fit, its uncertainty is that of the pooled radius it was held at."""
    held = np.isnan(columns["radius_px_unc"]) & np.isfinite(columns["radius_px"])
    wet = np.abs(columns["radius_px"] - water.value) < np.abs(columns["radius_px"] - air.value)
    columns["radius_px_unc"] = np.where(held, np.where(wet, water.unc, air.unc), columns["radius_px_unc"])


def _without_impossible(columns: dict[str, Any]) -> dict[str, Any]:
    """The columns without the stretches that no sphere can have; a fit that says so is poor."""
    stretch = plausible(columns["stretch"])
    wrong = np.isfinite(columns["stretch"]) & np.isnan(stretch)
    status = ["poor_fit" if bad and word == "ok" else word for word, bad in zip(columns["status"], wrong, strict=True)]
    told = {"stretch": stretch, "status": status}
    told |= {name: np.where(wrong, np.nan, columns[name]) for name in columns if name.startswith("stretch_unc")}
    return columns | told


def in_metres(
    drop: Drop,
    clip: Clip,
    sightings: Sequence[Sighting],
    known: tuple[Scales, SurfaceRow, OpticalAxis],
    check: ShapeCheck = NO_CHECK,
) -> dict[str, Any]:
    """Columns of side.csv without t_s: pixels as seen, heights in metres with all of their uncertainty."""
    scales, surface, axis = known
    columns = side_columns(clip.count, sightings)
    if axis == NO_AXIS:  # without water both media have one scale, and nothing depends on the axis
        axis = OpticalAxis(clip.opened.middle_px[1], 0.0)
    pixels = PixelMap(
        scales.air, scales.water, surface.y_px, clip.opened.middle_px[0], axis.y_px, surface.x_px, surface.roll_rad
    )
    doubt = np.full(clip.count, abs(check.stretch_offset))
    for item in sightings:
        doubt[item.frame] = check.stretch_doubt(item.line)
    doubt = np.hypot(doubt, blurred_stretch(columns, exposure_frames(drop, "side", clip)))
    columns["stretch_unc_random"], outline_unc = columns["stretch_unc"], columns["bottom_y_px_unc"]
    columns["stretch_unc"] = np.hypot(columns["stretch_unc"], doubt)
    columns = _without_impossible(columns)
    use_local = local_bottom_holds(columns, check.bottom_offset_px, deforms=drop.experiment.deformable)
    columns["bottom_local_y_px_unc"] = local_bottom_unc(columns, check.bottom_offset_px)
    columns["bottom_y_px_unc"] = np.hypot(columns["bottom_y_px_unc"], check.bottom_offset_px)
    wet = np.zeros(clip.count, dtype=bool)
    wet[[item.frame for item in sightings if item.wet]] = True
    bottom, unc = lowest_rows(columns, use_local, ~wet)
    columns["y_b_m"] = pixel_to_metre(*lowest_points(columns, bottom, pixels.roll_rad), pixels, wet)[1]
    zero = (surface.y_px, surface.unc_px), (axis.y_px, axis.unc_px)
    columns["y_b_m_unc"] = height_unc((bottom, unc), scales, *zero, wet)
    scale = np.where(wet, scales.water, scales.air)
    own = np.where(use_local, columns["bottom_local_y_px_unc"], outline_unc)
    columns["y_b_m_unc_random"] = np.where(np.isfinite(unc), own, np.nan) / scale
    columns["y_b_source"] = np.where(np.isfinite(bottom), np.where(use_local, "local", "ellipse"), "")
    line = columns["separation_y_px"], columns["separation_y_px_unc"]
    # it is seen through the water, all of it
    columns["separation_y_m"] = pixel_to_metre(columns["center_x_px"], line[0], pixels, wet)[1]
    columns["separation_y_m_unc"] = height_unc(line, scales, *zero, wet)
    columns["separation_y_m_unc_random"] = line[1] / scale
    if not drop.experiment.deformable and drop.experiment.kind != "free_flight":
        columns |= dict.fromkeys(("stretch", "stretch_unc", "stretch_unc_random"), np.full(clip.count, np.nan))
    return columns


def why_no_impact(impact: Impact, target: str, drop: Drop, clip: Clip) -> str:
    """One sentence for a sphere that is not seen to reach its ``target``, surface or plate; empty where it is."""
    if impact.status == "ok":
        return ""
    frames = drop.view("side").frames
    longer = "take a longer clip" if frames is None else f"take more of the clip than views.side.frames {[*frames]}"
    if impact.status == "clip_ended":
        missing = impact.beyond_s / float(np.median(np.diff(clip.time_s)))
        return f"the clip ends {missing:.1f} frames before the sphere meets the {target}, in air: {longer}"
    if impact.status == "no_object":
        return (
            f"the sphere never reaches the {target}: check views.side.surface_y_px, {longer}, or say kind: "
            "free_flight where there is none"
        )
    return "the moment of impact is not known: the clip shows too few frames before it"
