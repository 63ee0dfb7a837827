"""The side view of one drop, from its recording to the columns of side.csv and its row of geometry.csv."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import SurfaceRow, find_free_surface, find_plate
from wentry_cli.kinematics.centre import centre_height
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.axis import NO_AXIS, OpticalAxis, assumed_axis, checked_axis
from wentry_cli.stages.track.impact import NO_IMPACT, best_bottom, entry_impact
from wentry_cli.stages.track.rows import blurred_stretch, contradicted_bottom, side_columns
from wentry_cli.stages.track.scales import NO_SCALES, Scales, find_scales, given_radii, height_unc
from wentry_cli.tables import vouched
from wentry_cli.tracking.flight import air_plan, both_ways, fits_in_air
from wentry_cli.tracking.impact import Impact
from wentry_cli.tracking.plate import PlateScene, track_plate
from wentry_cli.tracking.prediction import Path, plausible
from wentry_cli.tracking.scale import NO_RADIUS, PixelMap, PooledRadius, pixel_to_metre
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck
from wentry_cli.tracking.side import track_side
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.wet_plan import SideScene
from wentry_cli.tracking.wet_radius import pool_sightings

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop


# A sphere that rings from its release stays within a few per cent of round.
FAR_FROM_ROUND, HIGH, FEW_FRAMES = 0.1, 0.2, 3
LAST_FRAMES = 4
logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class SideResult:
    """What the side view gave: columns of side.csv, scales, surface, radius in air, impact, the map to metres."""

    columns: dict[str, Any]
    scales: Scales
    surface: SurfaceRow
    radius: PooledRadius
    impact: Impact
    problem: str = ""
    shape_offset: float = 0.0
    axis: OpticalAxis = NO_AXIS


def measure_side(drop: Drop, clip: Clip, ground: Background, sampled: list[int]) -> SideResult:
    """Track the side view and turn what was seen into metres and seconds."""
    falling = drop.experiment.kind != "free_flight"
    level, exposure = fitting_level(drop, ground), exposure_frames(drop, "side", clip)
    seed = find_seed(
        clip, ground, sampled, radius_range=_radius_range(drop), falling=falling,
        fits=lambda path: fits_in_air(clip, ground, path, level, exposure),
    )  # fmt: skip
    if seed is None:
        nothing = side_columns(clip.count, [])
        problem = (
            "no sphere was found in any frame: check source, roi_px and polarity of views.side; a clip that starts "
            "below the surface needs views.side.background"
        )
        return SideResult(nothing, NO_SCALES, _surface(drop, ground, None), NO_RADIUS, NO_IMPACT, problem)
    clip.release()
    if drop.experiment.kind == "free_flight":
        return _measure_flight(drop, clip, ground, seed)
    surface = _surface(drop, ground, seed)
    if drop.experiment.kind == "surface_impact":
        return _measure_plate(drop, clip, ground, (seed, surface))
    if surface.status != "ok":
        nothing = side_columns(clip.count, [])
        problem = "the free surface was not found: set views.side.surface_y_px to its row"
        return SideResult(nothing, NO_SCALES, surface, NO_RADIUS, NO_IMPACT, problem)
    return _measure_entry(drop, clip, ground, (seed, surface))


def _radius_range(drop: Drop) -> tuple[float, float]:
    pair = drop.view("side").scale_pair
    if pair.air == "auto":
        return 7.0, math.inf
    radius = pair.air * drop.experiment.sphere.radius_m
    return 0.85 * radius, 1.15 * radius


def _surface(drop: Drop, ground: Background, seed: Path | None) -> SurfaceRow:
    """The row of y = 0: given, or found below the sphere in the empty scene."""
    view = drop.view("side")
    found = _found_surface(drop, ground, seed)
    if view.surface_y_px == "auto":
        return found
    given = SurfaceRow(float(view.surface_y_px), view.surface_y_px_unc or 0.3, 3.0, math.nan, "ok")
    if found.status == "ok" and abs(given.y_px - found.y_px) > 4.0 * given.unc_px + found.thickness_px:
        logger.warning(
            f"{drop.name}: views.side.surface_y_px is {given.y_px:g}, but the picture shows a surface at row "
            f"{found.y_px:.1f}; heights, impact and speeds go by the one that was given"
        )
    return given


def _found_surface(drop: Drop, ground: Background, seed: Path | None) -> SurfaceRow:
    middle = seed.shapes[-1].x if seed is not None else None
    if drop.experiment.kind == "surface_impact":
        return find_plate(ground.level, x_px=middle)
    highest = min(shape.y for shape in seed.shapes) if seed is not None else 0.0
    level = ground.level if ground.contrast == 0 else np.float32(ground.full_scale) - ground.level
    return find_free_surface(level, x_px=middle, rows=(highest, float(ground.shape[0])))


def exposure_frames(drop: Drop, name: str, clip: Clip) -> float:
    """Exposure over the time between frames; 0 where the exposure is not known."""
    exposure = drop.view(name).exposure_s or clip.exposure_s or 0.0
    step = float(np.median(np.diff(clip.time_s))) if clip.count > 1 else math.inf
    return exposure / step


def fitting_level(drop: Drop, ground: Background) -> str:
    """The level of method: as configured, but edges at half level where the sensor clips the light.

    The likelihood of a pixel needs to know how bright the ground is; at a clipped ground it would have to guess, and
    the radius with it (.6 % in the recordings tried), while the half level of what was recorded is what a reader of
    the picture means by its edge.
    """
    return "fast" if math.isfinite(ground.ceiling) else drop.experiment.analysis.tracking


def _measure_entry(drop: Drop, clip: Clip, ground: Background, start: tuple[Path, SurfaceRow]) -> SideResult:
    seed, surface = start
    air, water = given_radii(drop)
    scene = SideScene(
        surface.y_px,
        max(1.0, 0.5 * surface.thickness_px),
        drop.experiment.deformable,
        fitting_level(drop, ground),
        exposure_frames(drop, "side", clip),
        air,
        water,
    )
    track = track_side(clip, ground, seed, scene)
    if track.mirror.is_surface and drop.view("side").surface_y_px == "auto":
        surface = replace(surface, y_px=track.mirror.y_px, unc_px=track.mirror.unc_px)
    scales = find_scales(drop, track.radius_air, track.radius_water, ground)
    impact = entry_impact(drop, clip, track.sightings, (surface, scales.air))
    axis = assumed_axis(drop, clip.opened.middle_px)
    columns = _in_metres(drop, clip, track.sightings, (scales, surface, axis), track.check)
    t_s = clip.time_s - impact.time_s
    checked = checked_axis(drop, axis, scales, t_s, _centre_m(columns, drop))
    if checked != axis:
        columns = _in_metres(drop, clip, track.sightings, (scales, surface, checked), track.check)
    _state_radius(columns, track.radius_air, track.radius_water)
    problem = "" if impact.status == "ok" else _why_no_impact(impact, "surface")
    columns = _dated(columns, t_s)
    offset = track.check.stretch_offset
    return SideResult(columns, scales, surface, track.radius_air, impact, problem, offset, checked)


def _centre_m(columns: dict[str, Any], drop: Drop) -> NDArray[np.float64]:
    """Heights of the centre, NaN where the frame is not ok."""
    ok = np.array([word == "ok" for word in columns["status"]])
    stretch = columns["stretch"] if drop.experiment.deformable else np.ones(len(ok))
    bottom = columns["y_b_m"], columns["y_b_m_unc"]
    radius_m, tilt_deg = drop.experiment.sphere.radius_m, columns["tilt_deg"]
    return np.where(ok, centre_height(*bottom, stretch, columns["stretch_unc"], radius_m, tilt_deg)[0], np.nan)


def _why_no_impact(impact: Impact, target: str) -> str:
    if impact.status == "no_object":
        return (
            f"the sphere never reaches the {target}: check views.side.surface_y_px, take a longer clip, or say kind: "
            "free_flight where there is none"
        )
    return "the moment of impact is not known: the clip shows too few frames before it"


def _measure_plate(drop: Drop, clip: Clip, ground: Background, start: tuple[Path, SurfaceRow]) -> SideResult:
    seed, plate = start
    air, _ = given_radii(drop)
    exposure = exposure_frames(drop, "side", clip)
    scene = PlateScene(plate.y_px, drop.experiment.deformable, fitting_level(drop, ground), exposure, air)
    track = track_plate(clip, ground, seed, scene)
    problem = ""
    if plate.status != "ok":
        if _still_falls(track.sightings):
            problem = "no plate was found, and the sphere falls to the end: check kind and views.side.surface_y_px"
        plate = SurfaceRow(track.turning_px, 1.0, 0.0, math.nan, "ok")
    scales = find_scales(drop, track.radius, NO_RADIUS, ground)
    flying = [item for item in track.sightings if item.free_fit is not None or best_bottom(item)[2] > 0]
    before = [item for item in flying if item.frame < _first_contact(track.sightings, plate.y_px)]
    impact = entry_impact(drop, clip, before, (plate, scales.air))
    columns = _in_metres(drop, clip, track.sightings, (scales, plate, NO_AXIS))
    _state_radius(columns, track.radius, NO_RADIUS)
    columns = _dated(columns, clip.time_s - impact.time_s)
    problem = problem or ("" if impact.status == "ok" else _why_no_impact(impact, "plate"))
    if not problem and _deforms_in_flight(columns, drop.experiment.sphere.radius_m):
        problem = "the sphere deforms long before it meets the plate: check kind and views.side.surface_y_px"
    return SideResult(columns, scales, plate, track.radius, impact, problem)


def _still_falls(sightings: Sequence[Sighting]) -> bool:
    """Whether the lowest point goes down from frame to frame up to the last that shows it."""
    rows = [best_bottom(item)[0] for item in sightings if item.ok and item.fit is not None][-LAST_FRAMES:]
    return len(rows) == LAST_FRAMES and bool(np.all(np.diff(rows) > 0.0))


def _deforms_in_flight(columns: dict[str, Any], radius_m: float) -> bool:
    """Whether the stretch leaves 1 by far in several frames before contact and at a height: then there was another."""
    stretch, height = np.asarray(columns["stretch"], float), np.asarray(columns["y_b_m"], float)
    early = (np.asarray(columns["t_s"], float) < 0.0) & (height > HIGH * radius_m)
    return int(np.sum(early & (np.abs(stretch - 1.0) > FAR_FROM_ROUND))) >= FEW_FRAMES


def _first_contact(sightings: Sequence[Sighting], plate_px: float) -> int:
    touching = (item.frame for item in sightings if item.fit is not None and best_bottom(item)[0] > plate_px - 1.0)
    return next(touching, sightings[-1].frame + 1 if sightings else 0)


def _measure_flight(drop: Drop, clip: Clip, ground: Background, seed: Path) -> SideResult:
    exposure = exposure_frames(drop, "side", clip)
    level = fitting_level(drop, ground)
    plan = air_plan(clip.shape, level=level, exposure_frames=exposure, bottom=False)
    sightings, _ = both_ways(clip, ground, seed, plan, clip.count - 1)
    radius, _ = given_radii(drop)
    radius = radius if radius.known else pool_sightings(sightings, wet=False)
    scales = find_scales(drop, radius, NO_RADIUS, ground)
    first = next((item.fit for item in sightings if item.ok and item.fit is not None), None)
    zero = SurfaceRow(math.nan, math.nan, 0.0, math.nan, "no_edge")
    if first is not None:
        zero = SurfaceRow(first.center_y_px, 0.0, 0.0, math.nan, "ok")
    columns = _in_metres(drop, clip, sightings, (scales, zero, NO_AXIS))
    columns = _dated(columns, clip.time_s - clip.time_s[0])
    return SideResult(columns, scales, zero, radius, NO_IMPACT)


def _dated(columns: dict[str, Any], t_s: NDArray[np.float64]) -> dict[str, Any]:
    """The columns with their times, and with status words that keep their promise."""
    columns = columns | {"t_s": t_s}
    return columns | {"status": vouched("side", columns)}


def _state_radius(columns: dict[str, Any], air: PooledRadius, water: PooledRadius) -> None:
    """Where the radius was held in the fit, its uncertainty is that of the pooled radius it was held at."""
    held = np.isnan(columns["radius_px_unc"]) & np.isfinite(columns["radius_px"])
    wet = np.abs(columns["radius_px"] - water.value) < np.abs(columns["radius_px"] - air.value)
    columns["radius_px_unc"] = np.where(held, np.where(wet, water.unc, air.unc), columns["radius_px_unc"])


def _without_impossible(columns: dict[str, Any]) -> dict[str, Any]:
    """The columns without the stretches that no sphere can have; a fit that says so is poor."""
    stretch = plausible(columns["stretch"])
    wrong = np.isfinite(columns["stretch"]) & np.isnan(stretch)
    status = ["poor_fit" if bad and word == "ok" else word for word, bad in zip(columns["status"], wrong, strict=True)]
    unc = np.where(wrong, np.nan, columns["stretch_unc"])
    return columns | {"stretch": stretch, "stretch_unc": unc, "status": status}


def _in_metres(
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
    pixels = PixelMap(scales.air, scales.water, surface.y_px, clip.opened.middle_px[0], axis.y_px)
    local = columns["bottom_local_y_px"]
    use_local = np.isfinite(local) & (drop.experiment.deformable | ~contradicted_bottom(columns))
    bottom = np.where(use_local, local, columns["bottom_y_px"])
    doubt = np.full(clip.count, abs(check.stretch_offset))
    for item in sightings:
        doubt[item.frame] = check.stretch_doubt(item.line)
    doubt = np.hypot(doubt, blurred_stretch(columns, exposure_frames(drop, "side", clip)))
    columns["stretch_unc"] = np.hypot(columns["stretch_unc"], doubt)
    columns = _without_impossible(columns)
    columns["bottom_y_px_unc"] = np.hypot(columns["bottom_y_px_unc"], check.bottom_offset_px)
    unc = np.where(use_local, columns["bottom_local_y_px_unc"], columns["bottom_y_px_unc"])
    wet = np.zeros(clip.count, dtype=bool)
    wet[[item.frame for item in sightings if item.wet]] = True
    columns["y_b_m"] = pixel_to_metre(0.0, bottom, pixels, wet)[1]
    zero = (surface.y_px, surface.unc_px), (axis.y_px, axis.unc_px)
    columns["y_b_m_unc"] = height_unc((bottom, unc), scales, *zero, wet)
    columns["y_b_source"] = np.where(np.isfinite(bottom), np.where(use_local, "local", "ellipse"), "")
    columns["separation_y_m"] = pixel_to_metre(0.0, columns["separation_y_px"], pixels)[1]
    if not drop.experiment.deformable and drop.experiment.kind != "free_flight":
        columns["stretch"] = columns["stretch_unc"] = np.full(clip.count, np.nan)
    return columns
