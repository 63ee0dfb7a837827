from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.kinematics.interpolation import hermite, lagrange_cubic, nearest
from wentry_cli.kinematics.merging import find_offset, merge_stretch

T = np.arange(200) / 2000.0


def ring(t: np.ndarray) -> np.ndarray:
    return 1 + 0.3 * np.exp(-12 * t) * np.sin(2 * np.pi * t / 0.03)


def flat(value: float) -> tuple[np.ndarray, np.ndarray]:
    return np.full(T.size, value), np.full(T.size, 0.01)


def test_both_views_are_weighted() -> None:
    top = np.full(T.size, 1.2), np.full(T.size, 0.02)
    merged = merge_stretch(T, flat(1.19), T, top)
    assert set(merged.source) == {"both"}
    assert merged.stretch[0] == pytest.approx((1.19 * 4 + 1.2) / 5)
    assert merged.stretch_unc[0] == pytest.approx(0.01 * np.sqrt(4 / 5))


def test_quarrelling_views_widen_the_error_bar() -> None:
    merged = merge_stretch(T, flat(1.0), T, flat(1.2))
    assert merged.stretch[0] == pytest.approx(1.1)
    assert merged.stretch_unc[0] == pytest.approx(0.1)


def test_the_top_view_ends_at_dome_over_and_gaps_stay() -> None:
    side = flat(1.1)
    side[0][:60] = np.nan
    side[0][150:] = np.nan
    merged = merge_stretch(T, side, T, flat(1.1), dome_over_s=0.05)
    assert set(merged.source[:60]) == {"top"}
    assert set(merged.source[60:100]) == {"both"}
    assert set(merged.source[100:150]) == {"side"}
    assert set(merged.source[150:]) == {""}
    assert np.isnan(merged.stretch[150:]).all()
    assert np.isnan(merged.top[100:]).all()


def test_another_frame_rate_is_interpolated() -> None:
    top_times = np.arange(100) / 1000.0 + 2e-4
    nothing = np.full(T.size, np.nan)
    merged = merge_stretch(T, (nothing, nothing), top_times, (ring(top_times), np.full(100, 1e-3)))
    seen = np.isfinite(merged.stretch)
    assert seen.sum() > 180
    assert np.abs(merged.stretch - ring(T))[seen].max() < 1e-4


@pytest.mark.parametrize("late", [2e-4, -3e-4, 6e-4])
def test_the_offset_of_the_clocks_is_found(late: float) -> None:
    random = np.random.default_rng(0)
    side = ring(T) + 1e-3 * random.normal(size=T.size), np.full(T.size, 1e-3)
    # the top clock reads T where the true time is T + late, and its scale is half a percent off
    top = ring(T + late) * 1.005 + 1e-3 * random.normal(size=T.size), np.full(T.size, 1e-3)
    found = find_offset(T, side, T, top, interval_s=5e-4)
    assert found.determined
    assert found.seconds == pytest.approx(late, abs=5 * found.uncertainty_s + 1e-5)


def test_no_offset_where_there_is_none_or_nothing_moves() -> None:
    random = np.random.default_rng(1)
    pair = [(ring(T) + 1e-3 * random.normal(size=T.size), np.full(T.size, 1e-3)) for _ in range(2)]
    assert not find_offset(T, pair[0], T, pair[1], interval_s=5e-4).determined
    assert not find_offset(T, flat(1.0), T, flat(1.0), interval_s=5e-4).determined
    few = np.full(T.size, np.nan)
    few[:6] = 1.0
    assert not find_offset(T, (few, few), T, pair[0], interval_s=5e-4).determined


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 8.9))
def test_hermite_is_exact_for_a_cubic(a: float, b: float, when: float) -> None:
    t = np.arange(10.0)
    y, slope = a * t**3 + b * t, 3 * a * t**2 + b
    assert hermite(t, y, slope, when, longest_gap=1.5) == pytest.approx(a * when**3 + b * when, abs=1e-9)


def test_hermite_knows_its_limits() -> None:
    t = np.array([0.0, 1.0, np.nan, 5.0])
    assert np.isnan(hermite(t, t, t, 3.0, longest_gap=2.0))
    assert np.isnan(hermite(t, t, t, -0.1, longest_gap=2.0))
    assert np.isnan(hermite(t[:1], t[:1], t[:1], 0.0, longest_gap=2.0))
    assert nearest(t, 2 * t, 4.0) == 10.0
    assert np.isnan(nearest(t[2:3], t[2:3], 4.0))


def test_cubic_interpolation_carries_its_variance() -> None:
    t = np.arange(12.0)
    value, variance = lagrange_cubic(t, t**3, np.ones(12), np.array([4.5, 7.0, 0.2]))
    assert value[0] == pytest.approx(4.5**3)
    assert variance[0] == pytest.approx(2 * (9 / 16) ** 2 + 2 / 16**2)
    assert value[1] == 343.0
    assert np.isnan(value[2])
    assert np.isnan(lagrange_cubic(t[:3], t[:3], t[:3], np.array([1.0]))[0]).all()


