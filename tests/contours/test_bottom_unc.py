from __future__ import annotations

import math

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import bottom_unc
from wentry_cli.contours.outline_fit import bottom_gradient


@pytest.mark.parametrize(("stretch", "tilt"), [(1.0, 0.0), (0.8, 3.0), (1.7, -20.0)])
def test_the_uncertainty_of_the_lowest_row_is_that_of_its_gradient(stretch: float, tilt: float) -> None:
    shape = EllipseShape(10.0, 20.0, 60.0, stretch, tilt)
    root = np.random.default_rng(4).normal(size=(5, 5))
    covariance, gradient = root @ root.T, bottom_gradient(shape.radius, stretch, math.radians(tilt))
    assert bottom_unc(shape, covariance) == pytest.approx(math.sqrt(gradient @ covariance @ gradient))


def test_what_is_not_known_and_what_does_not_vary() -> None:
    assert math.isnan(bottom_unc(EllipseShape(0.0, 0.0, 60.0), np.full((5, 5), np.nan)))
    assert bottom_unc(EllipseShape(0.0, 0.0, 60.0), np.zeros((5, 5))) == 0.0
