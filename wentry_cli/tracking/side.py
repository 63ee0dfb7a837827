"""The side view of a water entry: in air, through the surface, below it.

In air the whole outline gives centre, radius and stretch; the radii are pooled. While the sphere crosses the surface
only the arc below the surface band is looked at, never one contour across the waterline. Below the surface the radius
is left free wherever enough arc is seen, first in every frame, then in every sixth, pooled over the clip, and put into
all frames by their own sensitivities; frames from before the first such fit are measured again with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from wentry_cli.contours.departure import Departure
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.confirmed import without_unconfirmed
from wentry_cli.tracking.flight import air_plan, both_ways
from wentry_cli.tracking.follow import Plan
from wentry_cli.tracking.held import let_go, since
from wentry_cli.tracking.mirror import NO_MIRROR, Mirror, find_mirror, without_rising
from wentry_cli.tracking.mostly_hidden import doubted_where_hidden
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import PooledRadius, merge_media
from wentry_cli.tracking.shape_check import NO_CHECK, ShapeCheck, doubted_radius, learn_departure
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_plan import SideScene
from wentry_cli.tracking.wet_radius import constrain, pool_sightings
from wentry_cli.tracking.wet_track import UNKNOWN_WALL, WetTracker


@dataclass(frozen=True)
class SideTrack:
    """Sightings in the order of the frames, the pooled radii in px, and how far the sphere is from an ellipse.

    Frames that are missing were never reached. ``deformed`` is the most stretched outline, fitted anew, of a
    sphere that was called rigid and is not; None where it keeps its shape.
    """

    sightings: list[Sighting]
    radius_air: PooledRadius
    radius_water: PooledRadius
    check: ShapeCheck = NO_CHECK
    mirror: Mirror = NO_MIRROR
    deformed: Sighting | None = None

    @property
    def mostly_lost(self) -> bool:
        """Whether less than half of the frames below the surface could be measured."""
        wet = [item for item in self.sightings if item.wet]
        return sum(item.ok for item in wet) <= 0.5 * len(wet)


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
    numbers = np.arange(frames.count, dtype=np.float64)
    falling = since(dry, numbers, let_go(dry, numbers))
    below = WetTracker(frames, ground, scene, falling, shape=shape, mirror=mirror)
    wet, water, check = below.track(path, range(dry[-1].frame + 1, frames.count))
    if not scene.radius_air.known:
        air, water = merge_media(doubted_radius(air, dry), water)
        dry = constrain(dry, air, wet=False)
    if not water.known:
        # there may or may not be a wall before the water
        water = replace(air, unc=max(air.unc, UNKNOWN_WALL * air.value))
    # what the radius may be off by, all frames have in common: it explains no difference between them
    held = replace(water, unc=0.0)
    seen = without_unconfirmed(below.look_again(without_rising(below.settle(wet, held), mirror)))
    seen = [doubted_where_hidden(item) for item in constrain(seen, water, wet=True)]
    deformed = None if scene.deformable else below.deformation(seen, water)
    return SideTrack([*dry, *seen], air, water, check, mirror, deformed)


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
            else sight(
                frames, item.frame, ground, item.fit.shape, look._replace(departure=departure, blur_px=item.fit.blur_px)
            )
        )
        again.append(new if new.ok else item)
    return again