def test_a_slow_error_of_the_side_view_makes_no_step_where_the_top_view_ends() -> None:
    random = np.random.default_rng(2)
    error = -0.012
    side = ring(T) + error + 1e-4 * random.normal(size=T.size), np.full(T.size, 0.01)
    top = ring(T) + 5e-4 * random.normal(size=T.size), np.full(T.size, 1e-3)
    plain = merge_stretch(T, side, T, top, dome_over_s=0.025)
    merged = merge_stretch(T, side, T, top, dome_over_s=0.025, slow_s=0.015)
    last = int(np.flatnonzero(merged.source == "both")[-1])
    assert abs(np.diff(plain.stretch - ring(T))[last]) > 0.01
    assert abs(np.diff(merged.stretch - ring(T))[last]) < 0.0015
    off = np.abs(merged.stretch - ring(T))
    assert np.all(off < 2 * merged.stretch_unc + 1e-3)
    assert merged.stretch_unc[last + 1] < 0.002
    assert np.all(np.diff(merged.stretch_unc[last + 1 :]) >= 0.0)
    assert merged.stretch_unc[-1] == pytest.approx(0.01, rel=1e-3)
    assert np.array_equal(merged.side, side[0])


def test_noise_of_the_side_view_carries_nothing() -> None:
    random = np.random.default_rng(3)
    side = ring(T) + 2e-3 * random.normal(size=T.size), np.full(T.size, 2e-3)
    top = ring(T) + 1e-3 * random.normal(size=T.size), np.full(T.size, 1e-3)
    plain = merge_stretch(T, side, T, top, dome_over_s=0.025)
    merged = merge_stretch(T, side, T, top, dome_over_s=0.025, slow_s=0.015)
    assert np.array_equal(plain.stretch, merged.stretch)
    assert np.array_equal(plain.stretch_unc, merged.stretch_unc)


def test_what_the_overlap_tells_of_the_top_view_holds_where_it_is_alone() -> None:
    """Its depth is wrong by the row of the surface: one factor in all of its frames."""
    random = np.random.default_rng(2)
    top = ring(T) * 1.005 + 5e-5 * random.normal(size=T.size), 5e-3 * ring(T)
    side = ring(T) + 5e-5 * random.normal(size=T.size), np.full(T.size, 5e-4)
    side[0][:60] = np.nan
    side[1][:60] = np.nan
    merged = merge_stretch(T, side, T, top, slow_s=0.015)
    alone = merged.source == "top"
    assert alone.sum() == 60
    off = merged.stretch - ring(T)
    assert np.abs(off[alone]).max() < 1e-3
    assert np.abs(np.diff(off)).max() < 5e-4
    assert np.abs(off[alone] / merged.stretch_unc[alone]).max() < 2.0
    assert merged.stretch_unc[alone].max() < 1.5e-3


def test_no_interpolation_leads_across_the_impact() -> None:
    """λ is 1 up to the impact and leaves it with a kink; the cameras are half a frame out of phase."""
    times, top_times = (np.arange(60) - 30.25) / 2000.0, (np.arange(60) - 30.75) / 2000.0
    own = np.maximum(top_times, 0.0)
    nothing = np.full(60, np.nan)
    merged = merge_stretch(times, (nothing, nothing), top_times, (1.0 + 60.0 * own, np.full(60, 1e-4)))
    seen = np.isfinite(merged.stretch)
    assert seen.sum() > 50
    assert np.abs(merged.stretch - 1.0 - 60.0 * np.maximum(times, 0.0))[seen].max() < 1e-9


@pytest.mark.parametrize("drift", [0.0, 0.05])
def test_what_the_views_drift_apart_stays_in_the_uncertainty_of_the_one_that_is_carried(drift: float) -> None:
    """The top view's error changes with the depth, where its distance is wrong; the side view begins late."""
    random = np.random.default_rng(2)
    side = np.where(T > 0.02, ring(T) + 1e-5 * random.normal(size=T.size), np.nan), np.full(T.size, 5e-5)
    top = ring(T) + 0.002 + drift * T / T[-1] + 1e-4 * random.normal(size=T.size), np.full(T.size, 0.03)
    merged = merge_stretch(T, side, T, top, slow_s=0.015)
    alone = merged.source == "top"
    error = np.abs(merged.stretch - ring(T))[alone]
    assert alone.sum() > 30
    assert np.mean(error < 2.0 * merged.stretch_unc[alone]) > 0.9
    assert merged.stretch_unc[alone].max() < 3e-4 + drift
