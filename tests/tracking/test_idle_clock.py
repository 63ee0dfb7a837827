"""Long intervals of the clock in which the sphere moves as in a usual one, and those in which it does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wentry_cli.tracking.idle_clock import IdleClock, idle_times, stays_in_sight

FALL = 0.01  # px per frame squared


def rows_at(true_frames: np.ndarray) -> list[float]:
    return (40.0 + 5.0 * true_frames + 0.5 * FALL * true_frames**2).tolist()


@pytest.mark.parametrize("told", [2.0, 3.4, 400.0])
def test_a_stamp_that_jumps_while_the_sphere_does_not_is_found(told: float) -> None:
    true = np.arange(12.0)
    clock = np.where(true > 4, true + told - 1.0, true)
    rows = rows_at(true)
    found = idle_times(range(12), 1e-3 * clock, rows.__getitem__)
    assert found == [IdleClock(4, 5, pytest.approx(told))]


def test_a_gap_of_numbers_that_misses_no_frame_is_found_by_the_four_frames_around_it() -> None:
    frames = [*range(5), *range(15, 25)]  # 5 to 14 do not exist
    asked: dict[int, float] = {}

    def row_of(frame: int) -> float:
        asked[frame] = rows_at(np.array([frame if frame < 5 else frame - 10]))[0]
        return asked[frame]

    assert idle_times(frames, 1e-3 * np.arange(25), row_of) == [IdleClock(4, 15, pytest.approx(11.0))]
    assert sorted(asked) == [3, 4, 15, 16]


def test_frames_that_are_missing_are_no_idle_clock() -> None:
    rows = rows_at(np.arange(25.0))
    for lost in (1, 2, 10):
        frames = [frame for frame in range(25) if not 5 <= frame < 5 + lost]
        assert idle_times(frames, 1e-3 * np.arange(25), rows.__getitem__) == []


def test_what_tells_nothing_is_not_told() -> None:
    true = np.arange(12.0)
    clock = 1e-3 * np.where(true > 4, true + 9.0, true)
    assert idle_times(range(12), clock, lambda _: 60.0) == []  # it does not move
    assert idle_times(range(12), clock, lambda _: math.nan) == []  # it is not seen
    assert idle_times(range(12), clock, lambda n: [0, 1, 2, 3, 4, 30, 31, 99, 100, 101, 102, 103][n] * 5.0) == []
    at_the_rim = 1e-3 * np.where(true > 0, true + 9.0, true)
    assert idle_times(range(12), at_the_rim, rows_at(true).__getitem__) == []


def test_a_sphere_in_air_stays_in_sight_and_one_that_has_met_the_water_did_not() -> None:
    nan = math.nan
    falls = [nan, nan, *[25.0 + 0.1 * n for n in range(10)]]  # it comes into the picture
    assert stays_in_sight(range(12), falls.__getitem__)
    sealed = [25.0] * 8 + [nan] * 12 + [25.0] * 6
    assert not stays_in_sight(range(26), sealed.__getitem__)
    splash = [25.0] * 8 + [60.0] * 12 + [25.0] * 6
    assert not stays_in_sight(range(26), splash.__getitem__)
    assert not stays_in_sight(range(8), [*[25.0] * 7, nan].__getitem__)
