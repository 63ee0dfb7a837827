from __future__ import annotations

import math

import numpy as np
import pytest

from wentry_cli.tracking.top_depth import (
    UNKNOWN_CAMERA,
    Height,
    between_frames,
    fall_height,
    find_approach,
    find_camera,
    find_turn,
)

RADIUS_M, DISTANCE, SPEED, SCALE = 0.0255, 1.5, 3.2, 2000.0
TIME = np.arange(-16, 60) / 2000 + 1.3e-4
UNC = np.full(TIME.size, 0.0014)


def entry(force: float) -> np.ndarray:
    """Height of a sphere slowed by a force coefficient, stepped through in small steps."""
    t, y, v = 0.0, RADIUS_M, SPEED
    fine, heights = 1e-5, []
    for at in TIME:
        while t < at:
            v, y, t = v - fine * 0.375 * force * v * v / RADIUS_M, y - fine * v, t + fine
        heights.append(y if at > 0 else RADIUS_M - SPEED * at - 0.5 * 9.81 * at * at)
    return np.array(heights)


def radii(height: np.ndarray, stretch: np.ndarray | float, seed: int = 0) -> np.ndarray:
    drawn = SCALE * RADIUS_M * stretch / (1 - height / DISTANCE)
    return np.asarray(drawn + np.random.default_rng(seed).normal(0, UNC))


@pytest.mark.parametrize("force", [0.3, 1.0, 2.0])
def test_the_depth_of_any_sphere_lies_within_its_uncertainty(force: float) -> None:
    height = fall_height(TIME, (SPEED, 0.01), RADIUS_M)
    off = np.abs(height.value_m - entry(force)) / np.maximum(height.unc_m, 2e-5)
    assert off.max() < math.sqrt(3)
    assert np.all(np.diff(height.unc_m[TIME > 0]) > 0)


def test_the_approach_tells_speed_and_contact() -> None:
    pulls = []
    for seed in range(30):
        pixels = radii(entry(1.0), 1.0, seed)
        found = find_approach(TIME + 2e-4, pixels, UNC, RADIUS_M, DISTANCE, (SCALE, 0.0))
        pulls.append([(found.speed_m_s - SPEED) / found.speed_unc_m_s, (found.contact_s - 2e-4) / found.contact_unc_s])
        assert found.contact_unc_s < 1e-4
    assert np.std(pulls, axis=0)[0] == pytest.approx(1.0, abs=0.35)
    assert np.max(np.abs(pulls)) < 4.0
    assert math.isnan(find_approach(TIME[16:], pixels[16:], UNC[16:], RADIUS_M, DISTANCE).speed_m_s)


@pytest.mark.parametrize("scale_known", [True, False])
def test_the_distance_follows_from_the_depth(scale_known: bool) -> None:
    height = entry(0.5)
    pulls = []
    for seed in range(30):
        ratio = (SCALE if scale_known else 1.0) * RADIUS_M / radii(height, 1.0, seed)
        camera = find_camera(Height(height, np.zeros_like(height)), ratio, ratio * UNC / 51, scale_known=scale_known)
        assert camera.distance_m == pytest.approx(DISTANCE, rel=0.01)
        pulls.append((camera.inverse_1_m - 1 / DISTANCE) / camera.unc_1_m)
    assert np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_a_camera_that_cannot_be_known_is_called_so() -> None:
    flat = Height(np.full(10, 0.02), np.zeros(10))
    ratio = np.ones(10) + np.random.default_rng(1).normal(0, 0.02, 10)
    assert find_camera(flat, ratio, np.full(10, 0.02), scale_known=True) == UNKNOWN_CAMERA
    assert find_camera(flat, np.full(10, np.nan), np.full(10, 0.02), scale_known=True) == UNKNOWN_CAMERA


@pytest.mark.parametrize("power", [1.5, 2.0])
def test_the_turn_of_the_radius_is_the_impact(power: float) -> None:
    stretch = 1 + 0.5 * np.minimum(np.maximum(TIME, 0) / 0.012, 1.0) ** power
    at, unc = find_turn(TIME, radii(entry(1.0), stretch))
    assert abs(at) < 1.5 * unc
    assert unc < 1.5e-3


def test_a_radius_that_only_shrinks_has_no_turn() -> None:
    assert math.isnan(find_turn(TIME, radii(entry(0.0), 1.0))[0])


def test_a_gap_is_bridged_with_the_speeds_at_its_ends() -> None:
    t = np.arange(-20, 120) / 2000.0
    path = np.where(t < 0, 0.0255 - 5.0 * t, 0.0255 - 5.0 * 0.03 * np.log1p(np.maximum(t, 0.0) / 0.03))
    hidden = (t > 0.0) & (t < 0.011)
    seen = Height(path[~hidden], np.full((~hidden).sum(), 1e-5))
    found, gap = between_frames(t[~hidden], seen, t)
    assert (gap == hidden).all()
    off = np.abs(found.value_m - path)
    line = np.abs(np.interp(t, t[~hidden], path[~hidden]) - path)
    assert off[hidden].max() < 0.2 * line[hidden].max()
    assert (off < 2.0 * found.unc_m + 1e-9).all()
    assert found.unc_m[~hidden] == pytest.approx(1e-5)
