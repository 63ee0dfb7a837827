from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.scaling import dimensionless as d


def test_values_by_hand() -> None:
    assert d.froude(5.0, 0.051) == pytest.approx(7.0688, rel=1e-4)
    assert d.bond(0.051, 998.2, 0.0728) == pytest.approx(349.86, rel=1e-4)
    assert d.reynolds(5.0, 0.051, 998.2, 1e-3) == pytest.approx(254541)
    assert d.stiffness_ratio(6900.0, 5.0, 998.2) == pytest.approx(0.27650, rel=1e-4)
    assert d.elastic_time(0.051, 6900.0, 1070.0) == pytest.approx(0.020083, rel=1e-4)
    assert d.effective_diameter(0.051, 1.4) == pytest.approx(0.0714)
    assert d.speed_from_height(1.53) == pytest.approx(5.4789, rel=1e-4)
    assert d.velocity_loss(5.0, -1.0) == pytest.approx(1.2)


def test_a_sphere_at_rest() -> None:
    assert math.isnan(d.stiffness_ratio(6900.0, 0.0, 998.2))
    assert math.isnan(d.velocity_loss(0.0, 1.0))


@given(st.floats(0.1, 10), st.floats(0.1, 10), st.floats(0.5, 10), st.floats(0.01, 0.2))
def test_a_change_of_units_changes_nothing(length: float, time: float, speed: float, diameter: float) -> None:
    scaled = d.froude(speed * length / time, diameter * length, 9.81 * length / time**2)
    assert scaled == pytest.approx(d.froude(speed, diameter))
    # pressures scale as density × speed²
    stiff = d.stiffness_ratio(6900.0 / (length * time**2), speed * length / time, 998.0 / length**3)
    assert stiff == pytest.approx(d.stiffness_ratio(6900.0, speed, 998.0))
