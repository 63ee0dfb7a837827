"""Derivatives of the closure law, and its minimum against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from wentry_cli.cavity.closure_law import HIGHEST, LOWEST, ClosureLaw, solve_closure

TIME = np.linspace(-1.0, 0.0, 30)


def law(exposure: float, seed: int = 0, noise: float = 0.01) -> ClosureLaw:
    clean = ClosureLaw(TIME, TIME, 1.0, exposure).predict(np.array([0.031, 0.02, 0.52, 0.15]))
    return ClosureLaw(TIME, clean + np.random.default_rng(seed).normal(0.0, noise, TIME.size), 0.01, exposure)


@pytest.mark.parametrize("exposure", [0.0, 0.004, 0.02])
def test_jacobian_is_that_of_differences(exposure: float) -> None:
    at = np.array([0.04, 0.1, 0.6, -0.2])
    _, jacobian = law(exposure).residuals(at)
    for column, step in enumerate(1e-6 * np.eye(4)):
        ahead, behind = (law(exposure).residuals(at + side)[0] for side in (step, -step))
        np.testing.assert_allclose(jacobian[:, column], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("exposure", [0.0, 0.004])
@pytest.mark.parametrize("seed", range(4))
def test_minimum_is_no_higher_than_that_of_a_trust_region_search(exposure: float, seed: int) -> None:
    closing = law(exposure, seed)
    start = np.array([0.02, 0.0, 0.55, 0.0])
    found = solve_closure(closing, start)
    peer = least_squares(lambda x: closing.residuals(x)[0], start, bounds=(LOWEST, HIGHEST), x_scale="jac")
    residual = closing.residuals(found.x)[0]
    assert residual @ residual <= 2.0 * peer.cost * (1.0 + 1e-9)
    np.testing.assert_allclose(found.x, peer.x, atol=2e-4)


def test_a_radius_that_does_not_shrink_ends_at_the_bounds() -> None:
    flat = ClosureLaw(TIME, np.ones(TIME.size), 0.01, 0.0)
    found = solve_closure(flat, np.array([0.5, 0.0, 0.55, 0.0]))
    assert np.all((found.x >= LOWEST) & (found.x <= HIGHEST))
    assert np.isfinite(found.jac).all()
