"""Closure times from simulated radius series: power laws, the ring model, a drifting exponent, aftermath."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.pinch_off import fit_closure

Floats = NDArray[np.float64]
Law = Callable[[Floats], Floats]
NOISE = 0.2


def power(exponent: float, curvature: float, amplitude: float) -> Law:
    return lambda left: amplitude * left**exponent * (1.0 + curvature * left)


def ring(amplitude: float, pressure: float) -> Law:
    """A ring that collapses under constant pressure: the square of its radius is a parabola in time."""
    return lambda left: amplitude * np.sqrt(np.maximum(left - pressure * left**2, 0.0))


def drifting(amplitude: float, span: float) -> Law:
    """The exponent of an axisymmetric neck, 1/2 + 1/(4√−ln τ)."""

    def law(left: Floats) -> Floats:
        share = np.clip(left / span, 1e-12, 0.9)
        return amplitude * share ** (0.5 + 0.25 / np.sqrt(-np.log(share))) * (left > 0)

    return law


LAWS = {
    "power 0.55": power(0.55, 0.0, 6.0),
    "power 0.55 bent": power(0.55, 0.01, 6.0),
    "power 0.5": power(0.5, -0.005, 6.0),
    "power 0.6": power(0.6, 0.0, 5.0),
    "ring": ring(7.0, 0.0),
    "ring under pressure": ring(7.0, 0.012),
    "drifting": drifting(70.0, 60.0),
}


def simulate(
    law: Law, closure: float, exposure: float, rng: np.random.Generator, *, frames: int = 45, after: float = 0.0
) -> tuple[Floats, Floats]:
    """Return frame times and radii in pixels, averaged over the exposure by summation, with noise."""
    time = np.arange(frames, dtype=float)
    inside = np.linspace(-0.5, 0.5, 81) * exposure
    left = np.maximum(closure - time[:, None] - inside[None, :], 0.0)
    radius = law(left).mean(axis=1) + rng.normal(0.0, NOISE, frames)
    gone = time - 0.5 * exposure > closure
    radius[gone] = np.abs(rng.normal(0.0, after, int(gone.sum())))
    return time, radius


def closure_errors(law: Law, exposure: float, count: int, seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    errors, pulls = [], []
    for _ in range(count):
        closure = 33.0 + rng.random()
        time, radius = simulate(law, closure, exposure, rng)
        fit = fit_closure(time, radius, NOISE, exposure_s=exposure, min_radius=1.5, last_time_s=time[-1])
        assert fit.status == "ok"
        errors.append(fit.t_s - closure)
        pulls.append(errors[-1] / fit.t_unc_s)
    return np.array(errors), np.array(pulls)


@pytest.mark.parametrize("name", LAWS)
def test_closure_time_is_found_to_a_tenth_of_a_frame(name: str) -> None:
    errors, pulls = closure_errors(LAWS[name], 0.5, 20, seed=7)
    assert abs(errors.mean()) < 0.06 + 2.0 * errors.std() / np.sqrt(errors.size)
    assert np.sqrt(np.mean(errors**2)) < 0.12
    assert np.sqrt(np.mean(pulls**2)) < 1.6


@pytest.mark.slow
@pytest.mark.parametrize("exposure", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("name", LAWS)
def test_closure_time_bias_and_scatter(name: str, exposure: float, capsys: pytest.CaptureFixture[str]) -> None:
    errors, pulls = closure_errors(LAWS[name], exposure, 120, seed=1)
    rmse = np.sqrt(np.mean(errors**2))
    with capsys.disabled():
        print(f"\n{name}, exposure {exposure}: bias {errors.mean():+.3f}, rmse {rmse:.3f}, pull {pulls.std():.2f}")
    assert abs(errors.mean()) < 0.06 + errors.std() / np.sqrt(errors.size)
    assert rmse < 0.12


def test_noiseless_power_law_is_recovered_exactly() -> None:
    time = np.arange(40) * 5e-4
    closure, exposure = 0.0197, 2e-4
    left = closure - time[:, None] - np.linspace(-0.5, 0.5, 801) * exposure
    radius = (3.0 * np.maximum(left, 0.0) ** 0.55).mean(axis=1)
    radius[time > closure] = np.nan
    fit = fit_closure(time, radius, 1e-4, exposure_s=exposure)
    assert fit.t_s == pytest.approx(closure, abs=2e-6)
    assert fit.exponent == pytest.approx(0.55, abs=2e-3)


def test_a_ring_under_pressure_is_recovered_exactly() -> None:
    """Half a percent of a frame, without noise: the law itself has no bias where the ring has fallen back for long."""
    time = np.arange(45.0)
    for closure in (33.1, 33.6):
        left = np.maximum(closure - time[:, None] - np.linspace(-0.25, 0.25, 801), 0.0)
        radius = ring(7.0, 0.012)(left).mean(axis=1)
        fit = fit_closure(time, radius, 1e-3, exposure_s=0.5, min_radius=1.5, last_time_s=time[-1])
        assert fit.t_s == pytest.approx(closure, abs=5e-3)
        assert fit.exponent == pytest.approx(0.5, abs=5e-3)
        assert fit.curvature_1_s == pytest.approx(-0.006, abs=5e-4)


def test_unit_of_length_and_origin_of_time_do_not_matter() -> None:
    time, radius = simulate(LAWS["ring"], 33.4, 0.5, np.random.default_rng(3))
    plain = fit_closure(time, radius, NOISE, exposure_s=0.5, min_radius=1.5)
    moved = fit_closure(time * 1e-3 + 7.0, radius * 2e-4, NOISE * 2e-4, exposure_s=5e-4, min_radius=3e-4)
    assert (moved.t_s - 7.0) * 1e3 == pytest.approx(plain.t_s, abs=1e-4)
    assert moved.t_unc_s * 1e3 == pytest.approx(plain.t_unc_s, rel=1e-3)
    assert moved.residual_rms == pytest.approx(plain.residual_rms * 2e-4, rel=1e-3)


def test_jets_and_mist_after_the_closure_do_not_move_it() -> None:
    errors = []
    rng = np.random.default_rng(5)
    for _ in range(30):
        closure = 33.0 + rng.random()
        time, radius = simulate(LAWS["power 0.55"], closure, 0.5, rng, after=2.0)
        fit = fit_closure(time, radius, NOISE, exposure_s=0.5, min_radius=1.5, last_time_s=time[-1])
        errors.append(fit.t_s - closure)
    assert np.median(np.abs(errors)) < 0.15
    assert np.mean(np.abs(errors) < 0.5) > 0.85


def test_spoiled_samples_do_not_move_the_closure() -> None:
    """Dust or an edge behind the neck spoils some frames in a row, by far more than the noise."""
    rng = np.random.default_rng(6)
    errors, pulls = [], []
    for _ in range(12):
        closure = 33.0 + rng.random()
        time, radius = simulate(LAWS["ring"], closure, 0.5, rng)
        at = int(rng.integers(14, 24))
        radius[at : at + 5] -= np.array([2.5, 5.0, 6.0, 4.0, 2.0])
        fit = fit_closure(time, radius, NOISE, exposure_s=0.5, min_radius=1.5, last_time_s=time[-1])
        assert fit.status == "ok"
        errors.append(fit.t_s - closure)
        pulls.append(errors[-1] / fit.t_unc_s)
    assert np.sqrt(np.mean(np.square(errors))) < 0.2
    assert np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_clip_that_ends_first_says_so_and_gives_no_time() -> None:
    time, radius = simulate(LAWS["ring"], 33.4, 0.5, np.random.default_rng(3), frames=28)
    fit = fit_closure(time, radius, NOISE, exposure_s=0.5, min_radius=1.5, last_time_s=time[-1])
    assert fit.status == "clip_ended"
    assert np.isnan(fit.t_s)
    assert np.isnan(fit.t_unc_s)
    assert fit.extrapolated_t_s == pytest.approx(33.4, abs=3.0)


def test_too_few_samples_say_so() -> None:
    time, radius = simulate(LAWS["ring"], 4.0, 0.5, np.random.default_rng(3), frames=6)
    assert fit_closure(time, radius, NOISE, min_radius=1.5).status == "too_few"
    assert fit_closure(time[:0], radius[:0], NOISE).status == "too_few"


def test_a_neck_that_does_not_close_is_no_closure() -> None:
    rng = np.random.default_rng(4)
    time = np.arange(45.0)
    fit = fit_closure(time, 20.0 + rng.normal(0.0, NOISE, time.size), NOISE, last_time_s=time[-1])
    assert fit.status in {"clip_ended", "too_few"}
    assert np.isnan(fit.t_s)


def test_a_law_that_does_not_fit_is_refused() -> None:
    time = np.arange(34.0)
    radius = 20.0 - 0.55 * time + 6.0 * np.sin(time)
    fit = fit_closure(time, radius, NOISE, last_time_s=60.0)
    assert fit.status == "poor_fit"
    assert np.isnan(fit.t_s)
