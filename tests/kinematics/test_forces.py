from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.kinematics.forces import Body, PeriodEnds, period_force_coefficient, rigid_force_coefficient

BODY = Body(0.051, 1070.0, 998.0, 9.81)


def test_rigid_coefficient_by_hand() -> None:
    speed, acceleration = np.array([-3.0]), np.array([20.0])
    found = rigid_force_coefficient((speed, np.zeros(1)), (acceleration, np.ones(1)), BODY)
    volume = np.pi * 0.051**3 / 6
    area = 0.5 * 998 * 9 * np.pi * 0.051**2 / 4
    assert found.net[0] == pytest.approx(1070 * volume * 20 / area)
    assert found.hydrodynamic[0] == pytest.approx((1070 * volume * 29.81 - 998 * volume * 9.81) / area)
    assert found.net_unc[0] == pytest.approx(found.net[0] / 20)


def test_a_rigid_sphere_at_rest_has_no_coefficient() -> None:
    zero = np.zeros(1)
    assert np.isnan(rigid_force_coefficient((zero, zero), (zero, zero), BODY).net).all()


def test_a_period_of_constant_motion_equals_the_instantaneous_value() -> None:
    """Constant bottom speed and acceleration, λ_p = 1: the mean is the value of every instant."""
    ends = PeriodEnds(0.01, 0.03, -3.2, -2.8, -0.03, -0.09)
    mean = period_force_coefficient(ends, 1.0, 0.0, BODY)
    instant = rigid_force_coefficient((np.array([-3.0]), np.zeros(1)), (np.array([20.0]), np.zeros(1)), BODY)
    assert mean.net == pytest.approx(instant.net[0])
    assert mean.hydrodynamic == pytest.approx(instant.hydrodynamic[0])


def test_a_wider_sphere_has_a_smaller_coefficient() -> None:
    ends = PeriodEnds(0.01, 0.03, -3.2, -2.8, -0.03, -0.09)
    narrow, wide = (period_force_coefficient(ends, peak, 0.0, BODY).net for peak in (1.0, 1.5))
    assert wide == pytest.approx(narrow / 2.25)


def test_uncertainties_are_those_of_a_monte_carlo() -> None:
    random = np.random.default_rng(0)
    unc = {"velocity_start": 0.02, "velocity_end": 0.03, "bottom_start": 2e-4, "bottom_end": 3e-4}
    centre = {"velocity_start": -3.2, "velocity_end": -2.8, "bottom_start": -0.03, "bottom_end": -0.09}
    ends = PeriodEnds(0.01, 0.03, **centre, **{f"{k}_unc": v for k, v in unc.items()})
    found = period_force_coefficient(ends, 1.3, 0.01, BODY)
    draws = [
        period_force_coefficient(
            PeriodEnds(0.01, 0.03, **{k: v + unc[k] * random.normal() for k, v in centre.items()}),
            1.3 + 0.01 * random.normal(),
            0.0,
            BODY,
        )
        for _ in range(4000)
    ]
    assert np.std([d.net for d in draws]) == pytest.approx(float(found.net_unc), rel=0.05)
    assert np.std([d.hydrodynamic for d in draws]) == pytest.approx(float(found.hydrodynamic_unc), rel=0.05)


def test_a_scale_that_is_off_moves_both_coefficients_as_stated() -> None:
    zero, off = np.zeros(1), 1e-4
    true, wrong = (
        rigid_force_coefficient((np.array([-3.0 * k]), zero), (np.array([20.0 * k]), zero), BODY, scale_unc=off)
        for k in (1.0, 1.0 + off)
    )
    assert true.net_unc[0] == pytest.approx(abs(wrong.net[0] - true.net[0]), rel=1e-3)
    assert true.hydrodynamic_unc[0] == pytest.approx(abs(wrong.hydrodynamic[0] - true.hydrodynamic[0]), rel=1e-3)
