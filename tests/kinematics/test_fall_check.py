from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.kinematics.fall_check import Fall, check_fall

FPS, SPEED, GRAVITY, PIXEL = 2000.0, 3.5, 9.81, 1.0 / 2200.0
TIMES = (np.arange(60) - 30.5) / FPS


def heights(gravity: float = GRAVITY) -> NDArray[np.float64]:
    noise = np.random.default_rng(3).normal(0.0, 0.01 * PIXEL, TIMES.size)
    return np.asarray(-SPEED * TIMES - 0.5 * gravity * TIMES**2 + noise)


def checked(height: NDArray[np.float64]) -> Fall:
    fall = check_fall(TIMES, (height, np.full(TIMES.size, 0.01 * PIXEL)), GRAVITY, PIXEL)
    assert fall is not None
    return fall


def test_a_fall_leaves_the_speed_as_it_is() -> None:
    fall = checked(heights())
    assert fall.falls
    assert fall.falls_early
    assert fall.acceleration == pytest.approx(GRAVITY, abs=5.0 * fall.unc)
    assert fall.speed_doubt(SPEED) == 0.0


def test_a_camera_that_shakes_leaves_the_speed_in_doubt() -> None:
    """A swing of 1.2 px in two thirds of its period moves the speed by its own: the doubt holds the error."""
    shaken = heights() + 1.2 * PIXEL * np.sin(2.0 * np.pi * 60.0 * TIMES + 1.0)
    fall = checked(shaken)
    assert not fall.falls
    for wrong in fall.speeds:
        assert abs(wrong - SPEED) < 2.0 * fall.speed_doubt(wrong)


def test_frames_at_the_surface_that_show_no_fall_do_not_hide_that_the_rest_is_none() -> None:
    """Only the last frames, in which something else is seen, make the acceleration of all of them uncertain."""
    fast = heights(38.0)
    fast[(TIMES > -0.003) & (TIMES < 0.0)] += 0.003
    fall = checked(fast)
    assert not fall.falls
    assert fall.acceleration == pytest.approx(38.0, abs=5.0 * fall.unc)


def test_too_few_frames_in_air_tell_nothing() -> None:
    assert check_fall(TIMES[24:], (heights()[24:], np.full(36, PIXEL)), GRAVITY, PIXEL) is None
