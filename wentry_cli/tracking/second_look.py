"""Frames that failed are looked at once more, from where those before and after them say that the sphere is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.continuity import BESIDE, UNEXPLAINED, Course
from wentry_cli.tracking.follow import UNREADABLE
from wentry_cli.tracking.sighting import Sighting, sight
from wentry_cli.tracking.source import Frames
from wentry_cli.tracking.wet_plan import WetPlan

STEPS = np.array([-0.5, 0.0, 0.5])
FARTHEST_PX = 6.0  # standard deviation of where the sphere is expected, from which its outline is still found
FOR_GOOD = UNREADABLE | {"short_arc"}  # frames in which nothing more is to be seen


def look_again(
    frames: Frames,
    ground: Background,
    seen: Sequence[Sighting],
    plan: WetPlan,
    believable: Callable[[Sighting], bool],
) -> list[Sighting]:
    """``seen`` below the surface with the frames that can be measured after all.

    A path that a wrong frame led astray looks for the sphere in the wrong place, and a mostly hidden one shows it only
    to who knows where it must be. The radius is that of the good sightings; what is found is taken where smooth motion
    explains it.
    """
    kept = list(seen)

    def attempt(place: int) -> None:
        if not kept[place].ok and kept[place].status not in FOR_GOOD:
            found = _look(frames, ground, kept, place, plan)
            if found is not None and believable(found):
                kept[place] = found

    for place in range(len(kept)):
        attempt(place)
    for place in range(len(kept) - 2, -1, -1):
        if kept[place + 1] is not seen[place + 1]:  # what follows it now tells more
            attempt(place)
    return kept


def _look(frames: Frames, ground: Background, kept: Sequence[Sighting], place: int, plan: WetPlan) -> Sighting | None:
    """One frame from its neighbours; None where they do not tell where to look, or say that it is not the sphere."""
    before = _nearest(kept, range(place - 1, -1, -1))[::-1]
    beside = [*before, *_nearest(kept, range(place + 1, len(kept)))]
    if len(beside) < BESIDE:
        return None
    frame, course, all_of_them = kept[place].frame, Course.of(beside), np.arange(len(beside))
    value, variance = course.predict(frame + STEPS, np.tile(all_of_them, (STEPS.size, 1)))
    if math.hypot(*np.sqrt(variance[1, :2])) > FARTHEST_PX:
        return None
    nearest = min(beside, key=lambda item: abs(item.frame - frame))
    assert nearest.fit is not None
    plan.learn(nearest)
    x, y, stretch = value[1].tolist()
    guess = EllipseShape(x, y, nearest.fit.radius_px, stretch, nearest.fit.tilt_deg)
    velocity = value[2] - value[0]
    look = plan(frame, guess, (float(velocity[0]), float(velocity[1])))
    if isinstance(look, str):
        return None
    found = sight(frames, frame, ground, guess, look)._replace(wet=True)
    if not found.ok:
        return None
    own = len(beside)
    off = Course.of([*beside, found]).off(np.array([own]), all_of_them[None, :])
    return found if off[0] <= UNEXPLAINED else None


def _nearest(kept: Sequence[Sighting], order: range) -> list[Sighting]:
    """The first good ones in this order, as many as a sighting is judged by."""
    return list(islice((kept[place] for place in order if kept[place].ok), BESIDE))
