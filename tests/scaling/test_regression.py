from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import stdtrit

from wentry_cli.scaling.regression import Points, fit_line, fit_power_law

Array = NDArray[np.float64]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def apart(x: Array, y: Array, spheres: NDArray[np.int64] | None = None) -> Points:
    """Drops of a condition each, of a sphere each where ``spheres`` are not given."""
    own = np.arange(x.size)
    return Points(x, y, own if spheres is None else spheres, own)


def test_a_line_through_the_origin_and_one_with_an_intercept() -> None:
    x = np.linspace(1.0, 9.0, 12)
    through = fit_line(apart(x, 1.3 * x))
    assert through.slope == pytest.approx(1.3)
    assert through.slope_unc < 1e-12
    assert np.isnan(through.intercept)
    assert through.r_squared == pytest.approx(1.0)
    off = fit_line(apart(x, 1.3 * x + 0.5), intercept=True)
    assert (off.slope, off.intercept) == (pytest.approx(1.3), pytest.approx(0.5))
    assert off.n == 12
    assert np.isnan(through.intercept_unc)
    assert off.intercept_unc < 1e-12


def test_the_uncertainty_of_an_intercept_is_its_scatter() -> None:
    x, noise = np.linspace(1.0, 9.0, 24), np.random.default_rng(3)
    found = [fit_line(apart(x, x + 0.5 + noise.normal(0, 0.1, 24)), intercept=True) for _ in range(60)]
    scatter = np.std([f.intercept for f in found])
    assert np.median([f.intercept_unc for f in found]) == pytest.approx(scatter, rel=0.3)


def test_a_power_law() -> None:
    x = np.geomspace(0.2, 20, 10)
    found = fit_power_law(apart(x, 0.4 * x**-0.5))
    assert found.slope == pytest.approx(0.4)
    assert found.exponent == pytest.approx(-0.5)


def test_a_power_law_leaves_out_what_has_no_logarithm() -> None:
    x = np.array([0.5, 1, 2, 4, 8, -1, 3, np.nan])
    y = np.array([0.5, 1, 2, 4, 8, 1, -2, 1.0])
    found = fit_power_law(apart(x, y))
    assert found.n == 5
    assert found.exponent == pytest.approx(1.0)


@pytest.mark.parametrize("n", [0, 3, 4])
def test_too_few(n: int) -> None:
    x = np.arange(1.0, n + 1)
    for found in (fit_line(apart(x, x)), fit_power_law(apart(x, x))):
        assert found.status == "too_few"
        assert found.n == n
        assert np.isnan(found.slope)
        assert np.isnan(found.slope_low)


def test_points_of_one_abscissa_say_nothing_about_a_slope() -> None:
    x = np.ones(6)
    assert fit_line(apart(x, np.arange(6.0)), intercept=True).status == "too_few"


@pytest.mark.parametrize("groups", [5, 8, 20])
@pytest.mark.parametrize("intercept", [False, True])
@pytest.mark.parametrize("share", ["none", "condition", "sphere"])
def test_the_interval_holds_the_slope_and_the_uncertainty_goes_with_it(
    groups: int, intercept: bool, share: str
) -> None:
    """Uneven errors; drops that repeat a condition, or are of one sphere, err together."""
    held, spread, stated = 0, [], []
    for seed in range(400):
        random = rng(seed)
        each = np.ones(groups, dtype=int) if share == "none" else random.integers(2, 5, groups)
        labels = np.repeat(np.arange(groups), each)
        x = random.uniform(3, 9, groups)[labels] if share == "condition" else random.uniform(3, 9, labels.size)
        error = (random.uniform(0.3, 3.0, groups) * random.normal(size=groups))[labels]
        y = 1.3 * x + error * (x / 6.0 if share == "sphere" else 1.0) + 0.1 * random.normal(size=labels.size)
        spheres = np.zeros_like(labels) if share == "condition" else labels
        conditions = labels if share == "condition" else np.arange(labels.size)
        found = fit_line(Points(x, y, spheres, conditions), intercept=intercept)
        held += found.slope_low < 1.3 < found.slope_high
        reach = stdtrit(found.dof, 0.975) * found.slope_unc
        assert found.slope_high - found.slope == pytest.approx(reach)
        assert found.slope - found.slope_low == pytest.approx(reach)
        spread.append(found.slope - 1.3)
        stated.append(found.slope_unc)
    assert 0.92 < held / 400 < 0.99
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(np.std(spread), rel=0.15)


