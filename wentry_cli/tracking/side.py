"""The side view of a water entry: in air, through the surface, below it.

In air the whole outline gives centre, radius and stretch; the radii are pooled. While the sphere crosses the surface
only the arc below the surface band is looked at, never one contour across the waterline. Below the surface the radius
is left free wherever enough arc is seen, first in every frame, then in every sixth, pooled over the clip, and put into
all frames by their own sensitivities; frames from before the first such fit are measured again with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from wentry_cli.contours.departure import NONE, Departure
from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import air_plan, both_ways, leaves_frame, margin_of
from wentry_cli.tracking.follow import Plan, Watch, follow
from wentry_cli.tracking.prediction import Path, box_around
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius, merge_media
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck, check_shape, corrected_radius, learn_departure
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_radius import constrain, pool_sightings, tells_radius

SHALLOWEST = 0.10
PILOT_FRAMES = 24
FREE_EVERY = 6
UNKNOWN_SEPARATION = 0.3
LEAST_OBLATE = 0.05
WORST_TILT = 2.0
SMALLEST_TILT = 0.3
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
    """Sightings in the order of the frames, the pooled radii in px, and how far the sphere is from an ellipse.

    Frames that are missing were never reached.
    """

    sightings: list[Sighting]
    radius_air: PooledRadius
    radius_water: PooledRadius
    check: ShapeCheck = NO_CHECK


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
    departure = learn_departure(frames, ground, dry)
    if departure:
        dry = _look_again(frames, ground, dry, plan, departure)
        air = scene.radius_air if scene.radius_air.known else pool_sightings(dry, wet=False)
        dry = constrain(dry, air, wet=False)
    below = WetTracker(frames, ground, scene, dry, departure)
    wet, water, check = below.track(path, range(dry[-1].frame + 1, frames.count))
    if not scene.radius_air.known:
        air, water = merge_media(air, water)
        dry = constrain(dry, air, wet=False)
    water = water if water.known else air
    return SideTrack([*dry, *below.settle(wet, water)], air, water, check)


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


class Tilt:
    """The tilt of the ellipse in degrees, pooled over the fits that left it free; 0 until it is significant."""

    def __init__(self) -> None:
        """Start upright."""
        self.weight = self.total = 0.0

    def add(self, fit: SilhouetteFit | None) -> None:
        """Take another fit into account, if it tells a tilt."""
        if fit is not None and math.isfinite(fit.tilt_unc_deg) and fit.tilt_unc_deg < WORST_TILT:
            weight = 1.0 / math.hypot(fit.tilt_unc_deg, 0.1) ** 2
            self.weight += weight
            self.total += weight * fit.tilt_deg

    @property
    def value(self) -> float:
        """The tilt to hold."""
        if self.weight == 0.0:
            return 0.0
        tilt = self.total / self.weight
        return tilt if abs(tilt) > max(SMALLEST_TILT, 4.0 / math.sqrt(self.weight)) else 0.0


class WetPlan:
    """How to look at the sphere below the surface.

    Remembers the separation line, and leaves the radius free as long as it is unknown: ``pilot`` sightings are
    collected until there are enough of them.
    """

    def __init__(
        self, scene: SideScene, frame_shape: tuple[int, int], *, known: bool, departure: Departure = NONE
    ) -> None:
        """Start below the surface; ``known`` tells that the radius of the path is right."""
        self.departure = departure
        self.scene = scene
        self.frame_shape = frame_shape
        self.known = known
        self.again = not scene.radius_water.known
        self.pilot: list[Sighting] = []
        self.sees_enough = False
        self.separation = math.nan
        self.tilt = Tilt()

    def learn(self, sighting: Sighting) -> None:
        """Take what the next frame's look depends on from a measured frame."""
        fit = sighting.fit
        if fit is None or not sighting.ok:
            return
        self.sees_enough = tells_radius(fit)
        self.tilt.add(sighting.free_fit)
        if not self.known and sighting.free_fit is not None:
            self.pilot.append(replace(sighting, wet=True))
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
        if guess.bottom_y > self.frame_shape[0] - 2 or leaves_frame(guess, self.frame_shape):
            return "out_of_frame"
        piloting = self.sees_enough and not self.known
        free = "x y" + (" R" if piloting else "") + (" stretch" if self.scene.deformable else "")
        if piloting and self.scene.deformable and abs(guess.stretch - 1.0) > LEAST_OBLATE:
            free += " tilt"
        box = box_around(guess, margin_of(guess.radius))
        exposure = self.scene.exposure_frames
        return Look(
            (box[0], max(box[1], self.scene.ceiling_px), box[2], box[3]),
            free,
            self.top_row(guess),
            (velocity[0] * exposure, velocity[1] * exposure),
            self.scene.level,
            separation=True,
            also_free=self.again and self.known and index % FREE_EVERY == 0,
            tilt_deg=self.tilt.value,
            departure=self.departure,
        )


