"""Where the path starts: a frame in which the whole sphere is seen, and its neighbour."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background, coarse_transmission
from wentry_cli.imaging.detection import HALF_LEVEL, Candidate, faint_levels, find_spheres, shrink_factor
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.source import Frames, read_shrunk

LIKE_RADIUS = 0.08
FEWEST_AGREEING = 2
ENOUGH_AGREEING = 4
LONGEST_SCAN = 240
DWARF = 3.0  # times smaller than the sphere, a droplet
STILL_PX = 1.0  # what a round outline is off by from frame to frame
WHOLE_DEG = 330.0  # of outline: all of the sphere is seen, and the earliest such frame is the best
MOST_DEG = 240.0  # of outline: a sphere that the rim of the frame may cut

Range = tuple[float, float]
Sights = list[tuple[int, Candidate]]


def detect(
    frames: Frames, index: int, ground: Background, radius_range: Range, level: float = HALF_LEVEL
) -> list[Candidate]:
    """Spheres in one frame that are darker than ``level``, the roundest first; none where it cannot be read."""
    try:
        coarse, factor = read_shrunk(frames, index)
    except FrameUnreadableError:
        return []
    return find_spheres(coarse_transmission(coarse, ground), factor, radius_range=radius_range, level=level)


def find_seed(
    frames: Frames,
    ground: Background,
    indices: Iterable[int],
    *,
    radius_range: Range = (7.0, math.inf),
    falling: bool = False,
    fits: Callable[[Path], bool] | None = None,
    level: float = HALF_LEVEL,
) -> Path | None:
    """Find a frame to start from and return a path through it and a neighbour; None where no sphere is seen.

    Looks at the frames in ``indices``, then, should too few show one or nothing there ``fits``, at every second frame.
    What is seen in two frames or more with the same radius is the sphere; where it is ``falling``, what rises is none:
    its mirror image in the surface comes up to meet it. The path starts where most of the outline is seen, so that a
    sphere cut by the rim of the frame is followed from later, and where it ``fits``, if it does anywhere: a sphere and
    its image look like one round thing as they meet, and droplets are no spheres. What is darker than ``level`` may be
    a sphere.
    """
    first: Path | None = None
    for chosen in (indices, range(0, min(frames.count, 2 * LONGEST_SCAN), 2)):
        sights = _look_through(frames, ground, chosen, radius_range, level)
        agreeing = _agreeing(sights)
        able = [item for item in agreeing if not falling or _falls(item, agreeing)]
        few = not able or len({index for index, _ in agreeing}) < FEWEST_AGREEING or _dwarfed(agreeing, sights)
        if few and chosen is indices:
            continue
        for path in _paths(frames, ground, able or agreeing, level):
            if fits is None or fits(path):
                return path
            first = first or path
    return first


def _paths(frames: Frames, ground: Background, agreeing: Sights, level: float) -> Iterator[Path]:
    """Paths through what was seen and its neighbour in time, from where most of the outline is seen on."""
    for index, seen in sorted(agreeing, key=lambda item: -min(item[1].span_deg, WHOLE_DEG)):
        for neighbour in (index + 1, index - 1):
            path = _pair(frames, ground, (index, seen), neighbour, level)
            if path is not None:
                yield path


def find_faint_seed(
    frames: Frames,
    ground: Background,
    indices: list[int],
    *,
    radius_range: Range = (7.0, math.inf),
    falling: bool = False,
    fits: Callable[[Path], bool] | None = None,
) -> Path | None:
    """As ``find_seed``, for a sphere of little contrast, the darkest there is; it may be too faint to fit."""
    first: Path | None = None
    for level in faint_levels(ground.noise, shrink_factor(frames.shape)):
        seed = find_seed(frames, ground, indices, radius_range=radius_range, falling=falling, fits=fits, level=level)
        if seed is not None and (fits is None or fits(seed)):
            return seed
        first = first or seed
    return first


def _look_through(
    frames: Frames, ground: Background, indices: Iterable[int], radius_range: Range, level: float
) -> Sights:
    return [(index, item) for index in indices for item in detect(frames, index, ground, radius_range, level)]


def _agreeing(seen: Sights) -> Sights:
    """Candidates of like radius in the order of the frames, those of one frame as they were found.

    The first group from enough frames: early ones show the sphere by itself, later ones splash and cavity as well.
    Without such a group the largest there is. Droplets agree with one another too: what is far smaller than something
    else that was seen twice is not it.
    """
    counts = [len({at for at, _ in _like(reference, seen)}) for _, reference in seen]
    pairs = zip(seen, counts, strict=True)
    largest = max((item.radius for (_, item), count in pairs if count >= FEWEST_AGREEING), default=0.0)
    best: Sights = []
    most = (0, 0.0)
    for (_, reference), count in zip(seen, counts, strict=True):
        if reference.radius * DWARF < largest:
            continue
        if count >= ENOUGH_AGREEING:
            return sorted(_like(reference, seen), key=lambda member: member[0])
        if (count, reference.radius) > most:
            best, most = _like(reference, seen), (count, reference.radius)
    return sorted(best, key=lambda member: member[0])


def _like(reference: Candidate, seen: Sights) -> Sights:
    return [(at, item) for at, item in seen if abs(item.radius / reference.radius - 1.0) < LIKE_RADIUS]


def _dwarfed(group: Sights, seen: Sights) -> bool:
    """Whether something far larger was seen nearly whole: the sphere, in the one frame of the sample that shows it."""
    whole = max((item.radius for _, item in seen if item.span_deg > MOST_DEG), default=0.0)
    return any(item.radius * DWARF < whole for _, item in group)


def _falls(sight: tuple[int, Candidate], group: Sights) -> bool:
    """Whether the next frame shows something as low as this in its column; behind the last, the one before as high.

    Above its mirror image, which rises and goes on below it, a sphere falls; what is lowest and rises is the image.
    """
    index, seen = sight
    column = [item for at, item in group if at == index and abs(item.x - seen.x) < seen.radius]
    if min(item.y for item in column) < seen.y - seen.radius:
        return False  # the sphere is the upper of the two
    aligned = [(at, item.y) for at, item in group if abs(item.x - seen.x) < seen.radius and at != index]
    later = min((at for at, _ in aligned if at > index), default=None)
    earlier = max((at for at, _ in aligned if at < index), default=None)
    if later is not None:
        return max(y for at, y in aligned if at == later) > seen.y - STILL_PX
    return earlier is None or min(y for at, y in aligned if at == earlier) < seen.y + STILL_PX


def _pair(frames: Frames, ground: Background, seed: tuple[int, Candidate], neighbour: int, level: float) -> Path | None:
    if not 0 <= neighbour < frames.count:
        return None
    index, seen = seed
    allowed = (seen.radius * (1 - LIKE_RADIUS), seen.radius * (1 + LIKE_RADIUS))
    for other in detect(frames, neighbour, ground, allowed, level):
        if math.hypot(other.x - seen.x, other.y - seen.y) < 1.5 * seen.radius:
            path = Path(radius=0.5 * (seen.radius + other.radius), level=level)
            for frame, item in sorted([(index, seen), (neighbour, other)]):
                path.add(frame, EllipseShape(item.x, item.y, path.radius))
            return path
    return None
