"""Noise of the drawn frames: its variance grows with the light as asked, and it is normal and independent."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.synthetic.camera_noise import Sensor, expose_frame

SHAPE = (400, 500)


def frame(level: float, seed: int, bits: int = 12) -> np.ndarray:
    sensor = Sensor(bits=bits, level=0.7, noise=0.02, shot_share=0.6)
    light = np.full(SHAPE, 0.7 * sensor.white, np.float32)
    return expose_frame(np.full(SHAPE, level, np.float32), light, sensor, np.random.default_rng(seed)).astype(float)


@pytest.mark.parametrize("level", [1.0, 0.4, 0.1])
def test_read_and_shot_noise(level: float) -> None:
    ground = 0.7 * 4095.0
    seen = frame(level, 3)
    expected = 0.02 * ground * np.sqrt(0.4 + 0.6 * level)
    assert seen.mean() == pytest.approx(level * ground, abs=4.0 * expected / np.sqrt(seen.size))
    assert seen.std() == pytest.approx(expected, rel=0.01)


def test_the_noise_is_normal_and_independent() -> None:
    one = (frame(1.0, 5) - 0.7 * 4095.0) / (0.02 * 0.7 * 4095.0)
    other = (frame(1.0, 6) - 0.7 * 4095.0) / (0.02 * 0.7 * 4095.0)
    assert np.mean(one**3) == pytest.approx(0.0, abs=0.03)
    assert np.mean(one**4) == pytest.approx(3.0, abs=0.06)
    assert np.mean(np.abs(one) > 3.0) == pytest.approx(0.0027, abs=0.0005)
    for pair in ((one, other), (one[1:], one[:-1]), (one[:, 1:], one[:, :-1])):
        assert np.mean(pair[0] * pair[1]) == pytest.approx(0.0, abs=5.0 / np.sqrt(one.size))
    assert np.array_equal(frame(1.0, 5), frame(1.0, 5))
