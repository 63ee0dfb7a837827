"""How to look at a sphere below the surface: which part of its outline, which parameters, which tilt."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wentry_cli.contours.departure import NONE, Departure
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.tracking.flight import leaves_frame, margin_of
from wentry_cli.tracking.prediction import box_around
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius
from wentry_cli.tracking.sighting import LEAST_OBLATE, Look, Sighting
from wentry_cli.tracking.tilt import Tilt
from wentry_cli.tracking.wet_radius import tells_radius

SHALLOWEST = 0.10
FREE_EVERY = 6
UNKNOWN_SEPARATION = 0.3
HIGHEST_SEPARATION = -0.5
DEEPEST_SEPARATION = 0.6
TELLING = {False: 0.6, True: 1.2}


@dataclass(frozen=True)
class SideScene:
    """What is known of the scene before it is tracked.

    ``surface_px`` is the row of the free surface and ``band_px`` how far its dark band reaches above and below it;
    ``exposure_frames`` the exposure over the time between frames; a radius that the user gave is not fitted.
    """

    surface_px: float
    band_px: tuple[float, float] = (3.0, 3.0)
    deformable: bool = True
    level: str = "accurate"
    exposure_frames: float = 0.0
    radius_air: PooledRadius = NO_RADIUS
    radius_water: PooledRadius = NO_RADIUS

    @property
    def ceiling_px(self) -> float:
        """The first row below the surface band."""
        return self.surface_px + self.band_px[1]

    @property
    def floor_px(self) -> float:
        """The last row above the surface band."""
        return self.surface_px - self.band_px[0]


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

    def restarted(self) -> WetPlan:
        """A plan for another pass over the same frames, now that the radius is known."""
        plan = WetPlan(self.scene, self.frame_shape, known=True, departure=self.departure)
        plan.tilt = self.tilt
        return plan

    def learn(self, sighting: Sighting) -> None:
        """Take what the next frame's look depends on from a measured frame."""
        fit = sighting.fit
        if fit is None or not sighting.ok:
            return
        self.sees_enough = tells_radius(fit)
        self.tilt.hear(sighting)
        if not self.known and sighting.free_fit is not None:
            self.pilot.append(sighting._replace(wet=True))
        line = sighting.separation
        if line is not None and line.status == "ok":
            self.separation = (line.y_px - fit.center_y_px) / (fit.radius_px / fit.stretch**2)

    def top_row(self, guess: EllipseShape) -> float:
        """The row above which the outline may be cavity, splash or surface."""
        line = self.separation + 0.06 if math.isfinite(self.separation) else UNKNOWN_SEPARATION
        line = min(max(line, HIGHEST_SEPARATION), DEEPEST_SEPARATION)
        return max(guess.y + line * guess.semi_along, self.scene.ceiling_px)

    def _deep(self, guess: EllipseShape) -> bool:
        """Whether the sphere is so far in the water that its outline tells its radius, whatever agrees with it yet.

        With the radius from the air, which may be a wrong one, a rigid sphere never agrees with its outline, and a
        third of it is enough to say so. A deformable one makes up for it by its stretch, but not where droplets leave
        little of the outline: then half of it is waited for.
        """
        return guess.bottom_y > self.scene.ceiling_px + TELLING[self.scene.deformable] * guess.radius

    def __call__(self, index: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        """Decide on one frame."""
        bottom = guess.bottom_y
        if bottom < self.scene.ceiling_px + SHALLOWEST * guess.radius:
            return "short_arc"
        if bottom > self.frame_shape[0] - 2 or leaves_frame(guess, self.frame_shape):
            return "out_of_frame"
        piloting = not self.known and (self.sees_enough or self._deep(guess))
        free = "x y" + (" R" if piloting else "") + (" stretch" if self.scene.deformable else "")
        if piloting and self.scene.deformable and abs(guess.stretch - 1.0) > LEAST_OBLATE:
            free += " tilt"
        box = box_around(guess, margin_of(guess.radius), above=1.0)
        top = self.top_row(guess)
        exposure = self.scene.exposure_frames
        return Look(
            (box[0], max(box[1], self.scene.ceiling_px), box[2], box[3]),
            free,
            top,
            (velocity[0] * exposure, velocity[1] * exposure),
            self.scene.level,
            separation=True,
            also_free=self.again and self.known and index % FREE_EVERY == 0,
            tilt_deg=self.tilt.value,
            tilt_unc_deg=self.tilt.unc,
            departure=self.departure,
            beside_band=top <= self.scene.ceiling_px,
        )
