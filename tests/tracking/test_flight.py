from __future__ import annotations

import numpy as np
import pytest

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.flight import air_plan, both_ways, leaves_frame
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.source import FrameArray

RADIUS = 24.0


def falling(frame: int) -> StillBody:
    return StillBody(80.2, -10.0 + 6.5 * frame, RADIUS, motion_px=(0.0, 1.0))


@pytest.fixture(scope="module")
def fall() -> FrameArray:
    return clip(falling, 36)


def test_a_fall_is_followed_from_where_it_comes_in_to_where_it_leaves(fall: FrameArray) -> None:
    ground = ground_of(fall)
    seed = find_seed(fall, ground, range(0, 36, 3))
    assert seed is not None
    seen, _ = both_ways(fall, ground, seed, air_plan(SHAPE, exposure_frames=1 / 6.5), 35)
    good = {item.frame: item.fit for item in seen if item.ok}
    whole = [k for k in range(36) if RADIUS < falling(k).center_y_px < SHAPE[0] - RADIUS]
    assert set(whole) <= set(good)
    error = np.array([good[k].center_y_px - falling(k).center_y_px for k in whole])
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.median([good[k].radius_px for k in whole]) == pytest.approx(RADIUS, abs=0.01)
    assert seen[-1].status == "out_of_frame"


def test_no_sphere_no_seed() -> None:
    rng = np.random.default_rng(3)
    frames = FrameArray((180 + 2 * rng.normal(size=(8, *SHAPE))).astype(np.uint8))
    assert find_seed(frames, ground_of(frames), range(8)) is None


def test_what_has_left_the_frame() -> None:
    assert leaves_frame(EllipseShape(80.0, 210.0, 24.0), SHAPE)
    assert not leaves_frame(EllipseShape(80.0, 10.0, 24.0), SHAPE)


def test_a_path_starts_where_the_whole_sphere_is_seen(fall: FrameArray) -> None:
    seed = find_seed(fall, ground_of(fall), range(36))
    assert seed is not None
    assert RADIUS < falling(seed.frames[0]).center_y_px < SHAPE[0] - RADIUS
