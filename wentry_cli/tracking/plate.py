"""The side view of a drop on a rigid plate: the whole outline above the plate, nothing below it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import air_plan, both_ways
from wentry_cli.tracking.follow import TRUSTING, Plan, Watch, follow
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.sighting import Look, Sighting
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.tilt import Tilt
from wentry_cli.tracking.wet_radius import constrain, pool_sightings

CLEARANCE = 2.0
TOUCHES = "occluded"


@dataclass(frozen=True)
class PlateScene:
    """What is known before tracking: row of the plate (NaN: not seen), level of method, exposure, a given radius."""

    plate_px: float
    deformable: bool
    level: str
    exposure_frames: float
    radius: PooledRadius


@dataclass(frozen=True)
class PlateTrack:
    """Sightings in the order of the frames, the pooled radius, and the lowest row that the bottom reached in flight."""

    sightings: list[Sighting]
    radius: PooledRadius
    turning_px: float


def track_plate(frames: Frames, ground: Background, seed: Path, scene: PlateScene) -> PlateTrack:
    """Track a sphere that falls on a plate and rebounds.

    Before contact the radius is free and pooled; from contact on it is held, and the stretch is fitted to the outline
    above the plate. Where the plate was not seen every frame has a free radius, and the lowest row that the bottom
    reaches is where the plate must be.
    """
    seen = _flying(frames, ground, seed, scene)
    contact = next((index for index, item in enumerate(seen) if item.status == TOUCHES), len(seen))
    dry = seen[:contact]
    radius = scene.radius if scene.radius.known else pool_sightings(dry, wet=False)
    dry = constrain(dry, radius, wet=False)
    if contact < len(seen) and radius.known and dry:
        tilt = Tilt()
        plan = _above_plate(frames, scene, tilt)
        flown, first = dry, dry[-1].frame + 1

        def touching(end: int, watch: Watch) -> list[Sighting]:
            return follow(frames, ground, _path(flown, radius, scene), range(first, end), plan, watch)

        touched = touching(frames.count, Watch(tilt.hear))
        if tilt.harmful_before >= first:
            # what was seen before the tilt was known is measured again with it
            early = touching(tilt.harmful_before + 1, TRUSTING)
            touched = [*early, *touched[len(early) :]]
        dry = [*dry, *touched]
    return PlateTrack(dry, radius, max((_bottom(item) for item in dry), default=math.nan))


def _path(flown: list[Sighting], radius: PooledRadius, scene: PlateScene) -> Path:
    """The path of the last frames before contact."""
    path = Path(radius.value, stiff=not scene.deformable)
    for item in [item for item in flown if item.fit is not None and item.ok][-3:]:
        if item.fit is not None:
            path.add(item.frame, item.fit.shape)
    return path


def _bottom(item: Sighting) -> float:
    return item.fit.bottom_y_px if item.ok and item.fit is not None else -math.inf


def _flying(frames: Frames, ground: Background, seed: Path, scene: PlateScene) -> list[Sighting]:
    free = "x y" + ("" if scene.radius.known else " R") + (" stretch" if scene.deformable else "")
    seed = replace(seed, stiff=not scene.deformable)
    plan = air_plan(
        frames.shape, free=free, level=scene.level, exposure_frames=scene.exposure_frames, floor_px=scene.plate_px
    )

    def until_contact(index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        if guess.bottom_y > scene.plate_px - CLEARANCE:
            return TOUCHES
        return plan(index, guess, velocity)

    seen, _ = both_ways(frames, ground, seed, until_contact, frames.count - 1)
    return seen


def _above_plate(frames: Frames, scene: PlateScene, tilt: Tilt) -> Plan:
    free = "x y stretch" if scene.deformable else "x y"
    plan = air_plan(
        frames.shape, free=free, level=scene.level, exposure_frames=scene.exposure_frames, floor_px=scene.plate_px
    )

    def look(index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        planned = plan(index, guess, velocity)
        if isinstance(planned, str):
            return planned
        flying = guess.bottom_y < scene.plate_px - CLEARANCE
        return planned._replace(bottom=flying, tilt_deg=tilt.value, tilt_unc_deg=tilt.unc)

    return look
