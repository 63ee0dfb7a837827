"""Which of several dark lines across the picture is the free surface: the one at which the fall of the sphere changes.

Above the surface the sphere falls whole and round, whatever line it passes; from contact on it is deformed, held back,
or hidden by splash and cavity. A seam or the rim of a tank changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.tracking.flight import air_plan
from wentry_cli.tracking.follow import follow
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.source import Frames

AT_ONCE = 8  # frames looked at between two looks at what they say
FEWEST_WHOLE, FEWEST_CHANGED = 3, 3
ROUND, HELD_BACK = 0.025, 0.06  # departure of the stretch from 1, of the bottom from a free fall over the radius
ANY_PACE = 0.1  # of the way since the last whole frame: gravity, frames that were dropped
HIDDEN = 0.15  # share of the outline that is not the sphere's
LINE_HIDES = 0.5  # radii over which the outline crosses a dark line at a grazing angle
# A whole sphere may be as far below the surface (radii) before it changes: soon by its shape, later by its cavity.
SOON, LATE = 0.35, 1.6


@dataclass(frozen=True)
class FirstChange:
    """Where the sphere stops falling whole and round.

    ``whole_px`` is the row of its bottom in the last frame before that, ``step_px`` how far it falls in a frame;
    ``by_shape`` tells that it was deformed or held back, and not only hidden. NaN where no change is seen:
    ``whole_px`` is then the lowest row at which the bottom was seen.
    """

    whole_px: float
    step_px: float
    by_shape: bool
    changed: bool


NO_CHANGE = FirstChange(math.nan, math.nan, False, False)


def first_change(sightings: Sequence[Sighting]) -> FirstChange:
    """Find the first frames, three in a row, in which a sphere that fell whole and round before does so no more.

    ``sightings`` are those of consecutive frames with the whole outline and the stretch free.
    """
    whole: list[Sighting] = []
    changed: list[bool] = []
    settled = False
    for item in sightings:
        word = _change(item, whole)
        if word == "":
            whole.append(item)
            changed = []
        elif len(whole) >= FEWEST_WHOLE:
            changed.append(word == "shape")
            settled = _settled(changed, item, whole)
            if settled:
                break
    if len(whole) < FEWEST_WHOLE:
        return NO_CHANGE
    last = whole[-1]
    assert last.fit is not None
    by_shape = sum(changed) >= FEWEST_CHANGED
    return FirstChange(last.fit.bottom_y_px, _fall(whole), by_shape, settled)


def _settled(changed: Sequence[bool], item: Sighting, whole: Sequence[Sighting]) -> bool:
    """Whether a change lasts: by shape in a few frames in a row, or at all for longer than a line hides an outline."""
    if len(changed) < FEWEST_CHANGED:
        return False
    last = whole[-1]
    assert last.fit is not None
    fallen = abs(_fall(whole) * (item.frame - last.frame))
    undecided = any(changed) and len(changed) < 2 * FEWEST_CHANGED
    return all(changed[-FEWEST_CHANGED:]) or (fallen > LINE_HIDES * last.fit.radius_px and not undecided)


def _change(item: Sighting, whole: Sequence[Sighting]) -> str:
    """How a sighting differs from a whole round sphere that falls as before: by its shape, hidden, or (empty) not."""
    if not item.ok or item.fit is None:
        return "hidden"
    if abs(item.fit.stretch - 1.0) > ROUND + 5.0 * item.fit.stretch_unc:
        return "shape"
    if len(whole) >= FEWEST_WHOLE:
        last = whole[-1]
        assert last.fit is not None
        expected = last.fit.bottom_y_px + _fall(whole) * (item.frame - last.frame)
        allowed = HELD_BACK * item.fit.radius_px + ANY_PACE * abs(expected - last.fit.bottom_y_px)
        if expected - item.fit.bottom_y_px > allowed:  # ahead is where a recording lost frames
            return "shape"
    return "hidden" if item.fit.gated_fraction > HIDDEN else ""


def _fall(whole: Sequence[Sighting]) -> float:
    """How far the bottom falls in a frame, px: from the last few whole ones."""
    some = whole[-2 * FEWEST_WHOLE :]
    rows = [item.fit.bottom_y_px for item in some if item.fit is not None]
    return float(np.polyfit([item.frame for item in some], rows, 1)[0]) if len(rows) > 1 else 0.0


def follow_to_change(
    frames: Frames, ground: Background, seed: Path, lowest_px: float, exposure_frames: float
) -> FirstChange:
    """Follow the whole sphere from a seed in air until it changes, or is past the row ``lowest_px``."""
    plan = air_plan(frames.shape, level="fast", exposure_frames=exposure_frames, bottom=False)
    path = replace(seed, stiff=False)
    seen: list[Sighting] = []
    for first in range(seed.frames[0], frames.count, AT_ONCE):
        order = range(first, min(first + AT_ONCE, frames.count))
        seen += follow(frames, ground, path, order, plan)
        change = first_change(seen)
        past = change.whole_px > lowest_px + LATE * seed.radius
        if change.changed or past or seen[-1].frame < order[-1]:
            return change
    return first_change(seen)


def choose_surface(rows: Sequence[SurfaceRow], change: FirstChange, radius: float) -> list[SurfaceRow]:
    """Rows that can be the free surface, the likeliest first: those at which the sphere, of ``radius`` px, changes.

    ``rows`` are in the order in which they stand out. Empty where the sphere changes far above all of them; all of
    them where no change is seen.
    """
    if not change.changed:
        return list(rows)
    blind = 2.0 * abs(change.step_px)
    highest = change.whole_px - (SOON if change.by_shape else LATE) * radius
    lowest = change.whole_px + blind + SOON * radius
    return [row for row in rows if highest <= row.y_px <= lowest + row.thickness_px]


def changes_far_above(row: SurfaceRow, dry: Sequence[Sighting], radius: float) -> bool:
    """Whether the sphere, of ``radius`` px, is deformed or held back so far above a row that this is not the surface.

    ``dry`` are the sightings above it.
    """
    change = first_change(dry)
    return change.by_shape and not choose_surface([row], change, radius)
