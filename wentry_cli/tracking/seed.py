"""Where the path starts: a frame in which the whole sphere is seen, and its neighbour."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background, coarse_transmission
from wentry_cli.imaging.detection import Candidate, find_spheres
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.source import Frames

LIKE_RADIUS = 0.08
FEWEST_AGREEING = 2
ENOUGH_AGREEING = 4
LONGEST_SCAN = 240
WHOLE_DEG = 330.0  # of outline: all of the sphere is seen, and the earliest such frame is the best

Range = tuple[float, float]
Sights = list[tuple[int, Candidate]]


def detect(frames: Frames, index: int, ground: Background, radius_range: Range) -> list[Candidate]:
    """Spheres in one frame, the roundest first; none where the frame cannot be read."""
    try:
        raw = frames.read(index)
    except FrameUnreadableError:
        return []
    return find_spheres(*coarse_transmission(raw, ground), radius_range=radius_range)


def find_seed(
    frames: Frames,
    ground: Background,
    indices: Iterable[int],
    *,
    radius_range: Range = (7.0, math.inf),
    lowest_px: float = math.inf,
) -> Path | None:
    """Find a frame to start from and return a path through it and a neighbour; None where no sphere is seen.

    Looks at the frames in ``indices``, then, should too few show one, at every second frame. What is seen in two frames
    or more with the same radius is the sphere; a candidate whose bottom lies below the row ``lowest_px`` is none. The
    path starts where most of the outline is seen, so that a sphere cut by the rim of the frame is followed from later.
    """
    limits = (radius_range, lowest_px)
    agreeing = _agreeing(_look_through(frames, ground, indices, limits))
    if len(agreeing) < FEWEST_AGREEING:
        every_second = range(0, min(frames.count, 2 * LONGEST_SCAN), 2)
        agreeing = _agreeing(_look_through(frames, ground, every_second, limits))
    for index, seen in sorted(agreeing, key=lambda item: -min(item[1].span_deg, WHOLE_DEG)):
        for neighbour in (index + 1, index - 1):
            path = _pair(frames, ground, (index, seen), neighbour)
            if path is not None:
                return path
    return None


def _look_through(frames: Frames, ground: Background, indices: Iterable[int], limits: tuple[Range, float]) -> Sights:
    seen: Sights = []
    for index in indices:
        for candidate in detect(frames, index, ground, limits[0]):
            if candidate.y + candidate.radius <= limits[1]:
                seen.append((index, candidate))
    return seen


def _agreeing(seen: Sights) -> Sights:
    """Candidates of like radius, one a frame, in the order of the frames.

    The first group of enough members: early frames show the sphere by itself, later ones splash and cavity as well.
    Without such a group the largest there is.
    """
    best: dict[int, Candidate] = {}
    for _, reference in seen:
        group: dict[int, Candidate] = {}
        for index, item in seen:
            if abs(item.radius / reference.radius - 1.0) < LIKE_RADIUS and index not in group:
                group[index] = item
        if len(group) >= ENOUGH_AGREEING:
            return sorted(group.items())
        if (len(group), reference.radius) > (len(best), _median_radius(best)):
            best = group
    return sorted(best.items())


def _median_radius(group: dict[int, Candidate]) -> float:
    return float(np.median([item.radius for item in group.values()])) if group else 0.0


def _pair(frames: Frames, ground: Background, seed: tuple[int, Candidate], neighbour: int) -> Path | None:
    if not 0 <= neighbour < frames.count:
        return None
    index, seen = seed
    allowed = (seen.radius * (1 - LIKE_RADIUS), seen.radius * (1 + LIKE_RADIUS))
    for other in detect(frames, neighbour, ground, allowed):
        if math.hypot(other.x - seen.x, other.y - seen.y) < 1.5 * seen.radius:
            path = Path(radius=0.5 * (seen.radius + other.radius))
            for frame, item in sorted([(index, seen), (neighbour, other)]):
                path.add(frame, EllipseShape(item.x, item.y, path.radius))
            return path
    return None
