"""Where a path starts: the sphere that falls, not its image that rises, nor droplets that are many."""

from __future__ import annotations

from wentry_cli.imaging.detection import Candidate
from wentry_cli.tracking.seed import _agreeing, _dwarfed, _falls


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
