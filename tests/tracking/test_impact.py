from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.tracking.impact import back_to_surface, find_impact

SCALE, FPS, G = 2000.0, 2000.0, 9.81


def path(impact_s: float, speed: float, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(16) / FPS
    time = time[time < impact_s]
    fall = time - impact_s
    row = 300.0 + SCALE * (speed * fall + 0.5 * G * fall**2)
    return time, row + noise * np.random.default_rng(seed).normal(size=time.size)


@given(impact=st.floats(0.004, 0.009), speed=st.floats(0.5, 8.0))
def test_the_impact_of_a_clean_path_is_exact(impact: float, speed: float) -> None:
    time, row = path(impact, speed, 0.0)
    found = find_impact(time, row, np.full(time.size, 0.01), (300.0, 0.0), G * SCALE)
    assert found.status == "ok"
    assert found.time_s == pytest.approx(impact, abs=1e-9)
    assert found.speed_px_s == pytest.approx(SCALE * speed, rel=1e-7)


def test_the_stated_uncertainty_is_that_of_repeated_paths() -> None:
    pulls = []
    for seed in range(200):
        time, row = path(0.0071, 5.0, 0.02, seed)
        found = find_impact(time, row, np.full(time.size, 0.02), (300.0, 0.0), G * SCALE)
        pulls.append((found.time_s - 0.0071) / found.time_unc_s)
    assert 0.75 < np.std(pulls) < 1.1


def test_the_surface_adds_its_own_uncertainty() -> None:
    time, row = path(0.0071, 5.0, 0.0)
    found = find_impact(time, row, np.full(time.size, 0.001), (300.0, 1.0), G * SCALE)
    assert found.time_unc_s == pytest.approx(1.0 / (5.0 * SCALE), rel=0.01)
    known = find_impact(time, row, np.full(time.size, 0.001), (300.0, 0.0), G * SCALE)
    assert 0.0 < found.time_random_s == known.time_random_s == known.time_unc_s


def test_too_few_frames_and_a_path_that_never_arrives() -> None:
    assert find_impact([0.0, 1e-3], [1.0, 2.0], [0.1, 0.1], (300.0, 0.1), G * SCALE).status == "too_few"
    time = np.arange(10) / FPS
    rising = 100.0 - SCALE * (0.1 * time)
    found = find_impact(time, rising, np.full(10, 0.01), (0.0, 0.1), G * SCALE)
    assert found.status == "no_object"
    assert math.isnan(found.time_s)


def test_a_clip_that_starts_later_is_followed_back() -> None:
    time = 0.002 + np.arange(12) / FPS
    row = 300.0 + SCALE * (5.0 * time - 60.0 * time**2)
    found, unc = back_to_surface(time, row, (300.0, 0.05))
    assert abs(found) < 3 * unc < 0.003
    assert math.isnan(back_to_surface(time[:3], row[:3], (300.0, 0.05))[0])
