"""The number of the cavity that closes."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.cavity_number import pinch_off_cavity

TIMES = np.linspace(0.002, 0.1, 50)
HEIGHTS = -1.5 * TIMES
STARTS = [0.0, 0.03, 0.06]


@pytest.mark.parametrize(("depth", "number"), [(-0.001, 1), (-0.03, 1), (-0.044, 1), (-0.046, 2), (-0.1, 3)])
def test_the_period_of_the_passage_counts(depth: float, number: int) -> None:
    assert pinch_off_cavity(depth, TIMES, HEIGHTS, STARTS) == number


def test_a_depth_that_was_never_passed_has_no_number() -> None:
    assert pinch_off_cavity(-0.2, TIMES, HEIGHTS, STARTS) is None
    assert pinch_off_cavity(np.nan, TIMES, HEIGHTS, STARTS) is None
    assert pinch_off_cavity(-0.05, TIMES, HEIGHTS, []) is None
    assert pinch_off_cavity(-0.05, TIMES, np.full(50, np.nan), STARTS) is None


def test_a_lost_contact_line_is_bridged() -> None:
    heights = HEIGHTS.copy()
    heights[10:40] = np.nan
    assert pinch_off_cavity(-0.046, TIMES, heights, STARTS) == 2


def test_the_last_passage_counts_where_the_line_recedes() -> None:
    heights = HEIGHTS + 0.02 * np.exp(-(((TIMES - 0.05) / 0.006) ** 2))
    crossing = float(np.interp(0.05, TIMES, heights))
    assert pinch_off_cavity(crossing - 1e-4, TIMES, heights, [0.0, 0.045]) == 2
