"""Added mass of the spheroid against high-precision values and its limits."""

import numpy as np
import pytest

from wentry_cli.mechanics.added_mass import SERIES_LIMIT, added_mass_coefficient


@pytest.mark.parametrize(("stretch", "expected"), [(0.74, 0.159011), (1.0, 0.5), (1.3, 1.238156), (1.5, 1.979210)])
def test_published_values(stretch, expected):
    assert added_mass_coefficient(stretch) == pytest.approx(expected, abs=6e-7)


def test_series_meets_closed_form():
    edge = (1.0 + SERIES_LIMIT) ** (1 / 6)
    inside, outside = added_mass_coefficient([edge - 1e-13, edge + 1e-13])
    assert inside == pytest.approx(outside, rel=1e-12)


@pytest.mark.parametrize("stretch", [0.5, 0.9, 0.999, 1.0001, 1.2, 2.0])
def test_equals_the_integral(stretch):
    """α₀ = a b² ∫₀^∞ ds / ((a² + s)^1.5 (b² + s)) by Gauss–Legendre on s = a² (1/u² − 1)."""
    a, b = stretch**-2, stretch
    nodes, weights = np.polynomial.legendre.leggauss(200)
    u = 0.5 * (nodes + 1.0)
    alpha = a * b**2 * np.sum(0.5 * weights * 2.0 / a * u**2 / (a**2 + (b**2 - a**2) * u**2))
    assert added_mass_coefficient(stretch) == pytest.approx(alpha / (2.0 - alpha), rel=1e-12)


def test_keeps_shape_and_gaps():
    found = added_mass_coefficient([[1.0, np.nan], [1.1, 0.9]])
    assert found.shape == (2, 2)
    assert np.isnan(found[0, 1])


def test_refuses_a_stretch_that_is_not_positive():
    with pytest.raises(ValueError, match="positive"):
        added_mass_coefficient([1.0, 0.0])
