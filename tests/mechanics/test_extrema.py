"""Which turning points and crossings count, on made-up courses of λ."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.mechanics import extrema

ROUNDING = 1.0


def events_of(course):
    """Every turning point and crossing of 1 along the straight lines between the numbers of ``course``."""
    rows = []
    for k, (a, b) in enumerate(itertools.pairwise(course)):
        if a < 1.0 <= b or a > 1.0 >= b:
            rows.append((k + 0.5, extrema.UPWARD if a < b else extrema.DOWNWARD, 1.0))
        if k + 2 < len(course) and (b - a) * (course[k + 2] - b) < 0.0:
            rows.append((k + 1.0, extrema.PEAK if a < b else extrema.VALLEY, b))
    return rows


def admitted(course, negligible=ROUNDING):
    events, counts = np.zeros((len(course) * 2 + 2, 3)), np.zeros(5, dtype=np.int64)
    for row in events_of(course):
        events[counts[extrema.FOUND]] = row
        extrema.admit(events, counts, course[0], negligible)
    extrema.settle(events, counts, course[-1], negligible)
    return events[: counts[extrema.FOUND]]


def test_a_swing_within_rounding_takes_its_counterpart_with_it():
    found = admitted([6.0, -4.0, 3.0, 2.5, 4.0, -5.0, 5.0])
    assert found[:, 1:].tolist() == [
        [extrema.DOWNWARD, 1.0],
        [extrema.VALLEY, -4.0],
        [extrema.UPWARD, 1.0],
        [extrema.PEAK, 4.0],  # not the 3 before it, which λ left by half a unit only
        [extrema.DOWNWARD, 1.0],
        [extrema.VALLEY, -5.0],
        [extrema.UPWARD, 1.0],
    ]


def test_a_touch_of_the_free_size_is_a_peak_without_crossings():
    found = admitted([9.0, -3.0, 1.5, -6.0, -2.0])
    assert found[:, 1].tolist() == [extrema.DOWNWARD, extrema.VALLEY, extrema.PEAK, extrema.VALLEY]


def test_rounding_at_the_end_of_a_creep_is_no_extremum():
    assert admitted([9.0, 5.0, 2.0, 1.2, 1.3, 1.1, 1.4]).size == 0
    assert admitted([9.0, 0.8, 1.2, 0.9, 1.1]).size == 0


@given(st.lists(st.floats(-5.0, 7.0), min_size=2, max_size=30))
def test_what_counts_alternates_and_stands_out(course):
    found = admitted(course)
    turning = found[:, 1] <= extrema.VALLEY
    turns, crossings = found[turning], found[~turning]
    assert np.all(np.diff(turns[:, 1]) != 0)
    assert np.all(np.diff(crossings[:, 1]) != 0)
    assert np.all(np.diff(found[:, 0]) > 0)
    heights = [course[0], *turns[:, 2], course[-1]]
    assert np.all(np.abs(np.diff(heights))[: len(turns) + (len(turns) > 0)] >= ROUNDING)
    bounds = [0.0, *crossings[:, 0], len(course)]
    for low, high in itertools.pairwise(bounds):
        part = np.array(course)[int(np.ceil(low)) : int(np.ceil(high))]
        assert len(crossings) == 0 or np.abs(part - 1.0).max() >= ROUNDING


@given(st.lists(st.floats(-5.0, 7.0), min_size=2, max_size=30))
def test_nothing_is_lost_where_nothing_is_rounding(course):
    spread = [value for value in course if abs(value - 1.0) > 1e-6]
    spread = [value for k, value in enumerate(spread) if k == 0 or abs(value - spread[k - 1]) > 1e-6]
    if len(spread) > 1:
        assert admitted(spread, 1e-9).tolist() == [list(row) for row in events_of(spread)]
