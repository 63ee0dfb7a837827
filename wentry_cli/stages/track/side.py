"""The side view of one drop, from its recording to the columns of side.csv and its row of geometry.csv."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.imaging.background import Background
from wentry_cli.imaging.detection import HALF_LEVEL
from wentry_cli.imaging.free_surface import NO_SURFACE, SurfaceRow
from wentry_cli.kinematics.centre import below_ellipsoid, centre_height
from wentry_cli.stages.inputs.clip import Clip, flat_field_of
from wentry_cli.stages.track.axis import NO_AXIS, assumed_axis, checked_axis
from wentry_cli.stages.track.below import warn_where_lost_below
from wentry_cli.stages.track.exposure import exposure_frames, fitting_level
from wentry_cli.stages.track.impact import NO_IMPACT, entry_impact
from wentry_cli.stages.track.lost_frames import tell_idle_below, without_idle_time, without_lost_time
from wentry_cli.stages.track.plate import measure_plate
from wentry_cli.stages.track.roundness import oblateness, with_doubted_pixels
from wentry_cli.stages.track.rows import side_columns
from wentry_cli.stages.track.scales import NO_SCALES, find_scales, given_radii, warn_of_wrong_scale, with_clipped_edge
from wentry_cli.stages.track.side_result import SideResult, dated, in_metres, state_radius, why_no_impact
from wentry_cli.stages.track.surface import band_reach, surface_row
from wentry_cli.tracking.flight import air_plan, both_ways, fits_in_air
from wentry_cli.tracking.held import let_go
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import NO_RADIUS
from wentry_cli.tracking.seed import find_faint_seed, find_seed
from wentry_cli.tracking.side import SideTrack, track_side
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.waterline import changes_far_above
from wentry_cli.tracking.wet_plan import SideScene
from wentry_cli.tracking.wet_radius import pool_sightings

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)
NO_SPHERE = (
    "no sphere of {} is seen {}: correct {}source, roi_px, rotate, flip or polarity of views.side, or take the clip "
    "from where it is"
)
LEAST_RADIUS_PX = 10
NOT_IN_AIR = (
    "a clip that starts when the sphere is at the surface or below it already is not measured, with or without "
    "views.side.background and scale_px_per_m: take it from where the sphere is seen whole in air"
)
NO_SIZE = (
    "a sphere is followed, but too little of its outline agrees with a sphere to tell its size: leave out what is "
    "painted on it or stuck to it, check polarity of views.side, or give its scale_px_per_m"
)
TOO_FAINT = (
    "something round is seen, but with too little contrast against the light to be measured: film with more contrast, "
    "and check source, roi_px and polarity of views.side"
)


OTHER_POLARITY = (
    "a sphere {} than what is behind it is seen, but polarity of views.side is {}: set polarity: {}; if that is not "
    "the sphere, {}"
)
OTHER = {"dark": "bright", "bright": "dark"}


def measure_side(drop: Drop, clip: Clip, ground: Background, sampled: list[int]) -> SideResult:
    """Track the side view and turn what was seen into metres and seconds."""
    falling = drop.experiment.kind != "free_flight"
    level, exposure = fitting_level(drop, ground), exposure_frames(drop, "side", clip)

    def fits(path: Path) -> bool:
        return fits_in_air(clip, ground, path, level, exposure)

    if falling:
        without_idle_time(drop, clip, ground, _radius_range(drop))
    seed = find_seed(clip, ground, sampled, radius_range=_radius_range(drop), falling=falling, fits=fits)
    problem = _no_sphere(drop)
    if seed is None:
        seed = find_faint_seed(clip, ground, sampled, radius_range=_radius_range(drop), falling=falling, fits=fits)
        if seed is not None and not fits(seed):
            seed, problem = None, TOO_FAINT
    if seed is None:
        problem = _with_polarity(drop, clip, problem)
        nothing = side_columns(clip.count, [])
        return SideResult(nothing, NO_SCALES, surface_row(drop, clip, ground, None), NO_RADIUS, NO_IMPACT, problem)
    clip.release()
    if drop.experiment.kind == "free_flight":
        return _measure_flight(drop, clip, ground, seed)
    surface = surface_row(drop, clip, ground, seed)
    if drop.experiment.kind == "surface_impact":
        return measure_plate(drop, clip, ground, (seed, surface))
    if surface.status != "ok" and seed.level == HALF_LEVEL:
        # glare below the surface may be darker than a sphere of little contrast
        faint = find_faint_seed(clip, ground, sampled, radius_range=_radius_range(drop), falling=falling, fits=fits)
        if faint is not None and fits(faint):
            seed, surface = faint, surface_row(drop, clip, ground, faint)
    if surface.status != "ok":
        return _without_surface(clip)
    return _measure_entry(drop, clip, ground, (seed, surface))


def _no_sphere(drop: Drop) -> str:
    """What to check where no sphere was found: first the scale that says how large it is, where one was given."""
    pair = drop.view("side").scale_pair
    size, first = f"at least {LEAST_RADIUS_PX} px radius", ""
    if pair.air != "auto":
        size = f"about {pair.air * drop.experiment.sphere.radius_m:.0f} px radius"
        first = "scale_px_per_m and sphere.diameter_m, which say so, or "
    return NO_SPHERE.format(size, "whole in air" if drop.experiment.kind == "water_entry" else "whole", first)


def _with_polarity(drop: Drop, clip: Clip, problem: str) -> str:
    """The ``problem``, after the polarity where a sphere of the other one is seen that can be fitted."""
    given = drop.view("side").polarity
    other = OTHER[given]
    ground, sampled = flat_field_of(drop, "side", clip, other)
    falling = drop.experiment.kind != "free_flight"
    seed = find_seed(clip, ground, sampled, radius_range=_radius_range(drop), falling=falling)
    level, exposure = fitting_level(drop, ground), exposure_frames(drop, "side", clip)
    if seed is None or not fits_in_air(clip, ground, seed, level, exposure):
        return problem
    return OTHER_POLARITY.format("darker" if other == "dark" else "brighter", given, other, problem)


def _without_surface(clip: Clip) -> SideResult:
    nothing = side_columns(clip.count, [])
    problem = (
        "the free surface was not found: correct rotate, flip and polarity of views.side where the sphere does not "
        "fall downwards, else set its surface_y_px to the row of the surface"
    )
    return SideResult(nothing, NO_SCALES, NO_SURFACE, NO_RADIUS, NO_IMPACT, problem)


def _radius_range(drop: Drop) -> tuple[float, float]:
    pair = drop.view("side").scale_pair
    if pair.air == "auto":
        return 7.0, math.inf
    radius = pair.air * drop.experiment.sphere.radius_m
    return 0.85 * radius, 1.15 * radius


def _measure_entry(drop: Drop, clip: Clip, ground: Background, start: tuple[Path, SurfaceRow]) -> SideResult:
    seed, surface = start
    air, water = given_radii(drop)
    scene = SideScene(
        surface.y_px,
        band_reach(ground, surface, seed),
        drop.experiment.deformable,
        fitting_level(drop, ground),
        exposure_frames(drop, "side", clip),
        air,
        water,
    )
    track = track_side(clip, ground, seed, scene)
    if warn_of_wrong_scale(drop, pool_sightings(track.sightings, wet=False)):
        # held at a radius that it does not have, the outline of a frame would lie elsewhere than those beside it
        track = track_side(clip, ground, seed, replace(scene, radius_air=NO_RADIUS, radius_water=NO_RADIUS))
    found = drop.view("side").surface_y_px == "auto"
    if found and changes_far_above(surface, [item for item in track.sightings if not item.wet], seed.radius):
        return _without_surface(clip)
    if surface.roll_rad:
        surface = surface.at(_last_column(track.sightings, seed))
    elif track.mirror.is_surface and found:
        surface = replace(surface, y_px=track.mirror.y_px, unc_px=track.mirror.unc_px)
    scales = find_scales(drop, track.radius_air, track.radius_water, ground)
    scales = with_doubted_pixels(drop, scales, oblateness(track.sightings))
    surface = with_clipped_edge(surface, track.radius_air, ground)
    released_s = let_go(track.sightings, clip.time_s)
    sightings = without_lost_time(drop, clip, track.sightings, scales.air, released_s)
    impact = entry_impact(drop, clip, sightings, (surface, scales.air), released_s)
    axis = assumed_axis(drop, clip.opened.middle_px)
    columns = in_metres(drop, clip, sightings, (scales, surface, axis), track.check)
    t_s = clip.time_s - impact.time_s
    checked = checked_axis(drop, axis, scales, t_s, _centre_m(columns, drop, surface.roll_rad))
    if checked != axis:
        columns = in_metres(drop, clip, sightings, (scales, surface, checked), track.check)
    state_radius(columns, track.radius_air, track.radius_water)
    problem = why_no_impact(impact, "surface", drop, clip)
    if not (track.radius_air.known or track.radius_water.known):
        problem = NO_SIZE
    problem = _deformed(drop, track) or problem
    if not problem:
        warn_where_lost_below(drop, clip, sightings, surface.y_px)
        tell_idle_below(drop, clip, sightings)
    columns = dated(columns, t_s)
    if "ok" not in columns["status"] and not any(item.ok and not item.wet for item in sightings):
        problem = NOT_IN_AIR
    offset = track.check.stretch_offset
    return SideResult(columns, scales, surface, track.radius_air, impact, problem, offset, checked, released_s)


def _deformed(drop: Drop, track: SideTrack) -> str:
    """Tell of a sphere that was called rigid and is not: a problem where most of it is lost, else a warning."""
    if track.deformed is None or track.deformed.fit is None:
        return ""
    told = (
        f"sphere.material is rigid, but below the surface its stretch reaches {track.deformed.fit.stretch:.2f} (frame "
        f"{track.deformed.frame}): name its material, which may be one of your own in materials.yaml"
    )
    if track.mostly_lost:
        return told
    logger.warning(
        "%s: %s; until then its heights are those of a sphere that it is not",
        drop.name,
        told,
        extra=puts_in_doubt("rigid sphere"),
    )
    return ""


def _last_column(sightings: Sequence[Sighting], seed: Path) -> float:
    """Where the sphere was last seen in air, px: about there it meets the surface."""
    seen = [item.fit.center_x_px for item in sightings if item.ok and not item.wet and item.fit is not None]
    return seen[-1] if seen else seed.shapes[-1].x


def _centre_m(columns: dict[str, Any], drop: Drop, roll_rad: float) -> NDArray[np.float64]:
    """Heights of the centre, NaN where the frame is not ok."""
    ok = np.array([word == "ok" for word in columns["status"]])
    stretch = columns["stretch"] if drop.experiment.deformable else np.ones(len(ok))
    radius_m, tilt_deg = drop.experiment.sphere.radius_m, columns["tilt_deg"]
    depth = columns["bottom_y_px"] - columns["center_y_px"]
    bottom = columns["y_b_m"] + below_ellipsoid(depth, columns["radius_px"], stretch, tilt_deg, radius_m)
    lean_deg = tilt_deg + math.degrees(roll_rad)
    height, _ = centre_height(bottom, columns["y_b_m_unc"], stretch, columns["stretch_unc"], radius_m, lean_deg)
    return np.where(ok, height, np.nan)


def _measure_flight(drop: Drop, clip: Clip, ground: Background, seed: Path) -> SideResult:
    exposure = exposure_frames(drop, "side", clip)
    level = fitting_level(drop, ground)
    plan = air_plan(clip.shape, level=level, exposure_frames=exposure, bottom=False)
    sightings, _ = both_ways(clip, ground, seed, plan, clip.count - 1)
    radius, _ = given_radii(drop)
    seen = pool_sightings(sightings, wet=False)
    warn_of_wrong_scale(drop, seen)
    radius = radius if radius.known else seen
    scales = with_doubted_pixels(drop, find_scales(drop, radius, NO_RADIUS, ground), oblateness(sightings))
    first = next((item.fit for item in sightings if item.ok and item.fit is not None), None)
    zero = SurfaceRow(math.nan, math.nan, 0.0, math.nan, "no_edge")
    if first is not None:
        zero = SurfaceRow(first.center_y_px, 0.0, 0.0, math.nan, "ok")
    columns = in_metres(drop, clip, sightings, (scales, zero, NO_AXIS))
    columns = dated(columns, clip.time_s - clip.time_s[0])
    return SideResult(columns, scales, zero, radius, NO_IMPACT)
