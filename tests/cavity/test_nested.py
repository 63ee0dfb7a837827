"""Starts of nested cavities from a damped oscillation."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.nested import CavityStart, find_cavity_starts, wall_numbers

T = (np.arange(240) - 16) * 5e-4
PERIOD = 0.026


def swing(shallow: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    wave = 0.35 * np.exp(-T / 0.03) * np.sin(2.0 * np.pi * T / PERIOD)
    stretch = 1.0 + np.where(wave < 0.0, wave * (1.0 - shallow), wave)
    return np.where(T > 0.0, stretch, 1.0), np.where(T > 0.0, -3.0 * T, np.nan)


def test_a_cavity_starts_at_each_upward_crossing() -> None:
    stretch, height = swing()
    stretch = stretch + np.random.default_rng(1).normal(0.0, 5e-4, T.size)
    starts = find_cavity_starts(T, stretch, np.full(T.size, 5e-4), height)
    assert len(starts) >= 2
    for number, start in enumerate(starts[:2], 1):
        assert start.status == "ok"
        assert start.t_s == pytest.approx(number * PERIOD, abs=1e-4)
        assert start.y_m == pytest.approx(-3.0 * number * PERIOD, abs=4e-4)


def test_valleys_above_one_say_that_nothing_crosses() -> None:
    stretch, height = swing()
    starts = find_cavity_starts(T, np.maximum(stretch, 1.0) + 0.05 * (T > 0), np.full(T.size, 5e-4), height)
    assert starts
    assert all(start.status == "no_unit_crossing" for start in starts)


def test_a_contact_line_that_was_not_seen_leaves_no_height() -> None:
    stretch, height = swing()
    height[(T > 0.02) & (T < 0.04)] = np.nan
    first = find_cavity_starts(T, stretch, np.full(T.size, 5e-4), height)[0]
    assert first.status == "no_edge"
    assert np.isnan(first.y_m)
    assert first.t_s == pytest.approx(PERIOD, abs=1e-4)


def test_a_rigid_sphere_has_none() -> None:
    assert find_cavity_starts(T, np.full(T.size, np.nan), np.full(T.size, np.nan), -T) == []
    noisy = 1.0 + np.random.default_rng(1).normal(0.0, 1e-3, T.size)
    assert find_cavity_starts(T, noisy, np.full(T.size, 1e-3), -T) == []


def test_walls_are_numbered_from_the_surface_down_once_they_exist() -> None:
    starts = [CavityStart(0.026, 1e-5, -0.06, "ok"), CavityStart(0.052, 1e-5, -0.11, "ok")]
    heights = np.array([-0.01, -0.07, -0.12])
    np.testing.assert_array_equal(wall_numbers(heights, 0.02, starts), [1, 1, 1])
    np.testing.assert_array_equal(wall_numbers(heights, 0.04, starts), [1, 2, 2])
    np.testing.assert_array_equal(wall_numbers(heights, 0.06, starts), [1, 2, 3])
