from __future__ import annotations

import numpy as np
import pytest
from entry_truths import G, fall, rms

from wentry_cli.kinematics.centre import centre_height, early_shape_time, early_shape_time_from_period
from wentry_cli.kinematics.entry import (
    fall_before_impact,
    fall_speed,
    impact_velocity,
    solve_entry_motion,
    stretch_in_air,
)
from wentry_cli.kinematics.state_pass import Ballistic

R = 0.0255


def test_centre_of_an_ellipsoid() -> None:
    height, unc = centre_height(np.array([-0.1]), np.array([0.0]), np.array([1.25]), np.array([0.01]), R)
    assert height[0] == pytest.approx(-0.1 + R / 1.25**2)
    assert unc[0] == pytest.approx(2 * R / 1.25**3 * 0.01)


def test_half_a_millimetre_for_a_hundredth() -> None:
    _, unc = centre_height(np.zeros(1), np.zeros(1), np.ones(1), np.array([0.01]), R)
    assert unc[0] == pytest.approx(0.51e-3)


def test_early_shape() -> None:
    assert early_shape_time(R, 6900.0, 1070.0) == pytest.approx(0.01004, rel=1e-3)
    period = 1.4 * 2 * R / np.sqrt(6900 / 1070)
    assert early_shape_time_from_period(period) == pytest.approx(early_shape_time(R, 6900.0, 1070.0))


