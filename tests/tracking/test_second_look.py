"""Frames that failed are looked at once more from their neighbours, and taken where smooth motion explains them."""

from __future__ import annotations

from functools import cache

import numpy as np

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.follow import follow
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.second_look import look_again
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.source import FrameArray
from wentry_cli.tracking.wet_plan import SideScene, WetPlan

RADIUS, COUNT = 22.0, 24
GONE, ELSEWHERE = 15, 17


def body(frame: int) -> StillBody:
    return StillBody(80.0, 40.0 + 4.0 * frame - 0.02 * frame**2, RADIUS, 1.0 + 0.06 * np.sin(frame / 5.0))


def drawn(frame: int) -> StillBody:
    """In one frame something else of its size stands 10 px beside where the sphere was."""
    shape = body(frame)
    return StillBody(90.0, shape.center_y_px, RADIUS) if frame == ELSEWHERE else shape


@cache
def scene() -> tuple[FrameArray, Background, list[Sighting]]:
    """A clip whose surface is far above, in one frame of which the sphere is not to be seen, and its sightings."""
    frames, ground = clip(drawn, COUNT), ground_of(clip(body, COUNT))
    values = np.stack([frames.read(k) for k in range(COUNT)])
    values[GONE] = np.round(ground.level).astype(values.dtype)
    frames, path = FrameArray(values), Path(RADIUS)
    for frame in (0, 1):
        path.add(frame, EllipseShape(80.0, body(frame).center_y_px, RADIUS, body(frame).stretch))
    seen = follow(frames, ground, path, range(COUNT), plan())
    return frames, ground, [item._replace(wet=True) for item in seen]


def plan() -> WetPlan:
    return WetPlan(SideScene(-200.0), SHAPE, known=True)


def seen_again(failed: list[int], status: str = "occluded", *, believed: bool = True) -> dict[int, Sighting]:
    frames, ground, seen = scene()
    spoilt = [Sighting(k, status, wet=True) if k in failed else item for k, item in enumerate(seen)]
    return {item.frame: item for item in look_again(frames, ground, spoilt, plan(), lambda _: believed)}


def test_frames_that_a_path_led_astray_did_not_see_are_measured() -> None:
    failed = [6, 7, 8, 9, 22, 23]
    found = seen_again(failed)
    for frame in failed:
        fit = found[frame].fit
        assert found[frame].ok
        assert found[frame].wet
        assert fit is not None
        assert abs(fit.center_y_px - body(frame).center_y_px) < 0.05
        assert abs(fit.stretch - body(frame).stretch) < 2e-3


def test_where_the_sphere_is_not_to_be_seen_nothing_is() -> None:
    found = seen_again([GONE, ELSEWHERE])
    assert found[GONE].status == found[ELSEWHERE].status == "occluded"


def test_what_is_not_believed_or_cannot_be_read_stays_as_it_was() -> None:
    assert not seen_again([8], believed=False)[8].ok
    assert seen_again([8], "gap")[8].status == "gap"


def test_a_few_frames_do_not_tell_where_to_look() -> None:
    assert not seen_again([k for k in range(COUNT) if k not in (4, 5, 6)])[7].ok


def test_good_frames_are_left_alone() -> None:
    _, _, seen = scene()
    found = seen_again([8])
    assert all(found[k] is seen[k] for k in range(COUNT) if seen[k].ok and k != 8)