class WetTracker:
    """Tracks below the surface: first with a free radius, then with that of the first frames, then with that of all."""

    def __init__(
        self, frames: Frames, ground: Background, scene: SideScene, dry: list[Sighting], departure: Departure
    ) -> None:
        """Take the clip, the sightings in air, and how they say that the sphere departs from an ellipse."""
        self.frames, self.ground, self.scene, self.dry, self.departure = frames, ground, scene, dry, departure
        self.plan = WetPlan(scene, frames.shape, known=scene.radius_water.known, departure=departure)
        self.check = NO_CHECK

    def track(self, path: Path, order: range) -> tuple[list[Sighting], PooledRadius, ShapeCheck]:
        """Follow the path below the surface; returns sightings, the pooled radius, and what the shape adds to it."""
        if self.scene.radius_water.known:
            path.radius = self.scene.radius_water.value

        def learn(sighting: Sighting) -> None:
            self.plan.learn(sighting)
            if not self.plan.known and len(self.plan.pilot) >= PILOT_FRAMES:
                self.plan.known = True
                path.radius = self._radius(self.plan.pilot).value

        watch = Watch(learn, self._reachable, wet=True)
        seen = follow(self.frames, self.ground, path, order, self.plan, watch)
        seen = [replace(item, wet=True) for item in seen]
        water = self.scene.radius_water if self.scene.radius_water.known else self._radius(seen)
        return seen, water, self.check

    def _reachable(self, sighting: Sighting) -> bool:
        """Whether the bottom lies no deeper than a fall without water would have brought it."""
        good = [item.fit for item in self.dry if item.ok and item.fit is not None]
        frames = [item.frame for item in self.dry if item.ok]
        if len(good) < 2 or sighting.fit is None:
            return True
        speed = (good[-1].bottom_y_px - good[0].bottom_y_px) / (frames[-1] - frames[0])
        falls = speed * (sighting.frame - frames[-1])
        return sighting.fit.bottom_y_px < good[-1].bottom_y_px + 1.1 * falls + 3.0

    def _radius(self, seen: list[Sighting]) -> PooledRadius:
        pooled = pool_sightings(seen, wet=True)
        if not pooled.known:
            return NO_RADIUS
        if self.scene.deformable:
            self.check = check_shape(
                self.frames, self.ground, self.dry, seen, self.scene.level, departure=self.departure
            )
        return corrected_radius(pooled, self.check)

    def settle(self, seen: list[Sighting], water: PooledRadius) -> list[Sighting]:
        """Give all sightings the final radius.

        What was seen before the radius was known is measured again, backwards from there, with the radius held; the
        rest moves by its own sensitivity to the last digits of the radius.
        """
        last = self.plan.pilot[-1].frame if self.plan.pilot else -1
        start = next((index for index, item in enumerate(seen) if item.frame > last), len(seen))
        after = [item for item in seen[max(0, start - 1) : start + 12] if item.ok and item.fit is not None][:3]
        if start == 0 or not after or self.scene.radius_water.known:
            return constrain(seen, water, wet=True)
        path = Path(water.value, stiff=not self.scene.deformable)
        plan = WetPlan(self.scene, self.frames.shape, known=True, departure=self.departure)
        plan.tilt = self.plan.tilt
        for item in reversed(constrain(after, water, wet=True)):
            if item.fit is not None:
                path.add(item.frame, item.fit.shape)
            plan.learn(item)
        order = [item.frame for item in reversed(seen[:start])]
        again = follow(self.frames, self.ground, path, order, plan, Watch(plan.learn, self._reachable))
        reached = {item.frame: replace(item, wet=True) for item in again}
        early = [reached.get(item.frame, Sighting(item.frame, "poor_fit", wet=True)) for item in seen[:start]]
        return constrain([*early, *seen[start:]], water, wet=True)
