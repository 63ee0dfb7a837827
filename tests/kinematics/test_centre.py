"""The centre of mass of an ellipsoid from its lowest point."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.kinematics.centre import below_ellipsoid, centre_height


def test_the_lowest_point_of_a_leaning_ellipsoid() -> None:
    """Against the lowest of many points of the outline itself."""
    stretch, radius, lean = 0.8, 0.0255, np.radians(7.0)
    phi = np.linspace(0.0, 2.0 * np.pi, 200_001)
    across, along = radius * stretch * np.cos(phi), radius / stretch**2 * np.sin(phi)
    lowest = float(np.min(across * np.sin(lean) + along * np.cos(lean)))
    one = np.array([1.0])
    height, _ = centre_height(lowest * one, 0.0 * one, stretch * one, 0.0 * one, radius, np.array([7.0]))
    assert height[0] == pytest.approx(0.0, abs=1e-9)
    upright, _ = centre_height(0.0 * one, 0.0 * one, stretch * one, 0.0 * one, radius, np.array([np.nan]))
    assert upright[0] == pytest.approx(radius / stretch**2)


def test_an_outline_that_reaches_lower_than_an_ellipsoid() -> None:
    """A sphere of radius 50 px whose lowest point is .2 px too low; a frame that was not seen moves nothing."""
    stretch = np.array([1.2, 1.2, 1.2])
    depth = 50.0 / 1.44 + np.array([0.2, 0.0, np.nan])
    low = below_ellipsoid(depth, np.full(3, 50.0), stretch, np.full(3, np.nan), 0.0255)
    assert low == pytest.approx([0.2 * 0.0255 / 50.0, 0.0, 0.0])
