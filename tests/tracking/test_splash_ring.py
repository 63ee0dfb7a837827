from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.source import FrameArray
from wentry_cli.tracking.splash_ring import judge_rings
from wentry_cli.tracking.top import _like_the_sphere, track_top

CENTRE, RADIUS = (80, 100), 30.0


def ringed(inner: dict[int, float], aside: int = 0) -> tuple[FrameArray, np.ndarray]:
    """A still disc; in the frames named a dark ring of that inner radius stands round it, shifted aside."""
    frames = clip(lambda k: StillBody(float(CENTRE[0]), float(CENTRE[1]), RADIUS), 40)
    values = np.stack([frames.read(k) for k in range(40)])
    for frame, radius in inner.items():
        rows, columns = np.indices(SHAPE)
        away = np.hypot(columns - CENTRE[0] - aside, rows - CENTRE[1])
        cover = np.clip(away - radius + 0.5, 0, 1) * np.clip(radius + 14 - away + 0.5, 0, 1)
        cover = cv2.GaussianBlur(cover, (0, 0), 1.0)
        values[frame] = np.clip(values[frame] * (1 - cover) + 60 * cover, 0, 255).astype(np.uint8)
    return FrameArray(values), values


def test_a_ring_that_hides_the_edge_is_said_so_and_the_sphere_is_found_again() -> None:
    hidden = set(range(12, 27))
    _, values = ringed({})
    for k in hidden:
        values[k] = np.clip(60 + 3 * np.random.default_rng(k).normal(size=SHAPE), 0, 255)
    frames = FrameArray(values)
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    assert [item.frame for item in seen] == list(range(40))
    good = {item.frame: item.fit.radius_px for item in seen if item.ok and item.fit is not None}
    assert {*range(12), *range(27, 40)} <= set(good)
    assert max(abs(good[k] - RADIUS) for k in (*range(12), *range(27, 40))) < 0.03
    assert not set(good) & hidden


def test_a_near_ring_widens_the_uncertainty_and_a_far_one_does_not() -> None:
    frames, _ = ringed({20: 35.5, 24: 42.0}, aside=0)
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    unc = {item.frame: item.fit.radius_unc_px for item in track_top(frames, ground, seed) if item.ok and item.fit}
    assert unc[24] < 1.5 * unc[10]
    assert 20 not in unc or unc[20] > 2.0 * unc[10]


def test_a_circle_that_does_not_agree_with_itself_is_occluded() -> None:
    frames, _ = ringed({})
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    fit = seen[5].fit
    assert fit is not None
    seen[5] = seen[5]._replace(fit=fit._replace(residual_rms_px=10 * fit.residual_rms_px))
    judged = judge_rings(frames, ground, seen)
    assert judged[5].status == "occluded"
    assert all(item.ok for item in judged if item.frame != 5)


def test_a_ring_that_is_followed_in_most_frames_is_not_the_usual() -> None:
    """The few plain circles say what the residual of a sphere is."""
    frames, _ = ringed({})
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    for k in range(8, 40):
        fit = seen[k].fit
        assert fit is not None
        seen[k] = seen[k]._replace(fit=fit._replace(gated_fraction=0.4, residual_rms_px=10 * fit.residual_rms_px))
    judged = judge_rings(frames, ground, seen)
    assert [item.frame for item in judged if item.ok] == list(range(8))


def test_the_outer_edge_of_a_ring_is_not_as_dark_within_as_the_sphere() -> None:
    frames, _ = ringed({})
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    circle = track_top(frames, ground, seed)[seed.frames[-1] + 1]
    assert circle.inside < 0.2
    accept = _like_the_sphere(seed, [(circle.inside, circle.lightest)] * 5)
    assert accept(circle)
    assert not accept(circle._replace(inside=circle.inside + 0.3))
    assert not accept(circle._replace(lightest=circle.lightest + 0.3))


def shrinking(frame: int) -> float:
    return 36.0 - 2.0 * math.sin(0.1 * frame) - 0.25 * max(frame - 12, 0)


@pytest.mark.parametrize(("thickness", "level"), [(8.0, 40.0), (8.0, 15.0), (4.0, 40.0), (14.0, 25.0)])
def test_the_sphere_is_followed_in_the_gap_within_a_smooth_ring(thickness: float, level: float) -> None:
    """The outer edge of the ring is smooth and closed, a radius is soon not in reach, the gap within is bright."""
    bare = clip(lambda k: StillBody(float(CENTRE[0]), float(CENTRE[1]), shrinking(k)), 40)
    values = np.stack([bare.read(k) for k in range(40)])
    rows, columns = np.indices(SHAPE)
    away = np.hypot(columns - CENTRE[0], rows - CENTRE[1])
    for k in range(14, 40):
        inner = shrinking(14) + 1.0 + 0.3 * (k - 14)
        cover = np.clip(away - inner + 0.5, 0, 1) * np.clip(inner + thickness - away + 0.5, 0, 1)
        cover = cv2.GaussianBlur(cover, (0, 0), 1.0)
        values[k] = np.round(values[k] * (1 - cover) + level * cover).astype(np.uint8)
    frames, ground = FrameArray(values), ground_of(bare)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    good = {item.frame: item.fit for item in seen if item.ok and item.fit is not None}
    assert {*range(14), *range(25, 40)} <= set(good)
    for k, fit in good.items():
        assert abs(fit.radius_px - shrinking(k)) < max(0.03, 4.0 * fit.radius_unc_px)
    assert {item.status for item in seen if item.frame not in good} <= {"poor_fit", "occluded"}


def test_a_radius_does_not_leap_over_what_is_hidden() -> None:
    frames, _ = ringed({})
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    accept, at = _like_the_sphere(seed, []), seed.frames[-1]
    circle = seen[at + 2]
    assert circle.fit is not None
    assert accept(circle)
    assert not accept(circle._replace(fit=circle.fit._replace(radius_px=RADIUS * 1.17)))


def test_the_grey_floor_of_a_cavity_is_no_ring() -> None:
    bare, values = ringed({})
    rows, columns = np.indices(SHAPE)
    away = np.hypot(columns - CENTRE[0], rows - CENTRE[1])
    floor = 1.0 - 0.35 * cv2.GaussianBlur((away < 65.0).astype(float), (0, 0), 1.0)
    for frame in range(10, 40):
        values[frame] = np.round(values[frame] * floor)
    frames, ground = FrameArray(values), ground_of(bare)
    seed = find_seed(frames, ground, range(0, 10, 2))
    assert seed is not None
    good = {item.frame: item.fit for item in track_top(frames, ground, seed) if item.ok}
    assert set(range(40)) <= set(good)
    assert max(abs(good[k].radius_px - RADIUS) for k in range(10, 40)) < 0.03
