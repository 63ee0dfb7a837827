"""Following a sphere below the surface: the radius it has there, and what must not be taken for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wentry_cli.contours.departure import Shape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.confirmed import without_unconfirmed
from wentry_cli.tracking.continuity import without_unexplained
from wentry_cli.tracking.follow import GIVEN_UP_AFTER, Watch, follow
from wentry_cli.tracking.held_radius import with_tilt
from wentry_cli.tracking.mirror import Mirror, stands_out
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius
from wentry_cli.tracking.second_look import look_again
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck, check_shape, corrected_radius, radius_ratio
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_plan import SideScene, WetPlan
from wentry_cli.tracking.wet_radius import LARGEST_GATE, STRETCH_PER_RADIUS, constrain, pool_sightings

PILOT_FRAMES = 24
HIDDEN_RADII = 12.0
# λ − 1 that no rigid sphere shows, that in standard uncertainties, in how many frames, within how many radii of fall
DEFORMED, CLEARLY, LEAST_DEFORMED, DEFORMS_WITHIN = 0.03, 5.0, 3, 3.0
ROUND = 0.8  # of the frames must agree with a circle
RADIUS_KNOWN = 0.01
CLOSE_RADIUS = 0.001  # within which one linear step leads from a radius to another as well as a fit
UNKNOWN_WALL = 0.04  # by which the radius below the surface may differ where nothing tells it
FEWEST_FALLING, LEAST_GAIN = 5, 0.005  # frames in air, and share of the speed gained in one, that count as a fall
BRIGHTER = 0.15  # of the ground: more is not the sphere that fell
BRIGHTER_FAINT = 0.5  # of its contrast, where that is little


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
        self.good = [(item.frame, item.fit) for item in dry if item.ok and item.fit is not None]
        self.speed = self._speed()
        self.gain = self._gain()
        self.check = NO_CHECK
        inside = [item.inside for item in dry if item.ok]
        self.darkness = float(np.median(inside)) if inside else math.nan

    def track(self, path: Path, order: range) -> tuple[list[Sighting], PooledRadius, ShapeCheck]:
        """Follow the path below the surface; returns sightings, the pooled radius, and what the shape adds to it."""
        if self.scene.radius_water.known:
            path.radius = self.scene.radius_water.value

        def learn(sighting: Sighting) -> None:
            self.plan.learn(sighting)
            if not self.plan.known and len(self.plan.pilot) >= PILOT_FRAMES:
                value = self._first_radius()
                self.plan.known = math.isfinite(value)
                path.radius = value if self.plan.known else path.radius

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
        """Search for a lost sphere for as long as splash and mirror image may hide it.

        They do so over two diameters or less, but the water slows a soft sphere to a third of its speed and less.
        """
        patience = GIVEN_UP_AFTER
        if self.speed > 0.0:
            patience = max(patience, round(HIDDEN_RADII * path.radius / self.speed))
        return Watch(learn, self._believable, self.scene.ceiling_px, patience)

    def _speed(self) -> float:
        """Of the bottom in air, px per frame; 0 where it is not known."""
        if len(self.good) < 2:
            return 0.0
        (first, start), (last, end) = self.good[0], self.good[-1]
        return (end.bottom_y_px - start.bottom_y_px) / (last - first)

    def _gain(self) -> float:
        """Of the bottom's speed in air, px per frame squared; 0 where gravity is of no account, as in fast entries."""
        if len(self.good) < FEWEST_FALLING:
            return 0.0
        frame = np.array([at for at, _ in self.good], np.float64)
        bottom = np.array([fit.bottom_y_px for _, fit in self.good])
        gain = 2.0 * float(np.polyfit(frame - frame[-1], bottom, 2)[0])
        return gain if gain > LEAST_GAIN * self.speed > 0.0 else 0.0

    def _follow(self, path: Path, order: range, watch: Watch) -> list[Sighting]:
        seen = follow(self.frames, self.ground, path, order, self.plan, watch)
        return [item._replace(wet=True) for item in seen]

    def _believable(self, sighting: Sighting) -> bool:
        """Whether this can be the sphere: no deeper than a fall without water, and as dark within as it was in air.

        Its mirror image in the surface, seen from below, is neither. The centre falls: the bottom of a soft sphere that
        gets longer goes deeper.
        """
        if len(self.good) < 2 or sighting.fit is None:
            return True
        if sighting.inside > self.darkness + min(BRIGHTER, BRIGHTER_FAINT * (1.0 - self.darkness)) or stands_out(
            sighting, self.mirror
        ):
            return False
        frame, last = self.good[-1]
        since, watched = sighting.frame - frame, frame - self.good[0][0]
        falls = (self.speed + 0.5 * self.gain * watched) * since + 0.5 * self.gain * since**2
        return sighting.fit.center_y_px < last.center_y_px + 1.1 * falls + 3.0

    def _first_radius(self) -> float:
        """The radius that the pilots tell, to go on with; NaN where they do not."""
        pilot, level = self.plan.pilot, self.scene.level
        pooled = pool_sightings(without_unconfirmed(pilot), wet=True)
        if not (pooled.known and self.scene.deformable):
            return pooled.value
        waves = self.shape.waves
        return pooled.value / radius_ratio(self.frames, self.ground, self.dry, pilot, level, departure=waves)

    def _radius(self, seen: list[Sighting]) -> PooledRadius:
        pooled = pool_sightings(without_unconfirmed(seen), wet=True)
        if not pooled.known:
            return NO_RADIUS
        if self.scene.deformable:
            self.check = check_shape(self.frames, self.ground, self.dry, seen, self.scene.level, shape=self.shape)
        return corrected_radius(pooled, self.check)

    def deformation(self, seen: list[Sighting], water: PooledRadius) -> Sighting | None:
        """The most stretched outline just below the surface, were λ left free; None where the sphere stays round.

        Nothing is fitted anew where most of what was ``seen`` there agrees with a circle, nor without a radius, which
        λ is relative to; one that circles do not tell to ``RADIUS_KNOWN`` is left free with λ, from that in air on.
        Droplets may make an outline look stretched: ``LEAST_DEFORMED`` frames must agree.
        """
        if not water.known:
            return None
        step = max(1, round(DEFORMS_WITHIN * water.value / (PILOT_FRAMES * self.speed))) if self.speed > 0.0 else 1
        first = self.dry[-1].frame + 1
        order = range(first, min(first + PILOT_FRAMES * step, self.frames.count), step)
        if _are_round([item for item in seen if item.frame < order.stop]):
            return None
        known = water.unc < RADIUS_KNOWN * water.value
        if not known and self.good:
            air = self.good[-1][1].radius_px
            water = replace(water, value=air, unc=UNKNOWN_WALL * air)
        path = Path(water.value)
        for frame, fit in self.good[-3:]:
            path.add(frame, fit.shape)
        soft = replace(self.scene, deformable=True, radius_water=water)
        plan = WetPlan(soft, self.frames.shape, known=known, departure=self.shape.waves)
        looked = follow(self.frames, self.ground, path, order, plan, Watch(plan.learn, self._believable))
        clear = [item for item in looked if _is_stretched(item, water)]
        return max(clear, key=_stretched_by) if len(clear) >= LEAST_DEFORMED else None

    def look_again(self, seen: list[Sighting]) -> list[Sighting]:
        """Leave out what the neighbours in time do not explain, and look once more where nothing was measured."""
        seen = without_unexplained(seen)
        again = look_again(self.frames, self.ground, seen, self.plan.restarted(), self._believable)
        more = any(one is not other for one, other in zip(seen, again, strict=True))
        return without_unexplained(again) if more else seen

    def settle(self, seen: list[Sighting], water: PooledRadius) -> list[Sighting]:
        """Give all sightings the final radius.

        What was seen with another radius, or before a tilt was known, is measured again, backwards from there, with
        both held. The rest moves by its own sensitivity to the last digits of the radius, pilots to those of the tilt
        as well. Without any radius, air's or water's, nothing can be held, and all stays as it was seen.
        """
        if not water.known:
            return seen
        first = max(self._radius_from(water), self.plan.tilt.harmful_before + 1)
        start = next((index for index, item in enumerate(seen) if item.frame >= first), len(seen))
        late = self._upright(constrain(seen[start:], water, wet=True))
        after = [item for item in late[:12] if item.ok and item.fit is not None][:3]
        if start == 0 or not after:
            return [*constrain(seen[:start], water, wet=True), *late]
        path = Path(water.value, stiff=not self.scene.deformable)
        plan = self.plan.restarted()
        for item in reversed(after):
            if item.fit is not None:
                path.add(item.frame, item.fit.shape)
            plan.learn(item)
        order = [item.frame for item in reversed(seen[:start])]
        again = follow(self.frames, self.ground, path, order, plan, Watch(plan.learn, self._believable))
        reached = {item.frame: item._replace(wet=True) for item in again}
        early = [reached.get(item.frame, Sighting(item.frame, "poor_fit", wet=True)) for item in seen[:start]]
        return [*constrain(early, water, wet=True), *late]

    def _radius_from(self, water: PooledRadius) -> int:
        """The frame from which on the radius was free and close to what all tell together, or that was held."""
        pilot = self.plan.pilot if not self.scene.radius_water.known else []
        if not pilot:
            return 0
        off = [item.frame for item in pilot if item.fit and abs(item.fit.radius_px / water.value - 1.0) > CLOSE_RADIUS]
        return max(off) + 1 if off else pilot[0].frame

    def _upright(self, seen: list[Sighting]) -> list[Sighting]:
        """Give the pilots, whose tilt was free or not known yet, that which all frames tell."""
        tilt, pilots = self.plan.tilt, {item.frame for item in self.plan.pilot}
        return [
            item._replace(fit=with_tilt(item.fit, tilt.value, tilt.unc)) if item.fit and item.frame in pilots else item
            for item in seen
        ]


def _are_round(seen: list[Sighting]) -> bool:
    """Whether the outlines that were fitted with λ = 1 agree with it, most of each and in most frames."""
    tell = [item for item in seen if item.status not in ("short_arc", "out_of_frame")]
    agree = [item for item in tell if item.ok and item.fit is not None and item.fit.gated_fraction <= LARGEST_GATE]
    return len(agree) >= ROUND * len(tell)


def _stretched_by(item: Sighting) -> float:
    return abs(item.fit.stretch - 1.0) if item.fit is not None else 0.0


def _is_stretched(item: Sighting, water: PooledRadius) -> bool:
    """Whether the outline is clearly no circle, whatever the radius is within its uncertainty."""
    if not item.ok or item.fit is None:
        return False
    held = STRETCH_PER_RADIUS * water.unc / water.value if item.free_fit is None else 0.0
    unc = math.hypot(item.fit.stretch_unc, held)
    return _stretched_by(item) > max(DEFORMED, CLEARLY * unc)
