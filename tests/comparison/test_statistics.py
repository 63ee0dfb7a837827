"""Error statistics count what is not measured and see a wrong uncertainty."""

from __future__ import annotations

import numpy as np

from wentry_cli.comparison.statistics import error_statistics


def test_bias_rmse_and_pull() -> None:
    truth = np.zeros(4)
    measured = np.array([1.0, -1.0, 3.0, np.nan])
    found = error_statistics(measured, truth, np.full(4, 0.5))
    assert (found.measurable, found.measured) == (4, 3)
    np.testing.assert_allclose([found.bias, found.rmse, found.largest], [1.0, np.sqrt(11 / 3), 3.0])
    np.testing.assert_allclose([found.pull, found.beyond_3], [2 * np.sqrt(11 / 3), 1 / 3])


def test_what_is_not_vouched_for_is_not_measured() -> None:
    found = error_statistics(np.array([0.0, 9.0]), np.zeros(2), ok=np.array([True, False]))
    assert (found.measurable, found.measured, found.largest) == (2, 1, 0.0)


def test_unmeasurable_entries_do_not_count() -> None:
    found = error_statistics(np.array([1.0, 2.0]), np.array([np.nan, 2.0]))
    assert (found.measurable, found.measured, found.rmse) == (1, 1, 0.0)


def test_nothing_measured_is_not_zero_error() -> None:
    found = error_statistics(np.array([np.nan]), np.array([1.0]))
    assert found.measured == 0
    assert np.isnan(found.rmse)
