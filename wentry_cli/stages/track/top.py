"""The top view of one drop, from its recording to the columns of top.csv and its row of geometry.csv."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.imaging.background import Background
from wentry_cli.kinematics.centre import centre_height
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.exposure import exposure_frames, fitting_level
from wentry_cli.stages.track.rows import fit_columns, frame_status
from wentry_cli.stages.track.side_result import SideResult
from wentry_cli.tables import vouched
from wentry_cli.tracking.scale import EDGE_MODEL_PX, pool_radius, scale_from_radius
from wentry_cli.tracking.seed import find_faint_seed, find_seed
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.top import (
    TopScale,
    magnification_at,
    magnification_change,
    scale_from_approach,
    top_stretch,
    track_top,
)
from wentry_cli.tracking.top_depth import (
    Approach,
    Height,
    TopCamera,
    between_frames,
    fall_height,
    find_approach,
    find_camera,
    find_turn,
)

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop
    from wentry_cli.config.models import View

TOP_COLUMNS = ("center_x_px", "center_y_px", "radius_px", "gated_fraction", "residual_rms_px")
SIDE_COLUMNS = ("t_s", "y_b_m", "y_b_m_unc", "stretch", "stretch_unc")
SAID_SPEED_UNC = 0.04
FEWEST_AT_REST = 3
ANY_SPEED = (4.0, 2.0)
CLOCK_FRAMES, CLEARLY = 6.0, 5.0  # frames and standard uncertainties, beyond which together the clocks differ
logger = logging.getLogger(__name__)

Radii = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class Entry:
    """Impact (s, camera clock) and its uncertainty, height of the sphere in every frame, camera and scale."""

    impact_s: tuple[float, float]
    height: Height
    camera: TopCamera
    scale: TopScale


@dataclass(frozen=True)
class TopResult:
    """What the top view gave: columns of top.csv, scale, radius of the undeformed sphere in px, impact and unc in s."""

    columns: dict[str, Any]
    scale: TopScale
    radius_px: float
    impact_s: tuple[float, float]
    problem: str = ""


def measure_top(drop: Drop, clip: Clip, ground: Background, sampled: list[int], side: SideResult | None) -> TopResult:
    """Track the top view; with a side view its impact time and depth are used, else the rise of the radius."""
    sizes = _radius_range(drop)
    seed = find_seed(clip, ground, sampled, radius_range=sizes)
    seed = seed or find_faint_seed(clip, ground, sampled, radius_range=sizes)
    clip.release()
    sightings: list[Sighting] = []
    if seed is not None:
        level, exposure = fitting_level(drop, ground), exposure_frames(drop, "top", clip)
        sightings = track_top(clip, ground, seed, level=level, exposure_frames=exposure)
    fits = fit_columns(clip.count, sightings)
    entry = _flight(drop, clip, side, fits) if drop.experiment.kind == "free_flight" else _entry(drop, clip, side, fits)
    radius_m = drop.experiment.sphere.radius_m
    columns: dict[str, Any] = {"frame": np.arange(clip.count), "t_s": clip.time_s - entry.impact_s[0]}
    columns |= {name: fits[name] for name in TOP_COLUMNS} | {"radius_px_unc_random": fits["radius_px_unc"]}
    columns["radius_px_unc"] = np.hypot(fits["radius_px_unc"], EDGE_MODEL_PX)
    status = frame_status(clip.count, sightings)
    falling, ok = columns["t_s"] < 0.0, np.array(status) == "ok"
    stretch, stretch_unc, random = _stretch(fits, entry, radius_m, falling & ok)
    if side is not None:
        stretch_unc = np.hypot(stretch_unc, side.shape_offset)
    columns |= {"stretch": stretch, "stretch_unc": stretch_unc, "stretch_unc_random": random, "status": status}
    columns["status"] = vouched("top", columns)
    if drop.experiment.kind != "free_flight":
        _warn_where_unseen_in_air(drop, falling, ok)
    said = "" if drop.view("top").scale_pair.air == "auto" else "scale_px_per_m, "
    problem = "" if seed is not None else f"no sphere was found: check {said}source, roi_px and polarity of views.top"
    if not problem and not math.isfinite(entry.impact_s[0]):
        problem = "the moment of impact is not seen from above: film the side too, or take a clip that holds the impact"
    measured = np.isfinite(fits["radius_px"]).any() and math.isfinite(entry.scale.px_m)
    if not problem and measured and not np.isfinite(stretch).any():
        problem = (
            "no sphere can be stretched as seen from above: check scale_px_per_m and camera_distance_m of views.top"
        )
    return TopResult(columns, entry.scale, entry.scale.px_m * radius_m, entry.impact_s, problem)


def _stretch(
    fits: dict[str, NDArray[np.float64]], entry: Entry, radius_m: float, falling: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """λ of every frame, its uncertainty, and what of that differs by chance from frame to frame.

    Where the sphere is seen while it is ``falling`` and λ is 1, that tells what edge, scale, zero of the heights and
    distance of the camera do to λ in all frames. How far λ is from 1 counts then, and what they do to a frame beyond
    that, where it is less than what is said of them leaves open.
    """
    magnification = magnification_at(entry.height, entry.camera)
    exact = np.zeros_like(fits["radius_px"])
    stretch, common = top_stretch(fits["radius_px"], exact, entry.scale, radius_m, magnification)
    random = stretch * fits["radius_px_unc"] / fits["radius_px"]
    resting = falling & np.isfinite(stretch)
    count = np.count_nonzero(resting)
    if count < FEWEST_AT_REST:
        return stretch, np.hypot(random, common), random
    off = math.hypot(np.mean(stretch[resting]) - 1.0, np.mean(random[resting]) / math.sqrt(count))
    change = stretch * magnification_change(entry.height, entry.camera, resting)
    return stretch, np.hypot(random, np.hypot(np.fmin(common, change), stretch * off)), random


def _warn_where_unseen_in_air(drop: Drop, falling: NDArray[np.bool_], ok: NDArray[np.bool_]) -> None:
    """Warn where frames are measured, but none of those in which the sphere still falls."""
    if np.sum(falling) >= FEWEST_AT_REST and ok.any() and not ok[falling].any():
        logger.warning(
            f"{drop.name}: seen from above no sphere is found in the {np.sum(falling)} frames before impact, so what "
            "is found after it may be something else: check polarity, roi_px and offset_s of views.top",
            extra=puts_in_doubt("sphere in the top view"),
        )


def _radius_range(drop: Drop) -> tuple[float, float]:
    scale = drop.view("top").scale_pair.air
    if scale == "auto":
        return 7.0, math.inf
    radius = scale * drop.experiment.sphere.radius_m
    return 0.75 * radius, 1.4 * radius


def _entry(drop: Drop, clip: Clip, side: SideResult | None, fits: dict[str, NDArray[np.float64]]) -> Entry:
    """Impact, height of the sphere, distance of the camera and scale: from the side view, else from this one alone."""
    view, sphere = drop.view("top"), drop.experiment.sphere
    radii = (fits["radius_px"], fits["radius_px_unc"])
    camera, given = _given_camera(view), _given_scale(drop)
    impact, speed = _side_impact(side), _said_speed(drop, side)
    if not math.isfinite(impact[0]):
        impact, speed = _own_impact(drop, clip.time_s, radii, speed)
    elif drop.experiment.deformable:
        _compare_clocks(drop, clip.time_s, radii[0], impact)
    t_s = clip.time_s - impact[0]
    fall = fall_height(t_s, speed, sphere.radius_m, impact_unc_s=impact[1])
    height, known = _height(side, clip.time_s, fall, sphere.radius_m)
    if camera is None:
        known = np.where(np.isfinite(known), known, np.where(t_s < 0, 1.0, np.nan))
        px_m = 1.0 if given is None else given.px_m
        ratio = px_m * sphere.radius_m * known / radii[0]
        camera = find_camera(height, ratio, ratio * radii[1] / radii[0], scale_known=given is not None)
    scale = given
    if scale is None:
        found = scale_from_approach(t_s, *radii, sphere.radius_m, camera.distance_m)
        diameter = sphere.diameter_m_unc / sphere.diameter_m
        scale = TopScale(found.px_m, math.hypot(found.unc_px_m, found.px_m * diameter), found.source)
    return Entry(impact, height, camera, scale)


def _compare_clocks(
    drop: Drop, time_s: NDArray[np.float64], radius_px: NDArray[np.float64], impact: tuple[float, float]
) -> None:
    """Warn where a soft sphere spreads, seen from above, clearly at another time than that of impact by the side view.

    It spreads from the first frames after impact on; those that the splash hides tell it less well. Nothing is said
    where the clip does not show the sphere before it spreads.
    """
    turn, unc = find_turn(time_s, radius_px)
    late, frame = turn - impact[0], float(np.median(np.diff(time_s)))
    before = np.count_nonzero(np.isfinite(radius_px) & (time_s < turn - frame))
    if before < FEWEST_AT_REST or not abs(late) > CLOCK_FRAMES * frame + CLEARLY * math.hypot(unc, impact[1]):
        return
    when = "after" if late > 0 else "before"
    logger.warning(
        f"{drop.name}: seen from above the sphere spreads {1e3 * abs(late):.1f} ms {when} the moment of impact that "
        "the side view shows: check offset_s and fps of views.top; what both views tell together is wrong until then",
        extra=puts_in_doubt("clock of the top view"),
    )


def _flight(drop: Drop, clip: Clip, side: SideResult | None, fits: dict[str, NDArray[np.float64]]) -> Entry:
    """A flight across the view: time from the first frame (of the leading view), one scale, no surface to reach."""
    start = float(clip.time_s[0]) if side is None else 0.0
    level = np.zeros(clip.count)
    scale = _given_scale(drop)
    if scale is None:
        sphere = drop.experiment.sphere
        radius = pool_radius(fits["radius_px"], fits["radius_px_unc"])
        scale = TopScale(*scale_from_radius(radius, sphere.diameter_m, sphere.diameter_m_unc), "diameter")
    return Entry((start, 0.0), Height(level, level), TopCamera(0.0, 0.0, "unknown"), scale)


def _given_camera(view: View) -> TopCamera | None:
    distance = view.camera_distance_m
    return None if distance is None else TopCamera(1.0 / distance, view.camera_distance_m_unc / distance**2, "given")


def _given_scale(drop: Drop) -> TopScale | None:
    view = drop.view("top")
    given = view.scale_pair.air
    return None if given == "auto" else TopScale(float(given), view.scale_px_per_m_unc, "given")


def _side_impact(side: SideResult | None) -> tuple[float, float]:
    return (math.nan, math.nan) if side is None else (side.impact.time_s, side.impact.time_unc_s)


def _said_speed(drop: Drop, side: SideResult | None) -> tuple[float, float]:
    """Impact speed and uncertainty, m/s: seen from the side, else as configured, else any of a laboratory's drops."""
    if side is not None and math.isfinite(side.impact.speed_px_s) and side.scales.air > 0:
        return side.impact.speed_px_s / side.scales.air, side.impact.speed_unc_px_s / side.scales.air
    said = drop.experiment.drop
    if said.impact_speed_m_s is not None:
        return said.impact_speed_m_s, said.impact_speed_m_s_unc or SAID_SPEED_UNC * said.impact_speed_m_s
    if said.height_m is not None:
        speed = math.sqrt(2.0 * drop.experiment.gravity_m_s2 * said.height_m)
        return speed, speed * math.hypot(SAID_SPEED_UNC, 0.5 * said.height_m_unc / said.height_m)
    return ANY_SPEED


