from __future__ import annotations

import math

import numpy as np
import pytest

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.source import FrameArray
from wentry_cli.tracking.top import (
    TopScale,
    magnification_at,
    magnification_change,
    scale_from_approach,
    top_stretch,
    track_top,
)
from wentry_cli.tracking.top_depth import Height, TopCamera

RADIUS_M, DISTANCE = 0.0255, 1.5


def radius(frame: int) -> float:
    return 30.0 + 4.0 * math.sin(0.25 * max(frame - 8, 0))


def test_circles_until_the_splash_closes() -> None:
    frames = clip(lambda k: StillBody(79.6, 99.5, radius(k)), 40)
    values = np.stack([frames.read(k) for k in range(40)])
    values[26:] = np.clip(60 + 3 * np.random.default_rng(2).normal(size=(14, *SHAPE)), 0, 255).astype(np.uint8)
    frames = FrameArray(values)
    ground = ground_of(frames)
    seed = find_seed(frames, ground, range(0, 24, 4))
    assert seed is not None
    seen = track_top(frames, ground, seed)
    good = {item.frame: item.fit.radius_px for item in seen if item.ok and item.fit is not None}
    assert set(good) == set(range(26))
    assert max(abs(good[k] - radius(k)) for k in good) < 0.03
    assert {item.status for item in seen if item.frame >= 26} == {"occluded"}


def test_the_scale_follows_from_the_approach_and_the_distance() -> None:
    time = np.arange(-10, 5) / 2000
    height = RADIUS_M - 5.0 * time
    pixels = 2000.0 * RADIUS_M * DISTANCE / (DISTANCE - height)
    found = scale_from_approach(time, pixels, np.full(15, 0.001), RADIUS_M, DISTANCE)
    assert found.px_m == pytest.approx(2000.0, rel=2e-4)
    assert found.source == "approach"
    assert math.isnan(scale_from_approach(time[10:], pixels[10:], np.ones(5), RADIUS_M, None).px_m)
    far = [scale_from_approach(time, pixels, np.full(15, 0.001), RADIUS_M, distance) for distance in (None, math.inf)]
    assert far[0] == far[1]


def test_the_stretch_is_freed_from_the_perspective() -> None:
    height = Height(np.array([0.05, 0.0, -0.1]), np.array([0.0, 0.003, 0.003]))
    magnification = magnification_at(height, TopCamera(1 / DISTANCE, 0.01 / DISTANCE, "views"))
    assert magnification[0] == pytest.approx(DISTANCE / (DISTANCE - height.value_m))
    assert magnification[1] == pytest.approx([0.05 / 1.5 * 0.01, 0.002, 0.002], rel=0.15)
    pixels = 1.2 * 2000.0 * RADIUS_M * magnification[0]
    stretch, unc = top_stretch(pixels, np.full(3, 0.01), TopScale(2000.0, 2.0, "given"), RADIUS_M, magnification)
    assert stretch == pytest.approx(1.2)
    assert unc[1] == pytest.approx(np.hypot(np.hypot(0.01 / 51, 1.2e-3), 1.2 * 0.002), rel=0.01)


def test_what_the_sphere_at_rest_tells_is_no_longer_uncertain() -> None:
    """Ten frames in air and ten below: by how much errors of zero and distance change the ratio of their sizes."""
    high = np.linspace(0.07, -0.12, 20)
    rest = high > 0.025
    mean = float(np.mean(1.0 / (1.0 - high[rest] / DISTANCE)))

    def against_rest(zero: float = 0.0, inverse: float = 0.0) -> np.ndarray:
        shown = 1.0 / (1.0 - (high + zero) * (1.0 / DISTANCE + inverse))
        at_rest = 1.0 / (1.0 - high / DISTANCE)
        relative = shown / at_rest - 1.0
        return np.asarray(relative - relative[rest].mean())

    nothing = np.zeros(20)
    for height, camera, wrong in (
        (Height(high, nothing, 3e-4), TopCamera(1.0 / DISTANCE, 0.0, "given"), against_rest(zero=3e-4)),
        (Height(high, nothing), TopCamera(1.0 / DISTANCE, 0.01, "views"), against_rest(inverse=0.01)),
    ):
        change = magnification_change(height, camera, rest)
        assert change == pytest.approx(np.abs(wrong), rel=0.02, abs=1e-7)
        assert change[rest].max() < 0.5 * (magnification_at(height, camera)[1] / mean).max()
    own = magnification_change(Height(high, np.full(20, 1e-3)), TopCamera(1.0 / DISTANCE, 0.0, "given"), rest)
    assert own == pytest.approx(1e-3 / DISTANCE, rel=0.1)


def test_a_stretch_that_no_sphere_can_have_is_none() -> None:
    """Three frames: the sphere above the camera, a scale ten times too small, and one that is right."""
    height = Height(np.array([DISTANCE + 0.1, 0.0, -0.1]), np.zeros(3))
    magnification = magnification_at(height, TopCamera(1 / DISTANCE, 0.0, "given"))
    assert np.isnan(magnification[0]).tolist() == [True, False, False]
    pixels = np.array([1.0, 10.0, 1.0]) * 2000.0 * RADIUS_M * np.nan_to_num(magnification[0], nan=-1.0)
    stretch, unc = top_stretch(pixels, np.full(3, 0.01), TopScale(2000.0, 2.0, "given"), RADIUS_M, magnification)
    assert np.isnan(stretch).tolist() == np.isnan(unc).tolist() == [True, True, False]
    for far in (0.5, 3.0):
        beyond, _ = top_stretch([far * 51.0], [0.01], TopScale(2000.0, 2.0, "given"), 0.0255, ([1.0], [0.0]))
        assert np.isnan(beyond).all()
