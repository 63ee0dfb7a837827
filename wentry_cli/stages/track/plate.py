"""A drop on a rigid surface, seen from the side: y = 0 is the plate, and there is no water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.axis import NO_AXIS
from wentry_cli.stages.track.exposure import exposure_frames, fitting_level
from wentry_cli.stages.track.impact import best_bottom, entry_impact
from wentry_cli.stages.track.lost_frames import without_lost_time
from wentry_cli.stages.track.roundness import oblateness, with_doubted_pixels
from wentry_cli.stages.track.scales import find_scales, given_radii, with_clipped_edge
from wentry_cli.stages.track.side_result import SideResult, dated, in_metres, state_radius, why_no_impact
from wentry_cli.tracking.held import let_go
from wentry_cli.tracking.plate import PlateScene, track_plate
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import NO_RADIUS
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

# A sphere that rings from its release stays within a few per cent of round.
FAR_FROM_ROUND, HIGH, FEW_FRAMES = 0.1, 0.2, 3
LAST_FRAMES = 4


def measure_plate(drop: Drop, clip: Clip, ground: Background, start: tuple[Path, SurfaceRow]) -> SideResult:
    """Track a drop onto a plate from its seed and the row of the plate, ``start``."""
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
    flying = [item for item in track.sightings if item.free_fit is not None or best_bottom(item)[2] > 0]
    before = [item for item in flying if item.frame < _first_contact(track.sightings, plate.y_px)]
    scales = with_doubted_pixels(drop, find_scales(drop, track.radius, NO_RADIUS, ground), oblateness(before))
    plate = with_clipped_edge(plate, track.radius, ground)
    released_s = let_go(before, clip.time_s)
    timed = without_lost_time(drop, clip, before, scales.air, released_s)
    impact = entry_impact(drop, clip, timed, (plate, scales.air), released_s)
    by_frame = {item.frame: item for item in timed}
    sightings = [by_frame.get(item.frame, item) for item in track.sightings]
    columns = in_metres(drop, clip, sightings, (scales, plate, NO_AXIS))
    state_radius(columns, track.radius, NO_RADIUS)
    columns = dated(columns, clip.time_s - impact.time_s)
    problem = problem or why_no_impact(impact, "plate", drop, clip)
    if not problem and _deforms_in_flight(columns, drop.experiment.sphere.radius_m):
        problem = "the sphere deforms long before it meets the plate: check kind and views.side.surface_y_px"
    return SideResult(columns, scales, plate, track.radius, impact, problem, released_s=released_s)


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
