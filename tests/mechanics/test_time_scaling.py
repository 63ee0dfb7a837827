"""The ratio of periods under noise, shallow valleys, a period that grows, and clips that end early."""

import math

import numpy as np
import pytest

from wentry_cli.mechanics.bergstrom_boyce import Material
from wentry_cli.mechanics.solver import find_period, solve_oscillation
from wentry_cli.mechanics.time_scaling import Measured, fit_time_scale

SPHERES = [
    Material(0.025, 1070.0, 6900.0, 6900.0, 0.0866, 1.0, 1.0, -0.1902, 0.021),
    Material(0.025, 1070.0, 1235.0, 1235.0, 0.0866, 1.0, 1.0, -1.0, 0.0056),
    Material(0.0487, 1070.0, 74690.0, 74690.0, 0.0866, 1.0, 1.0, -0.2402, 0.0024),
]
FPS = 4000.0


def ringing(rng, material, peak, ratio, *, noise=0.005, shallow=0.0, growth=0.0, periods=3.0):
    """Times after the peak and λ of the model slowed by ``ratio``; the true ratio of free periods is also given."""
    unit = find_period(material, peak)
    times = np.arange(0.0, periods * ratio * unit, 1 / FPS) + rng.uniform(0.0, 1 / FPS)
    cycles = times / (ratio * unit)
    if growth:
        cycles = (np.sqrt(1.0 + 4.0 * growth * cycles) - 1.0) / (2.0 * growth)
    stretch = solve_oscillation(material, peak, cycles * unit).stretch
    stretch = np.where(stretch < 1.0, 1.0 - (1.0 - shallow) * (1.0 - stretch), stretch)
    return times, stretch + noise * rng.standard_normal(times.size), ratio * (1.0 + growth)


@pytest.mark.parametrize("shallow", [0.0, 0.3])
def test_bias_and_uncertainty(shallow):
    rng = np.random.default_rng(4)
    errors, scores = [], []
    for k in range(45):
        material, peak, ratio = SPHERES[k % 3], rng.uniform(1.2, 1.9), rng.uniform(1.0, 1.6)
        times, stretch, truth = ringing(rng, material, peak, ratio, shallow=shallow)
        fit = fit_time_scale(material, Measured(peak, 0.0), times, stretch, np.full(times.size, 0.005))
        assert fit.status == "ok"
        errors.append(fit.ratio / truth - 1.0)
        scores.append((fit.ratio - truth) / fit.ratio_unc)
    assert abs(np.mean(errors)) < 0.002
    assert np.std(errors) < 0.006
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.5


def test_measured_peaks_decide_where_the_period_grows():
    rng = np.random.default_rng(8)
    material, peak = SPHERES[0], 1.5
    times, stretch, truth = ringing(rng, material, peak, 1.3, noise=0.001, growth=0.05)
    period = truth * find_period(material, peak)
    alone = fit_time_scale(material, Measured(peak, 0.001), times, stretch)
    both = fit_time_scale(material, Measured(peak, 0.001), times, stretch, period=Measured(period, 0.001 * period))
    assert abs(both.ratio / truth - 1.0) < 0.5 * abs(alone.ratio / truth - 1.0)
    assert both.period_exp_s / both.period_model_s == pytest.approx(both.ratio)
    assert abs(both.ratio - truth) < 3.0 * both.ratio_unc


def test_shift_and_outliers():
    rng = np.random.default_rng(9)
    times, stretch, truth = ringing(rng, SPHERES[0], 1.6, 1.2, noise=0.002)
    stretch[::17] += 0.3
    stretch[5] = np.nan
    fit = fit_time_scale(SPHERES[0], Measured(1.6, 0.002), times + 4e-4, stretch)
    assert fit.ratio == pytest.approx(truth, rel=5e-3)
    assert fit.shift_s == pytest.approx(4e-4, abs=1.5e-4)


def test_clip_without_second_peak_says_so_and_is_less_sure():
    rng = np.random.default_rng(10)
    times, stretch, truth = ringing(rng, SPHERES[0], 1.6, 1.2, noise=0.003, periods=3.0)
    unc = np.full(times.size, 0.003)
    whole = fit_time_scale(SPHERES[0], Measured(1.6, 0.003), times, stretch, unc)
    early = times < 0.5 * truth * whole.period_model_s
    part = fit_time_scale(SPHERES[0], Measured(1.6, 0.003), times[early], stretch[early], unc[early])
    blind = fit_time_scale(SPHERES[0], Measured(1.6, 0.003), times, np.where(early, stretch, np.nan), unc)
    assert part.status == blind.status == "clip_ended"
    assert blind.ratio == pytest.approx(part.ratio, rel=1e-6)
    assert part.ratio_unc > 2.0 * whole.ratio_unc
    assert abs(part.ratio - truth) < 4.0 * part.ratio_unc


@pytest.mark.parametrize(
    ("peak", "count", "status"), [(1.5, 3, "too_few"), (0.9, 100, "not_identified"), (math.nan, 100, "refused")]
)
def test_what_cannot_be_scaled(peak, count, status):
    times = np.linspace(0.0, 0.05, count)
    if status == "refused":
        with pytest.raises(Exception, match="initial stretch"):
            fit_time_scale(SPHERES[0], Measured(peak, 0.0), times, np.full(count, 1.1))
        return
    fit = fit_time_scale(SPHERES[0], Measured(peak, 0.0), times, np.full(count, 1.1))
    assert fit.status == status
    assert math.isnan(fit.ratio)


def test_noise_alone_gives_no_ratio():
    rng = np.random.default_rng(12)
    times = np.linspace(0.0, 0.1, 200)
    fit = fit_time_scale(SPHERES[0], Measured(1.0002, 0.0), times, 1.0 + 0.01 * rng.standard_normal(200))
    assert fit.status == "not_identified" or fit.ratio_unc > 0.05
