"""Where a path starts: the sphere that falls, not its image that rises, nor droplets that are many."""

from __future__ import annotations

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.imaging.detection import Candidate
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.seed import _agreeing, _dwarfed, _falls, find_seed
from wentry_cli.tracking.source import FrameArray


def ball(y: float, radius: float = 100.0, x: float = 300.0, span: float = 358.0) -> Candidate:
    return Candidate(x, y, radius, span, 0.01)


IMAGE = [(frame, ball(900.0 - 9.0 * frame, 104.0)) for frame in (0, 10, 20, 30, 40)]
SPHERE = [(frame, ball(-200.0 + 9.0 * frame)) for frame in (30, 40)]


def test_an_image_that_rises_to_meet_the_sphere_is_none() -> None:
    group = _agreeing(sorted([*IMAGE, *SPHERE], key=lambda item: item[0]))
    assert len(group) == 7
    assert [item for item in group if _falls(item, group)] == SPHERE


def test_droplets_do_not_outvote_a_sphere_seen_twice() -> None:
    droplets = [(frame, ball(80.0 + frame, 9.0, x=700.0)) for frame in (50, 60, 70, 80, 90)]
    assert _agreeing([*SPHERE, *droplets]) == SPHERE


def test_a_sphere_seen_whole_once_asks_for_another_look() -> None:
    droplets = [(frame, ball(80.0 + frame, 9.0, x=700.0)) for frame in (50, 60, 70, 80, 90)]
    seen = [SPHERE[0], *droplets]
    assert _dwarfed(_agreeing(seen), seen)
    assert not _dwarfed(SPHERE, [*SPHERE, *droplets])


def test_a_sphere_that_the_rim_cuts_asks_for_it_too() -> None:
    droplets = [(frame, ball(80.0 + frame, 9.0, x=700.0)) for frame in (50, 60, 70)]
    cut = [(20, ball(95.0, span=282.0)), *droplets]
    assert _dwarfed(_agreeing(cut), cut)
    hardly = [(20, ball(-60.0, span=150.0)), *droplets]
    assert not _dwarfed(_agreeing(hardly), hardly)


def discs(places: list[list[tuple[float, float, float]]]) -> FrameArray:
    y, x = np.mgrid[:120, :160]
    frames = [np.full((120, 160), 200, np.uint8) for _ in places]
    for frame, there in zip(frames, places, strict=True):
        for across, down, radius in there:
            frame[np.hypot(x - across, y - down) < radius] = 10
    return FrameArray(np.stack(frames))


def test_what_nothing_fits_in_the_sample_is_looked_for_in_more_frames() -> None:
    droplet = (120.0, 40.0, 8.0)
    fall = [[(50.0, 10.0 * frame, 24.0), droplet] if frame < 8 else [droplet] for frame in range(20)]
    frames = discs(fall)
    ground = Background(
        np.full((120, 160), 200, np.float32), np.full((120, 160), 1 / 200, np.float32), 0.0, float("inf"), 255.0, 0.0
    )
    late = range(9, 20, 2)

    def is_the_sphere(path: Path) -> bool:
        return path.radius > 20.0

    decoy = find_seed(frames, ground, late)
    assert decoy is not None
    assert decoy.radius < 10.0
    found = find_seed(frames, ground, late, fits=is_the_sphere)
    assert found is not None
    assert abs(found.radius - 24.0) < 1.5
    # where nothing fits at all, as where a picture was compressed hard, it is what was seen first
    assert find_seed(frames, ground, range(8), fits=lambda _: False) == find_seed(frames, ground, range(8))
