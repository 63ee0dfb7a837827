"""Order statistics against those of NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wentry_cli.imaging.order_statistics import linear_quantile, median_of, rank_and_next

VALUES = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40)


@given(values=VALUES, share=st.sampled_from([0.0, 0.3, 0.5, 0.95, 1.0]))
@settings(max_examples=200, deadline=None)
def test_quantile_of_few_values(values: list[float], share: float) -> None:
    expected = np.quantile(values, share)
    assert linear_quantile(np.array(values), len(values), share) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 7, 24, 25, 40])
def test_the_median_of_few_and_of_more_values_leaves_them_as_they_are(count: int) -> None:
    values = np.random.default_rng(count).normal(size=50)
    before = values.copy()
    assert median_of(values, count) == np.median(values[:count])
    assert values.tolist() == before.tolist()


def test_quantile_of_many_values_with_an_outlier() -> None:
    values = np.random.default_rng(3).normal(1.0, 0.01, 20_000)
    values[7] = 40.0
    assert linear_quantile(values, values.size, 0.3) == pytest.approx(np.quantile(values, 0.3), rel=1e-12)


@pytest.mark.parametrize("kind", ["levels", "sorted", "alike", "outliers", "periodic"])
@pytest.mark.parametrize("count", [512, 513, 700, 20_000])
def test_ranks_of_many_values(kind: str, count: int) -> None:
    rng = np.random.default_rng(count)
    values = {
        "levels": rng.integers(0, 5, count).astype(float),
        "sorted": np.sort(rng.normal(size=count)),
        "alike": np.ones(count),
        "outliers": rng.exponential(size=count) ** 5,
        "periodic": np.where(np.arange(count) % (count // 256) == 0, rng.normal(size=count), 1.0),
    }[kind].astype(np.float32)
    ordered = np.sort(values)
    for rank in (0, 1, count // 3, int(0.75 * (count - 1)), count - 2, count - 1):
        expected = ordered[rank], ordered[min(rank + 1, count - 1)]
        assert rank_and_next(values, count, rank) == expected


def test_no_value_has_no_quantile() -> None:
    assert np.isnan(linear_quantile(np.empty(0), 0, 0.5))
