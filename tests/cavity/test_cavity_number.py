"""The number of the cavity that closes."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.cavity_number import CavityNumber, Periods, find_cavity_number, find_passage, stretch_peak_of

TIMES = np.linspace(0.002, 0.1, 50)
HEIGHTS = -1.5 * TIMES
INTERVAL = 0.01
NAN = np.nan


def swing(
    known: int, *, interval: float = INTERVAL, unc: float = 1e-4, height: float = 0.03, damping: float = 0.4
) -> Periods:
    """Periods of a damped swing of which ``known`` ends and one more peak were found."""
    k = np.arange(known + 1)
    ends = np.where(k < known, 1.2 * interval + interval * k, NAN)
    peaks = 1.0 + height * damping**k
    valleys = 1.0 - np.sqrt(damping) * (peaks - 1.0)
    return Periods(ends, np.where(k < known, unc, NAN), np.where(k < known, interval, NAN), peaks, valleys)


@pytest.mark.parametrize("time", [0.003, 0.02, 0.0513])
def test_the_time_at_which_the_contact_line_passed_a_depth(time: float) -> None:
    passage, unc = find_passage(-1.5 * time, TIMES, HEIGHTS)
    assert passage == pytest.approx(time, abs=1e-9)
    assert unc == pytest.approx(0.001)


def test_a_depth_that_was_never_passed_has_no_time() -> None:
    for depth, heights in ((-0.2, HEIGHTS), (NAN, HEIGHTS), (-0.05, np.full(50, NAN))):
        assert np.isnan(find_passage(depth, TIMES, heights)).all()


def test_a_lost_contact_line_is_bridged_and_less_certain() -> None:
    heights = HEIGHTS.copy()
    heights[10:40] = NAN
    passage, unc = find_passage(-0.046, TIMES, heights)
    assert passage == pytest.approx(0.046 / 1.5, abs=1e-9)
    assert unc == pytest.approx(0.031, abs=0.001)


def test_single_wrong_heights_do_not_move_the_passage() -> None:
    heights = HEIGHTS.copy()
    heights[[15, 35]] += (-0.06, 0.05)
    assert find_passage(-0.046, TIMES, heights)[0] == pytest.approx(0.046 / 1.5, abs=5e-4)


def test_the_last_passage_counts_where_the_line_recedes() -> None:
    heights = HEIGHTS + 0.02 * np.exp(-(((TIMES - 0.05) / 0.006) ** 2))
    crossing = float(np.interp(0.05, TIMES, heights))
    assert find_passage(crossing - 6e-3, TIMES, heights)[0] > 0.05


@pytest.mark.parametrize(("passage", "number"), [(0.001, 1), (0.011, 1), (0.013, 2), (0.021, 2), (0.03, 3)])
def test_the_period_of_the_passage_counts(passage: float, number: int) -> None:
    found = find_cavity_number(passage, 1e-4, swing(3))
    assert found == CavityNumber(number, "measured")


def test_an_end_too_near_leaves_the_number_open() -> None:
    for passage in (0.0119, 0.0121, 0.0219, 0.032):
        assert find_cavity_number(passage, 1e-4, swing(3)).number is None
    assert find_cavity_number(0.0125, 1e-4, swing(3)).number == 2
    assert find_cavity_number(0.0125, 1e-3, swing(3)).number is None
    assert find_cavity_number(0.0125, 1e-4, swing(3, unc=1e-3)).number is None


@pytest.mark.parametrize(("passage", "number"), [(0.037, 4), (0.047, 5), (0.057, 6)])
def test_a_small_steady_swing_is_counted_on(passage: float, number: int) -> None:
    assert find_cavity_number(passage, 1e-4, swing(3)) == CavityNumber(number, "counted")


def test_what_drifts_or_swings_far_is_not_counted_on() -> None:
    assert find_cavity_number(0.037, 1e-4, swing(3, height=2.0)).number is None
    assert find_cavity_number(0.102, 1e-4, swing(3)).number is None  # seven periods on, it may be another
    periods = swing(3)
    uneven = Periods(periods.end_s, periods.end_unc_s, INTERVAL * np.array([1.3, 0.9, 0.8, NAN]), *_heights(periods))
    assert find_cavity_number(0.057, 1e-4, uneven).number is None


def _heights(periods: Periods) -> tuple[np.ndarray, np.ndarray]:
    return periods.peak, periods.valley


def test_a_missed_period_leaves_the_number_open() -> None:
    periods = swing(4)
    missed = Periods(*(np.delete(values, 1) for values in (periods.end_s, periods.end_unc_s, *_rest(periods))))
    assert find_cavity_number(0.037, 1e-4, missed).number is None
    assert find_cavity_number(0.037, 1e-4, periods).number == 4


def _rest(periods: Periods) -> tuple[np.ndarray, ...]:
    return periods.peak_to_peak_s, periods.peak, periods.valley


def test_without_periods_or_passage_there_is_no_number() -> None:
    assert find_cavity_number(NAN, NAN, swing(3)).number is None
    assert find_cavity_number(0.02, 1e-4, swing(0)).number is None
    assert find_cavity_number(0.02, 1e-4, Periods(*[np.empty(0)] * 5)).number is None


def test_one_end_alone_tells_the_first_period() -> None:
    one = Periods(*(np.array([v]) for v in (0.012, 1e-4, NAN, 1.03, 0.98)))
    assert find_cavity_number(0.005, 1e-4, one) == CavityNumber(1, "measured")
    assert find_cavity_number(0.017, 1e-4, one).number is None


def test_the_peak_beyond_the_measured_ones_follows_their_decay() -> None:
    periods = swing(2)  # peaks 1.03, 1.012, 1.0048
    assert stretch_peak_of(2, periods, np.full(3, 1e-4)) == (1.012, 1e-4)
    peak, unc = stretch_peak_of(5, periods, np.full(3, 1e-4))
    assert peak == pytest.approx(1.0 + 0.03 * 0.4**4)
    assert unc == pytest.approx(np.hypot(0.03 * 0.4**4, 1e-4))
    one = Periods(*(np.array([v]) for v in (0.012, 1e-4, NAN, 1.03, 0.98)))
    assert np.isnan(stretch_peak_of(2, one, np.array([1e-4]))).all()
