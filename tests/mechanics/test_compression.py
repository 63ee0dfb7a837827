"""Compression: the curve against finite elements and Hertz, and recovery of a modulus with an unknown zero."""

import numpy as np
import pytest

from wentry_cli.mechanics.compression import compression_force, fit_compression

DIAMETER = 0.0974


@pytest.mark.parametrize(("x", "expected"), [(0.1, 0.04797), (0.2, 0.15049), (0.4, 0.57878)])
def test_curve_agrees_with_finite_elements(x, expected):
    assert compression_force(x) == pytest.approx(expected, rel=2e-3)


def test_the_script_that_made_the_curve_agrees_with_it():
    pytest.importorskip("skfem", reason="the finite elements need the extra fem: pip install 'wentry[fem]'")
    from wentry_cli.bench.compression_fem import solve_compression

    x = np.array([0.1, 0.2, 0.4])
    assert compression_force(x) == pytest.approx(solve_compression(x, refinements=3, local=2), rel=2e-3)


@pytest.mark.slow
def test_the_curve_is_good_to_a_thousandth_of_the_finest_elements():
    pytest.importorskip("skfem", reason="the finite elements need the extra fem: pip install 'wentry[fem]'")
    from wentry_cli.bench.compression_fem import solve_compression

    x = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1])
    assert compression_force(x) == pytest.approx(solve_compression(x, refinements=3, local=6), rel=1.5e-3)


def test_curve_runs_into_hertz():
    x = np.array([1e-6, 1e-5])
    assert compression_force(x) == pytest.approx(4 / 3 * x**1.5, rel=2e-3)
    assert compression_force(-0.1) == 0.0
    assert np.isnan(compression_force(0.6))


def test_modulus_within_one_percent_at_one_percent_noise():
    rng = np.random.default_rng(7)
    d = np.linspace(0.0, 0.3 * DIAMETER, 200)
    errors, scores = [], []
    for _ in range(100):
        modulus, zero = 10 ** rng.uniform(3, 5), rng.uniform(-1e-3, 1e-3)
        clean = modulus * DIAMETER**2 * compression_force((d - zero) / DIAMETER)
        fit = fit_compression(d, clean + 0.01 * clean.max() * rng.standard_normal(d.size), DIAMETER)
        assert fit.status == "ok"
        errors.append(fit.g_inf_pa / modulus - 1)
        scores.append((fit.g_inf_pa - modulus) / fit.g_inf_pa_unc)
    assert np.sqrt(np.mean(np.square(errors))) < 0.01
    assert abs(np.mean(errors)) < 0.003
    assert 0.8 < np.std(scores) < 1.25


def test_exact_data_are_recovered_with_their_zero():
    d = np.linspace(0.0, 0.02, 60)
    force = 6900 * DIAMETER**2 * compression_force((d - 7e-4) / DIAMETER)
    fit = fit_compression(d, force, DIAMETER)
    assert fit.g_inf_pa == pytest.approx(6900, rel=1e-6)
    assert fit.zero_offset_m == pytest.approx(7e-4, abs=1e-8)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_uncertainty_follows_the_unit_of_force(unit):
    d = np.linspace(0.0, 0.02, 60)
    force = 6900 * DIAMETER**2 * compression_force(d / DIAMETER)
    force += 0.01 * np.random.default_rng(2).standard_normal(d.size)
    fit, other = fit_compression(d, force, DIAMETER), fit_compression(d, unit * force, DIAMETER)
    assert other.g_inf_pa_unc == pytest.approx(unit * fit.g_inf_pa_unc, rel=1e-4)
    assert other.zero_offset_m_unc == pytest.approx(fit.zero_offset_m_unc, rel=1e-4)


def test_too_few_points():
    assert fit_compression([0, 1e-3, 2e-3], [0, 1, 2], DIAMETER).status == "too_few"
    assert fit_compression([np.nan] * 20, np.arange(20.0), DIAMETER).status == "too_few"


def test_noise_alone_is_not_identified():
    rng = np.random.default_rng(3)
    fit = fit_compression(np.linspace(0, 0.02, 50), rng.standard_normal(50), DIAMETER)
    assert fit.status in ("not_identified", "too_few")
    assert np.isnan([fit.g_inf_pa, fit.g_inf_pa_unc]).all()


def test_a_force_of_the_wrong_sign_has_no_modulus():
    d = np.linspace(0, 0.02, 50)
    fit = fit_compression(d, -6900 * DIAMETER**2 * compression_force(d / DIAMETER), DIAMETER)
    assert fit.status == "not_identified"
    assert np.isnan([fit.g_inf_pa, fit.g_inf_pa_unc, fit.g_inf_low_pa, fit.g_inf_high_pa]).all()
