"""Where the sphere will be in the next frame, from the last few in which it was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.imaging.detection import HALF_LEVEL

LONGEST_CURVED_STEP = 3
STRETCH_LIMITS = (0.62, 2.6)
PLAUSIBLE_STRETCH = (0.5, 3.0)  # beyond these no sphere of an experiment stays whole: scale, distance or fit is wrong


def plausible(stretch: NDArray[np.float64]) -> NDArray[np.float64]:
    """The stretches that a sphere can have, NaN in the place of the others."""
    low, high = PLAUSIBLE_STRETCH
    return np.where((stretch > low) & (stretch < high), stretch, np.nan)


@dataclass
class Path:
    """The last measured shapes and the radius to predict with; frames may run forwards or backwards in time.

    A ``stiff`` sphere is predicted with a stretch of 1. What is darker than ``level`` may be the sphere. ``blur_px`` is
    the blur of the last one, NaN where its outline was hidden in part.
    """

    radius: float
    frames: list[int] = field(default_factory=list)
    shapes: list[EllipseShape] = field(default_factory=list)
    stiff: bool = False
    level: float = HALF_LEVEL
    blur_px: float = math.nan

    def add(self, frame: int, shape: EllipseShape, blur_px: float = math.nan) -> None:
        """Remember the shape of one frame, and its blur; the newest three are kept."""
        self.blur_px = blur_px
        frames, shapes = self.frames, self.shapes
        if frame in frames:
            again = frames.index(frame)
            frames, shapes = frames[:again] + frames[again + 1 :], shapes[:again] + shapes[again + 1 :]
        self.frames, self.shapes = [*frames[-2:], frame], [*shapes[-2:], shape]

    def turned(self) -> Path:
        """The same path, to be followed in the other direction."""
        return Path(self.radius, self.frames[::-1], self.shapes[::-1], self.stiff, self.level)

    def leads_to(self, frame: int) -> bool:
        """Whether the sphere was measured in each of the three frames just before ``frame``."""
        return len(self.frames) == 3 and [abs(frame - other) for other in self.frames] == [3, 2, 1]

    def velocity(self) -> tuple[float, float]:
        """Velocity of the centre in px per frame, from the last two shapes; zero where there are fewer."""
        if len(self.frames) < 2:
            return 0.0, 0.0
        step = self.frames[-1] - self.frames[-2]
        new, old = self.shapes[-1], self.shapes[-2]
        return (new.x - old.x) / step, (new.y - old.y) / step

    def predict(self, frame: int) -> EllipseShape:
        """The shape expected in ``frame``: parabolas through the last three, lines over longer gaps.

        What is continued is what is seen: the axis, the lowest row and the half-width. Shapes that were fitted with
        different radii agree in them, but not in centre and stretch. Over longer gaps the bottom would oscillate with
        the stretch, and the centre goes on.
        """
        last = self.shapes[-1]
        if len(self.frames) < 2:
            return EllipseShape(last.x, last.y, self.radius, 1.0 if self.stiff else last.stretch, last.tilt_deg)
        span = abs(frame - self.frames[-1])
        use = 3 if len(self.frames) == 3 and span <= LONGEST_CURVED_STEP else 2
        if span > 2 * LONGEST_CURVED_STEP:
            use = 2
        x = centre = bottom = across = 0.0
        for weight, item in zip(lagrange_weights(self.frames[-use:], frame), self.shapes[-use:], strict=True):
            x += weight * item.x
            centre += weight * item.y
            bottom += weight * item.bottom_y
            across += weight * item.semi_across
        stretch = last.stretch if span > LONGEST_CURVED_STEP else across / self.radius
        if self.stiff:
            stretch = 1.0
        stretch = min(max(stretch, STRETCH_LIMITS[0]), STRETCH_LIMITS[1])
        if span > LONGEST_CURVED_STEP:
            return EllipseShape(x, centre, self.radius, stretch, last.tilt_deg)
        above = EllipseShape(x, 0.0, self.radius, stretch, last.tilt_deg).bottom_y
        return EllipseShape(x, bottom - above, self.radius, stretch, last.tilt_deg)


def lagrange_weights(at: Sequence[float], frame: float) -> list[float]:
    """Weights of values at the points ``at`` for the polynomial through them, taken at ``frame``."""
    weights = []
    for here in at:
        weight = 1.0
        for other in at:
            if other != here:
                weight *= (frame - other) / (here - other)
        weights.append(weight)
    return weights


def box_around(shape: EllipseShape, margin: float, *, above: float = 1.2) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of what is read around a shape: ``above`` semi-axes upwards, one otherwise."""
    tilt = abs(math.sin(math.radians(shape.tilt_deg)))
    across = shape.semi_across + tilt * shape.semi_along
    along = shape.semi_along + tilt * shape.semi_across
    return (
        shape.x - across - margin,
        shape.y - above * along - margin,
        shape.x + across + margin,
        shape.y + along + margin,
    )


def usable(fit: SilhouetteFit) -> bool:
    """Whether a fit may be followed: ok, with finite values."""
    return fit.status == "ok" and math.isfinite(fit.center_x_px + fit.center_y_px + fit.stretch)
