"""Free flight: a sphere in air, all its parameters free in every frame."""

from __future__ import annotations

import math
from dataclasses import replace

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.follow import Plan, Watch, follow
from wentry_cli.tracking.prediction import Path, box_around
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames

SOON, MOST_GATED = 8, 0.1  # frames; share of an outline in air that is not the sphere's

VISIBLE_SHARE = 0.45


def margin_of(radius: float) -> float:
    """Ground to read around a shape, px: room for the scan and for what the prediction misses."""
    return 14.0 + 0.08 * radius


def leaves_frame(shape: EllipseShape, frame_shape: tuple[int, int]) -> bool:
    """Whether more than half of a shape lies outside the frame in either direction."""
    rows, columns = frame_shape
    along, across = shape.semi_along, shape.semi_across
    down = min(shape.y + along, rows) - max(shape.y - along, 0.0)
    right = min(shape.x + across, columns) - max(shape.x - across, 0.0)
    return down < VISIBLE_SHARE * 2.0 * along or right < VISIBLE_SHARE * 2.0 * across


def air_plan(
    frame_shape: tuple[int, int],
    *,
    free: str = "x y R stretch",
    level: str = "accurate",
    exposure_frames: float = 0.0,
    floor_px: float = math.inf,
    bottom: bool = True,
) -> Plan:
    """How to look at a sphere in air; nothing below the row ``floor_px`` (surface, plate) is looked at.

    ``bottom`` says whether the lowest point is also measured by itself.
    """

    def plan(_: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        if leaves_frame(guess, frame_shape):
            return "out_of_frame"
        left, top, right, low = box_around(guess, margin_of(guess.radius), above=1.0)
        motion = (velocity[0] * exposure_frames, velocity[1] * exposure_frames)
        box = (left, top, right, min(low, floor_px - 2.0))
        return Look(box, free, motion_px=motion, level=level, bottom=bottom)

    return plan


def fits_in_air(frames: Frames, ground: Background, path: Path, level: str, exposure_frames: float) -> bool:
    """Whether the whole outline of the sphere can be measured in the first frame of a path, or soon after it."""
    plan = air_plan(frames.shape, free="x y R", level=level, exposure_frames=exposure_frames, bottom=False)
    for index in range(path.frames[0], min(path.frames[0] + SOON, frames.count), 2):
        guess = path.predict(index)
        look = plan(index, guess, path.velocity())
        if not isinstance(look, str):
            seen = sight(frames, index, ground, guess, look)
            if seen.ok and seen.fit is not None and seen.fit.gated_fraction < MOST_GATED:
                return True
    return False


def both_ways(frames: Frames, ground: Background, path: Path, plan: Plan, last: int) -> tuple[list[Sighting], Path]:
    """Follow a path from its frames forwards up to and with ``last`` and backwards to the first frame.

    Returns the sightings in the order of the frames and the path at its forward end.
    """
    start = path.frames[0]
    forward = replace(path)
    seen = follow(frames, ground, forward, range(start, last + 1), plan, _learning(forward))
    good = [item for item in seen if item.ok and item.fit is not None][:3]
    backward = path.turned()
    if len(good) >= 2:
        backward = Path(path.radius, stiff=path.stiff, level=path.level)
        for item in reversed(good):
            if item.fit is not None:
                backward.add(item.frame, item.fit.shape, item.fit.blur_px)
                backward.radius = item.fit.radius_px
    before = follow(frames, ground, backward, range(start - 1, -1, -1), plan, _learning(backward))
    return [*reversed(before), *seen], forward


def _learning(path: Path) -> Watch:
    """A path in air predicts with the radius that was fitted last: that of the seed is a rough one."""

    def learn(sighting: Sighting) -> None:
        if sighting.fit is not None and not sighting.circle:
            path.radius = sighting.fit.radius_px

    return Watch(learn)
