from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.synthetic.camera_noise import Sensor
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still

SHAPE = (160, 160)


def draw(body: StillBody, light: StillLight, seed: int = 1):
    return draw_still(body, light, SHAPE, np.random.default_rng(seed))


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (12, np.uint16), (16, np.uint16)])
def test_noise_and_depth_are_as_asked(bits, kind):
    still = draw(StillBody(80.0, 80.0, 30.0), StillLight(sensor=Sensor(bits=bits, noise=0.02)))
    ground = still.flat[:30].astype(float)
    assert still.levels.dtype == kind
    assert still.levels.max() < 2**bits
    assert ground.mean() == pytest.approx(1.0, abs=2e-3)
    assert ground.std() == pytest.approx(0.02, rel=0.05)


def test_shot_noise_is_weaker_in_the_dark():
    still = draw(StillBody(80.0, 80.0, 60.0), StillLight(sensor=Sensor(bits=16, noise=0.02, shot_share=0.75), dark=0.0))
    inside = still.flat[60:100, 60:100].astype(float)
    assert inside[inside > 0].size > 100
    assert draw_dark_noise() == pytest.approx(0.01, rel=0.1)


def draw_dark_noise() -> float:
    light = StillLight(sensor=Sensor(bits=16, noise=0.02, shot_share=0.75), dark=0.2)
    dark = draw(StillBody(80.0, 80.0, 60.0), light).flat[60:100, 60:100].astype(float).std()
    return float(np.sqrt(dark**2 - 0.2 * 0.75 * 0.02**2))


def test_motion_blurs_along_its_direction_only():
    still = draw(StillBody(80.0, 80.0, 30.0), StillLight())
    moved = draw(StillBody(80.0, 80.0, 30.0, motion_px=(0.0, 4.0)), StillLight())
    steepest = [float(np.abs(np.diff(s.transmission[:, 80])).max()) for s in (still, moved)]
    assert steepest[1] < 0.75 * steepest[0]
    side = np.abs(np.diff(moved.transmission[80])).max() / np.abs(np.diff(still.transmission[80])).max()
    assert side == pytest.approx(1.0, abs=0.02)


def test_droplets_cover_about_the_share_that_is_asked():
    clean = draw(StillBody(80.0, 80.0, 50.0), StillLight())
    spoilt = draw(StillBody(80.0, 80.0, 50.0), StillLight(droplets=0.3), seed=3)
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    column, row = (np.round(80.0 + 50.0 * f(angle)).astype(int) for f in (np.cos, np.sin))
    touched = np.abs(spoilt.transmission - clean.transmission)[row, column] > 0.02
    assert 0.12 < touched.mean() < 0.55


def test_separation_joins_a_cavity_to_the_upper_part_only():
    clean = draw(StillBody(80.0, 90.0, 40.0, 1.2), StillLight())
    joined = draw(StillBody(80.0, 90.0, 40.0, 1.2, separation_y_px=85.0), StillLight())
    assert joined.transmission[40, 80] == pytest.approx(0.08, abs=1e-4)
    np.testing.assert_allclose(joined.transmission[95:], clean.transmission[95:], atol=1e-4)


def test_misfit_is_told_in_the_truth():
    still = draw(StillBody(80.0, 80.0, 50.0, misfit=(0.0, 0.005)), StillLight())
    assert still.bottom_y_px == pytest.approx(80.0 + 50.25, abs=1e-6)
    assert still.half_width_px == pytest.approx(50.25, abs=1e-6)
