"""Follow a sphere from frame to frame: predict, look, remember; find it again where it was lost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from wentry_cli.contours.ellipse import EllipseShape
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
UNREADABLE = {"bad_frame", "gap"}


def follow(
    frames: Frames,
    ground: Background,
    path: Path,
    order: Iterable[int],
    plan: Plan,
    *,
    learn: Callable[[Sighting], None] | None = None,
    wet: bool = False,
    patience: int = GIVEN_UP_AFTER,
) -> list[Sighting]:
    """Measure the frames in ``order`` (forwards or backwards), each from the last few.

    A frame that failed is tried once more at the bottom that the picture itself shows. After three failures in a row
    a ``wet`` sphere is searched for in the whole frame. The status ``out_of_frame`` from the plan ends the path, and
    so do ``patience`` failures in a row. ``learn`` hears of every measured frame.
    """
    found: list[Sighting] = []
    lost = 0
    for index in order:
        sighting = _step(frames, ground, path, index, plan)
        if not sighting.ok and sighting.status not in UNREADABLE:
            lost += 1
            if wet and lost >= LOST_AFTER and lost % 2:
                sighting = _search(frames, ground, path, index, plan) or sighting
        if sighting.ok and sighting.fit is not None:
            path.add(index, _remembered(sighting, path.radius))
            lost = 0
            if learn is not None:
                learn(sighting)
        found.append(sighting)
        left = sighting.status == "out_of_frame" and sighting.fit is None
        if left or lost >= patience:
            break
    return found


def _remembered(sighting: Sighting, radius: float) -> EllipseShape:
    """The shape to predict from: a circle's own radius becomes its stretch against the radius of the path."""
    assert sighting.fit is not None
    shape = sighting.fit.shape
    if not sighting.circle:
        return shape
    return EllipseShape(shape.x, shape.y, radius, shape.radius / radius)


def _step(frames: Frames, ground: Background, path: Path, index: int, plan: Plan) -> Sighting:
    guess = path.predict(index)
    look = plan(index, guess, path.velocity())
    if isinstance(look, str):
        return Sighting(index, look)
    first = sight(frames, index, ground, guess, look)
    if first.ok or first.status in UNREADABLE or look.outline == "circle":
        return first
    moved = _at_visible_bottom(frames, ground, index, guess, look)
    if moved is None:
        return first
    second = sight(frames, index, ground, moved, look)
    return second if second.ok else first


def _at_visible_bottom(
    frames: Frames, ground: Background, index: int, guess: EllipseShape, look: Look
) -> EllipseShape | None:
    patch = read_patch(frames, index, ground, look.box)
    if isinstance(patch, str):
        return None
    bottom = find_bottom(patch.values, patch.x0, patch.y0, guess.x, 0.25 * guess.radius)
    shift = bottom - guess.bottom_y
    if not math.isfinite(shift) or abs(shift) < 1.0:
        return None
    return EllipseShape(guess.x, guess.y + shift, guess.radius, guess.stretch, guess.tilt_deg)


def _search(frames: Frames, ground: Background, path: Path, index: int, plan: Plan) -> Sighting | None:
    try:
        whole = cut_patch(frames.read(index), 0, 0, ground)
    except FrameUnreadableError:
        return None
    expected = path.predict(index)
    look = plan(index, expected, path.velocity())
    if isinstance(look, str):
        return None
    top = look.top_y_px if math.isfinite(look.top_y_px) else 0.0
    cap = find_lowest_cap(whole.values, path.radius, top_y=min(top, expected.y))
    if cap is None or abs(cap.x - expected.x) > 2.0 * path.radius or abs(cap.y - expected.y) > 3.0 * path.radius:
        return None
    guess = EllipseShape(cap.x, cap.y, path.radius, 1.0)
    look = plan(index, guess, path.velocity())
    if isinstance(look, str):
        return None
    sighting = sight(frames, index, ground, guess, look)
    return sighting if sighting.ok else None
