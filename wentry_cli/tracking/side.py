"""The side view of a water entry: in air, through the surface, below it.

In air the whole outline gives centre, radius and stretch; the radii are pooled. While the sphere crosses the surface
only the arc below the surface band is looked at, never one contour across the waterline. Below the surface the radius
is left free wherever enough arc is seen, first in every frame, then in every sixth, pooled over the clip, and put into
all frames by their own sensitivities; frames from before the first such fit are measured again with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import air_plan, both_ways, leaves_frame, margin_of
from wentry_cli.tracking.follow import Plan, follow
from wentry_cli.tracking.prediction import Path, box_around
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius, merge_media
from wentry_cli.tracking.sighting import Look, Sighting
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_radius import constrain, pool_sightings, tells_radius

SHALLOWEST = 0.10
PILOT_FRAMES = 24
FREE_EVERY = 6
UNKNOWN_SEPARATION = 0.3
HIGHEST_SEPARATION = -0.5
DEEPEST_SEPARATION = 0.6


@dataclass(frozen=True)
class SideScene:
    """What is known of the scene before it is tracked.

    ``surface_px`` is the row of the free surface and ``band_px`` half the thickness of its dark band;
    ``exposure_frames`` the exposure over the time between frames; a radius that the user gave is not fitted.
    """

    surface_px: float
    band_px: float = 2.0
    deformable: bool = True
    level: str = "accurate"
    exposure_frames: float = 0.0
    radius_air: PooledRadius = NO_RADIUS
    radius_water: PooledRadius = NO_RADIUS

    @property
    def ceiling_px(self) -> float:
        """The first row below the surface band."""
        return self.surface_px + self.band_px + 1.0

    @property
    def floor_px(self) -> float:
        """The last row above the surface band."""
        return self.surface_px - self.band_px - 1.0


@dataclass(frozen=True)
class SideTrack:
    """Sightings in the order of the frames (frames that are missing were never reached) and the pooled radii in px."""

    sightings: list[Sighting]
    radius_air: PooledRadius
    radius_water: PooledRadius


def track_side(frames: Frames, ground: Background, seed: Path, scene: SideScene) -> SideTrack:
    """Track the sphere through the clip from a seed in air."""
    seed = replace(seed, stiff=not scene.deformable)
    plan = air_plan(
        frames.shape,
        free="x y R stretch" if scene.deformable else "x y R",
        level=scene.level,
        exposure_frames=scene.exposure_frames,
        floor_px=scene.floor_px,
    )
    dry, path = both_ways(frames, ground, seed, _until_contact(plan, scene), frames.count - 1)
    contact = next((index for index, item in enumerate(dry) if item.status == "short_arc"), None)
    entered = contact is not None and dry[contact].frame > seed.frames[0]
    dry = dry[:contact] if contact is not None and entered else dry
    air = scene.radius_air if scene.radius_air.known else pool_sightings(dry, wet=False)
    dry = constrain(dry, air, wet=False)
    if contact is None or not dry:
        return SideTrack(dry, air, air)
    path.radius = air.value if air.known else path.radius
    first = dry[-1].frame + 1
    wet, water = track_wet(frames, ground, path, range(first, frames.count), scene)
    if scene.radius_water.known or not water.known:
        return SideTrack([*dry, *wet], air, scene.radius_water if scene.radius_water.known else air)
    merged_air, merged_water = merge_media(air, water)
    if not scene.radius_air.known:
        dry, air = constrain(dry, merged_air, wet=False), merged_air
    return SideTrack([*dry, *constrain(wet, merged_water, wet=True)], air, merged_water)


def _until_contact(plan: Plan, scene: SideScene) -> Plan:
    """Look as in air until the expected bottom reaches the surface band; ``short_arc`` marks the first frame after."""

    def watched(index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        if guess.bottom_y > scene.surface_px:
            return "short_arc"
        return plan(index, guess, velocity)

    return watched


class WetPlan:
    """How to look at the sphere below the surface; remembers the separation line and how many radii were free."""

    def __init__(self, scene: SideScene, frame_shape: tuple[int, int], radius: PooledRadius) -> None:
        """Start below the surface; a known ``radius`` is not fitted again."""
        self.scene = scene
        self.frame_shape = frame_shape
        self.fixed = radius.known
        self.free_fits = 0
        self.sees_enough = False
        self.separation = math.nan

    def learn(self, sighting: Sighting) -> None:
        """Take what the next frame's look depends on from a measured frame."""
        fit = sighting.fit
        if fit is None or not sighting.ok:
            return
        self.sees_enough = tells_radius(fit)
        self.free_fits += sighting.free_radius
        line = sighting.separation
        if line is not None and line.status == "ok":
            self.separation = (line.y_px - fit.center_y_px) / (fit.radius_px / fit.stretch**2)

    def top_row(self, guess: EllipseShape) -> float:
        """The row above which the outline may be cavity, splash or surface."""
        line = self.separation + 0.06 if math.isfinite(self.separation) else UNKNOWN_SEPARATION
        line = min(max(line, HIGHEST_SEPARATION), DEEPEST_SEPARATION)
        return max(guess.y + line * guess.semi_along, self.scene.ceiling_px)

    def __call__(self, index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        """Decide on one frame."""
        if guess.bottom_y < self.scene.ceiling_px + SHALLOWEST * guess.radius:
            return "short_arc"
        if guess.y > self.frame_shape[0] or leaves_frame(guess, self.frame_shape):
            return "out_of_frame"
        pilot = self.free_fits < PILOT_FRAMES or index % FREE_EVERY == 0
        free_radius = pilot and self.sees_enough and not self.fixed
        free = "x y" + (" R" if free_radius else "") + (" stretch" if self.scene.deformable else "")
        box = box_around(guess, margin_of(guess.radius))
        top = max(box[1], self.scene.ceiling_px)
        exposure = self.scene.exposure_frames
        return Look(
            (box[0], top, box[2], box[3]),
            free,
            self.top_row(guess),
            (velocity[0] * exposure, velocity[1] * exposure),
            self.scene.level,
            separation=True,
        )


def track_wet(
    frames: Frames, ground: Background, path: Path, order: range, scene: SideScene
) -> tuple[list[Sighting], PooledRadius]:
    """Track below the surface from a path at the surface; returns the sightings and the pooled free radius."""
    plan = WetPlan(scene, frames.shape, scene.radius_water)
    if scene.radius_water.known:
        path.radius = scene.radius_water.value
    seen = _wet(follow(frames, ground, path, order, plan, learn=plan.learn, wet=True))
    water = pool_sightings(seen, wet=True)
    if not water.known:
        return seen, water
    return _again_with(seen, water, (frames, ground, scene)), water


def _wet(sightings: list[Sighting]) -> list[Sighting]:
    return [replace(item, wet=True) for item in sightings]


def _again_with(
    seen: list[Sighting], water: PooledRadius, setting: tuple[Frames, Background, SideScene]
) -> list[Sighting]:
    """Measure the frames before the first free radius again, backwards from there, with the radius now known."""
    frames, ground, scene = setting
    free = [index for index, item in enumerate(seen) if item.ok and item.free_radius]
    start = free[0]
    after = [item for item in seen[start : start + 12] if item.ok and item.fit is not None][:3]
    path = Path(water.value, stiff=not scene.deformable)
    for item in reversed(after):
        if item.fit is not None:
            path.add(item.frame, item.fit.shape)
    plan = WetPlan(scene, frames.shape, water)
    plan.learn(seen[start])
    order = [item.frame for item in reversed(seen[:start])]
    again = _wet(follow(frames, ground, path, order, plan, learn=plan.learn))
    reached = {item.frame: item for item in again}
    better = [reached.get(item.frame, item) for item in seen[:start]]
    return [*better, *seen[start:]]