def test_the_exponent_s_interval_holds_it() -> None:
    held = 0
    for seed in range(400):
        random = rng(seed)
        x = np.geomspace(0.2, 5.0, 6)
        y = 0.4 * x**-0.5 * np.exp(random.uniform(0.02, 0.2, 6) * random.normal(size=6))
        found = fit_power_law(apart(x, y))
        held += found.exponent_low < -0.5 < found.exponent_high
    assert 0.92 < held / 400 <= 0.99


def test_repeats_are_counted_once() -> None:
    x, y = np.array([3.0, 5.0, 8.0]), np.array([4.0, 6.4, 10.5])
    labels = np.repeat(np.arange(3), 10)
    found = fit_line(Points(x[labels], y[labels], labels, labels))
    assert (found.n, found.n_conditions, found.n_spheres) == (30, 3, 3)
    assert found.dof < 2.0 + 1e-9


def test_no_more_groups_than_parameters_tell_no_uncertainty() -> None:
    """Two spheres whose drops repeat the sphere's own x: a line with an intercept joins them whatever they err."""
    spheres = np.repeat([0, 1], 4)
    x = np.array([1.0, 2.0])[spheres]
    found = fit_line(apart(x, 1.3 * x + 0.1 * rng(1).normal(size=8), spheres), intercept=True)
    assert found.status == "too_few"
    assert np.isfinite(found.slope)
    assert np.isnan([found.slope_unc, found.slope_low, found.slope_high, found.intercept_unc, found.dof]).all()


def test_one_group_that_carries_the_slope_alone_does_not_make_it_certain() -> None:
    x = np.array([1.0, 1.0, 1.0, 1.0, 2.0])
    y = np.array([0.9, 1.1, 1.05, 0.95, 2.0])
    found = fit_line(apart(x, y), intercept=True)
    assert found.slope_unc == pytest.approx(np.std(y[:4], ddof=1) * np.sqrt(1 + 1 / 4))
    assert found.dof == pytest.approx(3.0)


def test_one_sphere_only_falls_back_to_the_conditions() -> None:
    x = np.linspace(1, 2, 8)
    found = fit_line(apart(x, 2 * x + 0.1 * rng(1).normal(size=8), np.zeros(8, dtype=int)), intercept=True)
    assert found.slope_low < found.slope < found.slope_high


@settings(max_examples=20)
@given(st.floats(0.1, 10), st.floats(0.1, 10), st.permutations(range(9)))
def test_units_and_order_do_not_matter(a: float, b: float, order: list[int]) -> None:
    x = np.linspace(1, 5, 9)
    y = 1.3 * x + np.sin(7 * x)
    here = fit_line(apart(x, y), intercept=True)
    there = fit_line(apart(a * x[order], b * y[order]), intercept=True)
    assert there.slope == pytest.approx(here.slope * b / a)
    assert there.r_squared == pytest.approx(here.r_squared)


@pytest.mark.parametrize("spread", [0.0, 1e-9, 0.005])
@pytest.mark.parametrize("spheres", [1, 9])
def test_points_that_hardly_differ_in_x_tell_no_slope(spread: float, spheres: int) -> None:
    """Repeats of one drop, whose impact speeds differ by their scatter, in every kind of regression."""
    x = 2.0 + spread * np.arange(9)
    y = 0.3 + 0.01 * np.random.default_rng(4).normal(size=9)
    points = apart(x, y, np.arange(9) % spheres)
    for found in (fit_power_law(points), fit_line(points, intercept=True), fit_line(points)):
        assert found.status == "too_few"
        assert np.isnan(found.slope)
