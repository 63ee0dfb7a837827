from __future__ import annotations

import math

import numpy as np
import pytest

from wentry_cli.kinematics.release import release_time

FPS, G, UNC = 1000.0, 9.81, 1e-5


def path(count: int, release_s: float, speed: float = 0.0, gravity: float = G, seed: int = 0) -> tuple[np.ndarray, ...]:
    time = np.arange(count) / FPS
    since = np.maximum(time - release_s, 0.0)
    height = 0.1 - speed * time - 0.5 * gravity * since**2
    return time, height + UNC * np.random.default_rng(seed).normal(size=count), np.full(count, UNC)


@pytest.mark.parametrize("gravity", [G, 0.25 * G])
@pytest.mark.parametrize(("count", "release"), [(120, 0.0687), (120, 0.1003), (120, 0.0204), (2000, 1.9503)])
def test_a_sphere_that_is_let_go(count: int, release: float, gravity: float) -> None:
    assert release_time(*path(count, release, gravity=gravity)) == pytest.approx(release, abs=1.5e-3)


def test_rows_count_downwards_and_gaps_do_not_count() -> None:
    time, height, unc = path(120, 0.06)
    height[40:50] = np.nan
    assert release_time(time, -2000.0 * height, 2000.0 * unc) == pytest.approx(0.06, abs=1.5e-3)


@pytest.mark.parametrize("seed", range(40))
def test_what_falls_from_the_first_frame_on_was_not_held(seed: int) -> None:
    assert release_time(*path(60, -0.3 + 0.0075 * seed, seed=seed)) == -math.inf
    assert release_time(*path(4, 0.001)) == -math.inf


def test_a_sphere_that_is_carried_down_is_not_held() -> None:
    assert release_time(*path(120, 0.06, speed=0.3)) == -math.inf