def _own_impact(
    drop: Drop, time_s: NDArray[np.float64], radii: Radii, speed: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Impact and speed without a side view: where the radius turns, and where it is that of a sphere that touches."""
    turn = find_turn(time_s, radii[0])
    view, sphere = drop.view("top"), drop.experiment.sphere
    distance = view.camera_distance_m
    if distance is None or not math.isfinite(turn[0]):
        return turn, speed
    given = _given_scale(drop)
    scale = (math.nan, math.nan)
    if given is not None:
        scale = given.px_m, math.hypot(given.unc_px_m / given.px_m, sphere.diameter_m_unc / sphere.diameter_m)
    start = turn[0] - turn[1]
    seen = find_approach(time_s - start, *radii, sphere.radius_m, distance, scale)
    seen = _with_distance(seen, sphere.radius_m, distance, view.camera_distance_m_unc)
    if math.isfinite(seen.contact_unc_s):
        weights = np.array([turn[1], seen.contact_unc_s]) ** -2.0
        at = float(weights @ [turn[0], start + seen.contact_s]) / float(weights.sum())
        turn = at, float(weights.sum()) ** -0.5
    return turn, (seen.speed_m_s, seen.speed_unc_m_s) if math.isfinite(seen.speed_m_s) else speed


def _with_distance(seen: Approach, radius_m: float, distance_m: float, unc_m: float) -> Approach:
    """An error of the distance makes the sphere faster in proportion; at contact it acts by the sphere's height."""
    speed = seen.speed_m_s * unc_m / (distance_m - radius_m)
    contact = radius_m / seen.speed_m_s * unc_m / distance_m
    return replace(
        seen,
        speed_unc_m_s=math.hypot(seen.speed_unc_m_s, speed),
        contact_unc_s=math.hypot(seen.contact_unc_s, contact),
    )


def _height(
    side: SideResult | None, time_s: NDArray[np.float64], fall: Height, radius_m: float
) -> tuple[Height, NDArray[np.float64]]:
    """Height of the centre at the times of the top view, and the stretch, as seen from the side where they were."""
    unknown = np.full(time_s.size, np.nan)
    if side is None or not set(SIDE_COLUMNS) <= side.columns.keys():
        return fall, unknown  # not filmed, or nothing was found there
    table = {name: np.asarray(side.columns[name], np.float64) for name in SIDE_COLUMNS}
    stretch = np.where(np.isfinite(table["stretch"]), table["stretch"], 1.0)
    doubt = np.nan_to_num(table["stretch_unc"])
    zero = side.surface.unc_px / side.scales.air
    own = np.sqrt(np.maximum(table["y_b_m_unc"] ** 2 - zero**2, 0.0))
    height, unc = centre_height(table["y_b_m"], own, stretch, doubt, radius_m)
    t_side = table["t_s"] + side.impact.time_s
    good = np.isfinite(height) & np.isfinite(unc) & np.isfinite(t_side)
    if np.count_nonzero(good) < 2:
        return fall, unknown
    inside = (time_s >= t_side[good][0]) & (time_s <= t_side[good][-1])
    seen, gap = between_frames(t_side[good], Height(height[good], unc[good], zero), time_s)
    value, spread = np.where(inside, seen.value_m, fall.value_m), np.where(inside, seen.unc_m, fall.unc_m)
    return Height(value, spread, zero), np.where(inside & ~gap, np.interp(time_s, t_side[good], stretch[good]), np.nan)
