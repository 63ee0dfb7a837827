"""Follow a sphere from frame to frame: predict, look, remember; find it again where it was lost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import HALF_GATED
from wentry_cli.contours.refine import MOST_UNSCANNED
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background, cut_patch
from wentry_cli.imaging.detection import find_bottom, find_lowest_cap
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames, read_patch

Plan = Callable[[int, EllipseShape, tuple[float, float]], Look | str]
"""From frame, predicted shape and velocity (px per frame): how to look, or the status of a frame not looked at."""

LOST_AFTER = 3
GIVEN_UP_AFTER = 60
LARGEST_JUMP = 0.3
STRETCHES = (1.0, 1.2, 0.85, 1.4)
STRETCHES_LOST = (*STRETCHES, 1.65, 1.85, 2.05, 0.75)  # a soft sphere that was lost may have any
LARGEST_STRETCH, STRETCH_A_FRAME = 0.05, 0.01  # beside what was expected, of a sphere that is mostly hidden
LATE_FRAMES, RISEN_PX = 3, 3.0
UNREADABLE = {"bad_frame", "gap"}


@dataclass(frozen=True)
class Watch:
    """What a path is to be watched for.

    ``learn`` hears of every measured frame, ``accept`` may refuse one that the sphere cannot have reached. A lost
    sphere is searched for in all rows from ``search_from_px`` down (NaN: nowhere); ``patience`` failures in a row end
    the path.
    """

    learn: Callable[[Sighting], None] | None = None
    accept: Callable[[Sighting], bool] | None = None
    search_from_px: float = math.nan
    patience: int = GIVEN_UP_AFTER

    def believes(self, sighting: Sighting, path: Path, expected: EllipseShape) -> bool:
        """Whether a good fit lies where the sphere can be: not on its mirror image, a jet, a droplet."""
        return not _jumps(sighting, path, expected) and (self.accept is None or self.accept(sighting))


TRUSTING = Watch()


def follow(
    frames: Frames, ground: Background, path: Path, order: Iterable[int], plan: Plan, watch: Watch = TRUSTING
) -> list[Sighting]:
    """Measure the frames in ``order`` (forwards or backwards), each from the last few.

    A frame that failed is tried once more at the bottom that the picture itself shows. The status ``out_of_frame``
    from the plan ends the path of a sphere that was seen just before.
    """
    found: list[Sighting] = []
    lost = 0
    for index in order:
        expected = path.predict(index)
        sighting = _step(frames, ground, path, index, plan, expected=expected, thorough=lost > 0)
        if sighting.traced and not watch.believes(sighting, path, expected):
            sighting = Sighting(index, "poor_fit", wet=sighting.wet)
        if not sighting.traced and sighting.status not in UNREADABLE:
            lost += 1
            if math.isfinite(watch.search_from_px) and lost >= LOST_AFTER and lost % 2:
                found_again = _search(frames, ground, path, index, plan, watch.search_from_px)
                sighting = found_again if found_again and watch.believes(found_again, path, expected) else sighting
        if sighting.traced:
            path.add(index, _remembered(sighting, path.radius), _blur_of(sighting))
            lost = 0
            if watch.learn is not None and sighting.ok:
                watch.learn(sighting)
        if sighting.status == "out_of_frame" and _far(expected, path):
            sighting = sighting._replace(status="occluded")  # where a sphere that was lost long ago is, nobody knows
        found.append(sighting)
        left = sighting.status == "out_of_frame" and sighting.fit is None and lost <= LOST_AFTER
        if left or lost >= watch.patience:
            break
    return found


def _far(expected: EllipseShape, path: Path) -> bool:
    """Whether a shape is expected more than a radius from where the sphere was seen last."""
    last = path.shapes[-1]
    return math.hypot(expected.x - last.x, expected.y - last.y) > path.radius


def _jumps(sighting: Sighting, path: Path, expected: EllipseShape) -> bool:
    assert sighting.fit is not None
    last = path.shapes[-1]
    shape = _remembered(sighting, path.radius)
    late = abs(sighting.frame - path.frames[-1])
    allowed = LARGEST_JUMP * path.radius + 2.0 * late
    deformed = 0.0 if sighting.circle else abs(shape.stretch - expected.stretch)
    if sighting.fit.gated_fraction > HALF_GATED and deformed > LARGEST_STRETCH + STRETCH_A_FRAME * late:
        return True  # where more is hidden than seen, bubbles may lie on an ellipse of their own
    sideways = shape.x - expected.x
    moved = shape.y - expected.y if sighting.circle else shape.bottom_y - expected.bottom_y
    if late > LATE_FRAMES:
        # the last two sightings may have been poor, and where they lead to leads astray
        sideways = _beyond(shape.x, last.x, expected.x)
        if moved < 0.0:
            # the water may have held back a sphere that was out of sight: anywhere from where it was seen last
            moved = min(0.0, shape.bottom_y - last.bottom_y + RISEN_PX)
    return math.hypot(sideways, moved) > allowed


def _beyond(value: float, one: float, other: float) -> float:
    """How far a value lies outside of the interval between two others."""
    return value - min(max(value, min(one, other)), max(one, other))


def _remembered(sighting: Sighting, radius: float) -> EllipseShape:
    """The shape to predict from: a circle's own radius becomes its stretch against the radius of the path."""
    assert sighting.fit is not None
    shape = sighting.fit.shape
    if not sighting.circle:
        return shape
    return EllipseShape(shape.x, shape.y, radius, shape.radius / radius)


