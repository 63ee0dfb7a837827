"""The side view of a water entry: in air, through the surface, below it.

In air the whole outline gives centre, radius and stretch; the radii are pooled. While the sphere crosses the surface
only the arc below the surface band is looked at, never one contour across the waterline. Below the surface the radius
is left free wherever enough arc is seen, first in every frame, then in every sixth, pooled over the clip, and put into
all frames by their own sensitivities; frames from before the first such fit are measured again with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wentry_cli.contours.departure import Departure, Shape
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import air_plan, both_ways
from wentry_cli.tracking.follow import GIVEN_UP_AFTER, Plan, Watch, follow
from wentry_cli.tracking.mirror import NO_MIRROR, Mirror, find_mirror, stands_out, without_rising
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius, merge_media
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck, check_shape, corrected_radius, learn_departure
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_plan import SideScene, WetPlan
from wentry_cli.tracking.wet_radius import constrain, pool_sightings

PILOT_FRAMES = 24
UNKNOWN_WALL = 0.04
HIDDEN_RADII = 4.0
DEFORMED, LEAST_DEFORMED = 0.03, 3
BRIGHTER = 0.15  # of the ground: more is not the sphere that fell


@dataclass(frozen=True)
class SideTrack:
    """Sightings in the order of the frames, the pooled radii in px, and how far the sphere is from an ellipse.

    Frames that are missing were never reached. ``deformed`` is the stretch, less 1, of a sphere that was called
    rigid and is not; 0 where it keeps its shape.
    """

    sightings: list[Sighting]
    radius_air: PooledRadius
    radius_water: PooledRadius
    check: ShapeCheck = NO_CHECK
    mirror: Mirror = NO_MIRROR
    deformed: float = 0.0


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
    if contact is not None and any(item.ok for item in dry[:contact]):
        dry = dry[:contact]
    air = scene.radius_air if scene.radius_air.known else pool_sightings(dry, wet=False)
    dry = constrain(dry, air, wet=False)
    if contact is None or not dry:
        return SideTrack(dry, air, air)
    path.radius = air.value if air.known else path.radius
    shape = learn_departure(frames, ground, dry)
    if shape.waves:
        dry = _look_again(frames, ground, dry, plan, shape.waves)
        air = scene.radius_air if scene.radius_air.known else pool_sightings(dry, wet=False)
        dry = constrain(dry, air, wet=False)
    mirror = find_mirror(frames, ground, dry, scene.surface_px, scene.band_px[1], scene.level)
    below = WetTracker(frames, ground, scene, dry, shape=shape, mirror=mirror)
    wet, water, check = below.track(path, range(dry[-1].frame + 1, frames.count))
    if not scene.radius_air.known:
        air, water = merge_media(air, water)
        dry = constrain(dry, air, wet=False)
    if not water.known:
        # there may or may not be a wall before the water
        water = replace(air, unc=max(air.unc, UNKNOWN_WALL * air.value))
    seen = without_rising(below.settle(wet, water), mirror)
    deformed = 0.0 if scene.deformable or _mostly_ok(seen) else below.deformation(water)
    return SideTrack([*dry, *seen], air, water, check, mirror, deformed)


def _mostly_ok(seen: list[Sighting]) -> bool:
    return sum(item.ok for item in seen) > 0.5 * len(seen)


def _until_contact(plan: Plan, scene: SideScene) -> Plan:
    """Look as in air until the expected bottom reaches the surface band; ``short_arc`` marks the first frame after."""

    def watched(index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        if guess.bottom_y > scene.surface_px:
            return "short_arc"
        return plan(index, guess, velocity)

    return watched


def _look_again(
    frames: Frames, ground: Background, dry: list[Sighting], plan: Plan, departure: Departure
) -> list[Sighting]:
    """Measure the frames in air again, now that it is known how the sphere departs from an ellipse."""
    again = []
    for number, item in enumerate(dry):
        near = [other for other in dry[max(0, number - 1) : number + 2] if other.ok and other.fit is not None]
        if not item.ok or item.fit is None or len(near) < 2:
            again.append(item)
            continue
        path = Path(item.fit.radius_px)
        for other in near:
            assert other.fit is not None
            path.add(other.frame, other.fit.shape)
        look = plan(item.frame, item.fit.shape, path.velocity())
        new = (
            item
            if isinstance(look, str)
            else sight(frames, item.frame, ground, item.fit.shape, replace(look, departure=departure))
        )
        again.append(new if new.ok else item)
    return again


class WetTracker:
    """Tracks below the surface: first with a free radius, then with that of the first frames, then with that of all."""

    def __init__(
        self,
        frames: Frames,
        ground: Background,
        scene: SideScene,
        dry: list[Sighting],
        *,
        shape: Shape,
        mirror: Mirror,
    ) -> None:
        """Take the clip, the sightings in air, how they say that the sphere departs from an ellipse, and its image."""
        self.frames, self.ground, self.scene, self.dry, self.shape = frames, ground, scene, dry, shape
        self.plan = WetPlan(scene, frames.shape, known=scene.radius_water.known, departure=shape.waves)
        self.mirror = mirror
        self.check = NO_CHECK
        self.darkness = float(np.median([item.inside for item in dry if item.ok])) if dry else math.nan

    def track(self, path: Path, order: range) -> tuple[list[Sighting], PooledRadius, ShapeCheck]:
        """Follow the path below the surface; returns sightings, the pooled radius, and what the shape adds to it."""
        if self.scene.radius_water.known:
            path.radius = self.scene.radius_water.value

        def learn(sighting: Sighting) -> None:
            self.plan.learn(sighting)
            if not self.plan.known and len(self.plan.pilot) >= PILOT_FRAMES:
                pooled = self._radius(self.plan.pilot)
                self.plan.known = pooled.known
                path.radius = pooled.value if pooled.known else path.radius

        start = replace(path)
        seen = self._follow(path, order, self._watch(path, learn))
        water = self.scene.radius_water if self.scene.radius_water.known else self._radius(seen)
        if not self.plan.known and water.known:
            # too few frames told the radius on the way: what they told together serves all of them
            start.radius = water.value
            self.plan = self.plan.restarted()
            seen = self._follow(start, order, self._watch(start, self.plan.learn))
            again = self._radius(seen)
            water = again if again.count >= water.count else water
        return seen, water, self.check

    def _watch(self, path: Path, learn: Callable[[Sighting], None]) -> Watch:
        """Search for a lost sphere for as long as splash and mirror image may hide it: a fall by two diameters."""
        patience = GIVEN_UP_AFTER
        if self._speed() > 0.0:
            patience = max(patience, round(HIDDEN_RADII * path.radius / self._speed()))
        return Watch(learn, self._believable, self.scene.ceiling_px, patience)

    def _speed(self) -> float:
        """Of the bottom in air, px per frame; 0 where it is not known."""
        good = [(item.frame, item.fit.bottom_y_px) for item in self.dry if item.ok and item.fit is not None]
        return (good[-1][1] - good[0][1]) / (good[-1][0] - good[0][0]) if len(good) > 1 else 0.0

    def _follow(self, path: Path, order: range, watch: Watch) -> list[Sighting]:
        seen = follow(self.frames, self.ground, path, order, self.plan, watch)
        return [replace(item, wet=True) for item in seen]

    def _believable(self, sighting: Sighting) -> bool:
        """Whether this can be the sphere: no deeper than a fall without water, and as dark within as it was in air.

        Its mirror image in the surface, seen from below, is neither.
        """
        good = [item for item in self.dry if item.ok and item.fit is not None]
        if len(good) < 2 or sighting.fit is None:
            return True
        if sighting.inside > self.darkness + BRIGHTER or stands_out(sighting, self.mirror):
            return False
        last = good[-1].fit
        assert last is not None
        falls = self._speed() * (sighting.frame - good[-1].frame)
        return sighting.fit.bottom_y_px < last.bottom_y_px + 1.1 * falls + 3.0

    def _radius(self, seen: list[Sighting]) -> PooledRadius:
        pooled = pool_sightings(seen, wet=True)
        if not pooled.known:
            return NO_RADIUS
        if self.scene.deformable:
            self.check = check_shape(self.frames, self.ground, self.dry, seen, self.scene.level, shape=self.shape)
        return corrected_radius(pooled, self.check)

    def deformation(self, water: PooledRadius) -> float:
        """How far λ departs from 1 in the first frames below the surface, were it left free; 0 where it does not."""
        path = Path(water.value)
        for item in [item for item in self.dry if item.ok][-3:]:
            assert item.fit is not None
            path.add(item.frame, item.fit.shape)
        soft = replace(self.scene, deformable=True, radius_water=water)
        plan = WetPlan(soft, self.frames.shape, known=True)
        first = self.dry[-1].frame + 1
        order = range(first, min(first + PILOT_FRAMES, self.frames.count))
        seen = follow(self.frames, self.ground, path, order, plan, Watch(plan.learn, self._believable))
        off = [item.fit.stretch - 1.0 for item in seen if item.ok and item.fit is not None]
        largest = max(off, key=abs, default=0.0)
        return largest if abs(largest) > DEFORMED and len(off) >= LEAST_DEFORMED else 0.0

    def settle(self, seen: list[Sighting], water: PooledRadius) -> list[Sighting]:
        """Give all sightings the final radius.

        What was seen before the radius was known, or before a tilt was, is measured again, backwards from there, with
        both held; the rest moves by its own sensitivity to the last digits of the radius.
        """
        last = self.plan.pilot[-1].frame if self.plan.pilot and not self.scene.radius_water.known else -1
        last = max(last, self.plan.tilt.harmful_before)
        start = next((index for index, item in enumerate(seen) if item.frame > last), len(seen))
        after = [item for item in seen[max(0, start - 1) : start + 12] if item.ok and item.fit is not None][:3]
        if start == 0 or not after:
            return constrain(seen, water, wet=True)
        path = Path(water.value, stiff=not self.scene.deformable)
        plan = self.plan.restarted()
        for item in reversed(constrain(after, water, wet=True)):
            if item.fit is not None:
                path.add(item.frame, item.fit.shape)
            plan.learn(item)
        order = [item.frame for item in reversed(seen[:start])]
        again = follow(self.frames, self.ground, path, order, plan, Watch(plan.learn, self._believable))
        reached = {item.frame: replace(item, wet=True) for item in again}
        early = [reached.get(item.frame, Sighting(item.frame, "poor_fit", wet=True)) for item in seen[:start]]
        return constrain([*early, *seen[start:]], water, wet=True)