def entry(seed: int, stretch_noise: float = 1e-3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    truth = fall("soft")
    random = np.random.default_rng(seed)
    s = np.maximum(truth.t, 0)
    stretch = np.exp(0.3 * np.exp(-12 * s) * np.sin(2 * np.pi * s / 0.03))
    y_b = truth.y + R - R / stretch**2 + 2.5e-5 * random.normal(size=s.size)
    return y_b, stretch + stretch_noise * random.normal(size=s.size), np.full(s.size, stretch_noise)


def test_velocity_from_bottom_and_stretch() -> None:
    truth = fall("soft")
    y_b, stretch, unc = entry(0)
    motion = solve_entry_motion(
        truth.t, (y_b, np.full(y_b.size, 2.5e-5)), (stretch, unc), R, ballistic=Ballistic(-G, 0.1)
    )
    off = rms((motion.velocity - truth.v)[truth.inside])
    assert off < 6e-3
    assert rms(((motion.velocity - truth.v) / motion.velocity_unc)[truth.inside]) < 1.5
    dry = truth.t < 0
    assert np.allclose(motion.centre_m[dry], y_b[dry] + R)
    assert np.all(np.abs((motion.velocity - motion.bottom_velocity)[dry]) < 4e-3)


def test_an_error_of_shape_that_varies_slowly_is_in_the_error_bar() -> None:
    """λ is wrong by as much as it says, but smoothly: the scatter does not show it, the uncertainty does."""
    truth = fall("soft")
    y_b, stretch, _ = entry(0, 1e-4)
    after = np.maximum(truth.t, 0)
    wrong = stretch - 0.01 * np.sin(2 * np.pi * after / 0.03)
    known = (y_b, np.full(y_b.size, 2.5e-5)), (wrong, np.full(y_b.size, 7e-3)), R
    blind, honest = (
        solve_entry_motion(truth.t, *known, ballistic=Ballistic(-G, 0.1), slow_s=slow) for slow in (np.inf, 0.015)
    )
    pulls = [rms(((m.velocity - truth.v) / m.velocity_unc)[truth.inside]) for m in (blind, honest)]
    assert pulls[0] > 4.5
    assert pulls[1] < 3.3


def test_a_steady_error_of_the_stretch_is_in_the_error_bar_while_its_lever_changes() -> None:
    truth = fall("soft")
    y_b, stretch, _ = entry(0, 1e-4)
    wrong = np.where(truth.t > 0, stretch + 0.006, stretch)
    motion = solve_entry_motion(
        truth.t,
        (y_b, np.full(y_b.size, 2.5e-5)),
        (wrong, np.where(truth.t > 0, 6e-3, 1e-4)),
        R,
        ballistic=Ballistic(-G, 0.1),
        slow_s=0.015,
    )
    inside = truth.t > 0.008
    for found, true, unc in (
        (motion.velocity, truth.v, motion.velocity_unc),
        (motion.acceleration, truth.a, motion.acceleration_unc),
    ):
        pulls = np.abs((found - true) / unc)[inside]
        assert rms(pulls) < 1.2
        assert np.mean(pulls > 3) < 0.01


def test_a_gap_in_the_stretch_stays_a_gap() -> None:
    truth = fall("soft")
    y_b, stretch, unc = entry(0)
    gap = (truth.t > 0.05) & (truth.t < 0.06)
    stretch[gap] = np.nan
    motion = solve_entry_motion(
        truth.t, (y_b, np.full(y_b.size, 2.5e-5)), (stretch, unc), R, ballistic=Ballistic(-G, 0.1)
    )
    for values in (motion.centre_m, motion.velocity, motion.acceleration, motion.velocity_unc):
        assert np.isnan(values[gap]).all()
        assert np.isfinite(values[~gap]).all()
    assert np.isfinite(motion.bottom_velocity).all()


def test_in_air_a_sphere_is_a_sphere_unless_it_rings() -> None:
    t = (np.arange(60) - 30.5) / 2000
    near = 1.0 + 1e-3 * np.random.default_rng(0).normal(size=60)
    value, unc = stretch_in_air(t, near, np.full(60, 1e-3))
    assert np.all(value[t < 0] == 1.0)
    assert np.all(unc[t < 0] == 0.0)
    assert np.all(value[t > 0] == near[t > 0])
    _, doubt = stretch_in_air(t, near - 0.0025, np.full(60, 1e-3))
    assert doubt[t < 0] == pytest.approx(0.0025, abs=5e-4)
    oblate = near + 0.02
    assert np.all(stretch_in_air(t, oblate, np.full(60, 1e-3))[0] == oblate)


def test_speed_of_a_fall() -> None:
    t = np.arange(-20, 5) / 2000 - 1e-4
    y = R - 3.0 * t - 0.5 * G * t**2
    pulls = []
    for seed in range(40):
        seen = y + 2.5e-5 * np.random.default_rng(seed).normal(size=t.size)
        speed, unc = fall_speed(t, seen, np.full(t.size, 2.5e-5), Ballistic(-G, 0.1))
        pulls.append((speed - 3.0) / unc)
    assert 0.7 < rms(np.array(pulls)) < 1.3
    assert np.isnan(fall_speed(t[:2], y[:2], np.full(2, 1e-5), Ballistic(-G, 0.1))[0])


def held(count: int, fall_s: float = 0.05, fps: float = 1000.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, heights and speeds of a sphere that hangs before it falls for ``fall_s``, with impact at time 0."""
    t = (np.arange(count) - 0.75 * count) / fps
    since = np.maximum(t + fall_s, 0.0)
    return t, 0.5 * G * (fall_s**2 - since**2), -G * since


def test_speed_of_a_fall_from_rest_within_the_clip() -> None:
    t, y, _ = held(160)
    pulls = []
    for seed in range(40):
        seen = y + 2.5e-5 * np.random.default_rng(seed).normal(size=t.size)
        speed, unc = fall_speed(t, seen, np.full(t.size, 2.5e-5), Ballistic(-G, 0.1), -0.05)
        pulls.append((speed - G * 0.05) / unc)
    assert 0.6 < rms(np.array(pulls)) < 1.4


@pytest.mark.parametrize("count", [160, 72])
def test_the_frames_before_a_release_are_smoothed_by_themselves(count: int) -> None:
    t, y, speed = held(count)
    y = y + 1e-5 * np.random.default_rng(3).normal(size=t.size)
    unc = np.full(t.size, 1e-5)
    rigid = np.ones(t.size), np.zeros(t.size)
    motion = solve_entry_motion(t, (y, unc), rigid, R, ballistic=Ballistic(-G, 0.1), released_s=-0.05)
    hanging = t < -0.0505
    assert list(motion.held[hanging]) == [True] * hanging.sum()
    assert not motion.outlier[t < 0].any()
    dry = (t < 0) & np.isfinite(motion.velocity)
    assert dry.sum() == (t < 0).sum() - (hanging.sum() if hanging.sum() < 4 else 0)
    off = (motion.velocity - speed)[dry]
    assert np.median(np.abs(off)) < 1e-3
    assert np.max(np.abs(off / motion.velocity_unc[dry])) < 4.0


def test_velocity_just_before_impact() -> None:
    t = np.array([-1e-3, -5e-4, 5e-4])
    speed, _ = impact_velocity(t, -5 - G * t, np.full(3, 1e-3), np.array([-G, -G, 50.0]))
    assert speed == pytest.approx(-5.0)
    assert np.isnan(impact_velocity(t[2:], np.ones(1), np.ones(1), np.ones(1))[0])


def test_the_air_slows_a_light_fast_sphere_more() -> None:
    heavy = fall_before_impact(9.81, 5.0, R, 1070.0)
    light = fall_before_impact(9.81, 5.0, R, 107.0)
    assert heavy.acceleration == -9.81
    assert light.uncertainty == pytest.approx(10 * heavy.uncertainty)
    assert 0.1 < heavy.uncertainty < 0.4