def _blur_of(sighting: Sighting) -> float:
    """The blur to look with in the next frame; NaN where too much was hidden to go on without a scan."""
    assert sighting.fit is not None
    return sighting.fit.blur_px if sighting.fit.gated_fraction <= MOST_UNSCANNED else math.nan


def _step(
    frames: Frames,
    ground: Background,
    path: Path,
    index: int,
    plan: Plan,
    *,
    expected: EllipseShape,
    thorough: bool,
) -> Sighting:
    look = plan(index, expected, path.velocity())
    if isinstance(look, str):
        return Sighting(index, look)
    guess = expected if look.tilt_deg is None else expected._replace(tilt_deg=look.tilt_deg)
    if look.outline == "ellipse" and path.leads_to(index):
        look = look._replace(blur_px=path.blur_px)
    first = sight(frames, index, ground, guess, look)
    if first.ok or first.status in UNREADABLE or look.outline == "circle":
        return first
    moved = _at_visible_bottom(frames, ground, index, guess, look, path.level)
    if moved is None:
        return first
    factors = STRETCHES if thorough and not path.stiff else (1.0,)
    tries = [_look_again(frames, ground, path, index, plan, _squeezed(moved, factor)) for factor in factors]
    good = [item for item in tries if item is not None and not _jumps(item, path, expected)]
    return min(good, key=lambda item: item.fit.gated_fraction if item.fit else 1.0) if good else first


def _look_again(
    frames: Frames, ground: Background, path: Path, index: int, plan: Plan, guess: EllipseShape
) -> Sighting | None:
    """Look for the sphere about another guess, with the look that belongs to it; None where it is not there."""
    look = plan(index, guess, path.velocity())
    if isinstance(look, str):
        return None
    if look.tilt_deg is not None:
        guess = guess._replace(tilt_deg=look.tilt_deg)
    sighting = sight(frames, index, ground, guess, look)
    return sighting if sighting.ok else None


def _squeezed(shape: EllipseShape, factor: float) -> EllipseShape:
    """The shape with its stretch times ``factor`` and the same lowest point."""
    other = shape._replace(stretch=shape.stretch * factor)
    return other._replace(y=other.y + shape.bottom_y - other.bottom_y)


def _at_visible_bottom(
    frames: Frames, ground: Background, index: int, guess: EllipseShape, look: Look, level: float
) -> EllipseShape | None:
    patch = read_patch(frames, index, ground, look.box)
    if isinstance(patch, str):
        return None
    bottom = find_bottom(patch.values, patch.x0, patch.y0, guess.x, 0.25 * guess.radius, level=level)
    shift = bottom - guess.bottom_y
    if not math.isfinite(shift) or abs(shift) < 1.0:
        return None
    return EllipseShape(guess.x, guess.y + shift, guess.radius, guess.stretch, guess.tilt_deg)


def _search(frames: Frames, ground: Background, path: Path, index: int, plan: Plan, from_px: float) -> Sighting | None:
    try:
        whole = cut_patch(frames.read(index), 0, 0, ground)
    except FrameUnreadableError:
        return None
    expected, last = path.predict(index), path.shapes[-1]
    cap = find_lowest_cap(whole.values, path.radius, top_y=from_px, level=path.level)
    # a path that went astray before it was lost leads anywhere: what was seen last counts as much
    if cap is None or abs(_beyond(cap.y, expected.y, last.y)) >= 3.0 * path.radius:
        return None
    if abs(_beyond(cap.x, expected.x, last.x)) > 2.0 * path.radius:
        return None
    round_one = EllipseShape(cap.x, cap.y, path.radius, 1.0)
    for factor in (1.0,) if path.stiff else STRETCHES_LOST:
        found = _look_again(frames, ground, path, index, plan, _squeezed(round_one, factor))
        if found is not None:
            return found
    return None
