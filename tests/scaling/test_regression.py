from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wentry_cli.scaling.regression import fit_line, fit_power_law


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_a_line_through_the_origin_and_one_with_an_intercept() -> None:
    x = np.linspace(1.0, 9.0, 12)
    own = np.arange(12)
    through = fit_line(x, 1.3 * x, own, rng())
    assert through.slope == pytest.approx(1.3)
    assert through.slope_unc < 1e-12
    assert np.isnan(through.intercept)
    assert through.r_squared == pytest.approx(1.0)
    off = fit_line(x, 1.3 * x + 0.5, own, rng(), intercept=True)
    assert (off.slope, off.intercept) == (pytest.approx(1.3), pytest.approx(0.5))
    assert off.n == 12
    assert np.isnan(through.intercept_unc)
    assert off.intercept_unc < 1e-12


def test_the_uncertainty_of_an_intercept_is_its_scatter() -> None:
    x, noise = np.linspace(1.0, 9.0, 24), np.random.default_rng(3)
    found = [fit_line(x, x + 0.5 + noise.normal(0, 0.1, 24), np.arange(24), rng(), intercept=True) for _ in range(60)]
    scatter = np.std([f.intercept for f in found])
    assert np.median([f.intercept_unc for f in found]) == pytest.approx(scatter, rel=0.3)


def test_a_power_law() -> None:
    x = np.geomspace(0.2, 20, 10)
    found = fit_power_law(x, 0.4 * x**-0.5, np.arange(10), rng())
    assert found.slope == pytest.approx(0.4)
    assert found.exponent == pytest.approx(-0.5)


def test_a_power_law_leaves_out_what_has_no_logarithm() -> None:
    x = np.array([0.5, 1, 2, 4, 8, -1, 3, np.nan])
    y = np.array([0.5, 1, 2, 4, 8, 1, -2, 1.0])
    found = fit_power_law(x, y, np.arange(8), rng())
    assert found.n == 5
    assert found.exponent == pytest.approx(1.0)


@pytest.mark.parametrize("n", [0, 3, 4])
def test_too_few(n: int) -> None:
    x = np.arange(1.0, n + 1)
    for found in (fit_line(x, x, np.arange(n), rng()), fit_power_law(x, x, np.arange(n), rng())):
        assert found.status == "too_few"
        assert found.n == n
        assert np.isnan(found.slope)
        assert np.isnan(found.slope_low)


def test_points_of_one_abscissa_say_nothing_about_a_slope() -> None:
    x = np.ones(6)
    assert fit_line(x, np.arange(6.0), np.arange(6), rng(), intercept=True).status == "too_few"


def test_the_interval_holds_the_slope() -> None:
    """Drops of one sphere err together: the bootstrap over drops alone would hold far less."""
    held = 0
    for seed in range(150):
        random = rng(seed)
        spheres = np.repeat(np.arange(8), 4)
        x = random.uniform(3, 9, 32)
        y = x * (1.3 + 0.1 * random.normal(size=8)[spheres]) + 0.05 * random.normal(size=32)
        found = fit_line(x, y, spheres, random)
        held += found.slope_low < 1.3 < found.slope_high
    assert 0.83 < held / 150 < 0.99


def test_one_sphere_only_falls_back_to_the_drops() -> None:
    x = np.linspace(1, 2, 8)
    found = fit_line(x, 2 * x + 0.1 * rng(1).normal(size=8), np.zeros(8, dtype=int), rng(), intercept=True)
    assert found.slope_low < found.slope < found.slope_high


@settings(max_examples=20)
@given(st.floats(0.1, 10), st.floats(0.1, 10), st.permutations(range(9)))
def test_units_and_order_do_not_matter(a: float, b: float, order: list[int]) -> None:
    x = np.linspace(1, 5, 9)
    y = 1.3 * x + np.sin(7 * x)
    here = fit_line(x, y, np.arange(9), rng(), intercept=True)
    there = fit_line(a * x[order], b * y[order], np.arange(9), rng(), intercept=True)
    assert there.slope == pytest.approx(here.slope * b / a)
    assert there.r_squared == pytest.approx(here.r_squared)


def test_the_same_seed_gives_the_same_interval() -> None:
    x = np.linspace(1, 5, 9)
    one, two = (fit_line(x, np.sqrt(x), np.arange(9), rng(7)) for _ in range(2))
    assert (one.slope_low, one.slope_high) == (two.slope_low, two.slope_high)


def test_points_that_hardly_differ_in_x_tell_no_slope() -> None:
    x = 2.0 + 1e-9 * np.arange(9)
    y = 0.3 + 0.01 * np.random.default_rng(4).normal(size=9)
    for found in (
        fit_power_law(x, y, np.arange(9), rng()),
        fit_line(x, y, np.arange(9), rng(), intercept=True),
    ):
        assert found.status == "too_few"
        assert np.isnan(found.slope)
