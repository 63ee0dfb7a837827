from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.kinematics.ballistic import fit_parabola


def test_without_noise_the_parabola_comes_back() -> None:
    t = np.linspace(0.0, 5e-4, 15)
    fit = fit_parabola(t, 0.2 - 1.57 * t - 4.905 * t**2, 1e-6)
    states, covariance = fit.evaluate(t)
    assert np.allclose(states[:, 1], -1.57 - 9.81 * t, atol=1e-9)
    assert np.allclose(states[:, 2], -9.81, atol=1e-4)
    assert covariance.shape == (15, 3, 3)
    assert fit.noise_scale == 1.0


@pytest.mark.parametrize(("stated", "relative"), [(1.0, False), (0.1, False), (10.0, True)])
def test_the_interval_holds_gravity_as_often_as_it_says(stated: float, relative: bool) -> None:
    """Fifteen frames, whether the noise was stated right, ten times too small, or only in its ratios."""
    t, noise, held, widths = np.arange(15) / 30000, 2e-7, 0, []
    for seed in range(400):
        random = np.random.default_rng(seed)
        fit = fit_parabola(
            t, -1.57 * t - 4.905 * t**2 + noise * random.normal(size=15), stated * noise, relative=relative
        )
        unc = np.sqrt(fit.covariance[2, 2])
        held += abs(fit.parameters[2] + 9.81) < 1.96 * unc
        widths.append(unc)
    assert 0.92 < held / 400 < 0.99
    # σ_a = σ √(720/n)/T² for many frames
    assert np.median(widths) == pytest.approx(noise * np.sqrt(720 / 15) / (14 / 30000) ** 2, rel=0.35)


def test_outliers_and_missing_frames_are_left_out() -> None:
    t = np.arange(30) * 1e-3
    y = -4.905 * t**2 + 1e-5 * np.random.default_rng(0).normal(size=30)
    y[4], y[9] = np.nan, 0.01
    fit = fit_parabola(t, y, 1e-5)
    assert not fit.used[4]
    assert not fit.used[9]
    assert fit.parameters[2] == pytest.approx(-9.81, abs=4 * np.sqrt(fit.covariance[2, 2]))


def test_too_few() -> None:
    fit = fit_parabola(np.arange(3.0), np.zeros(3), 1.0)
    assert fit.status == "too_few"
    assert np.isnan(fit.evaluate(np.zeros(1))[0]).all()
