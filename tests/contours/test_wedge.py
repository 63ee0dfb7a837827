"""What a thin dark wedge does to the edge behind it, by profiles that are drawn without the estimators."""

import numpy as np
import pytest
from scipy.special import ndtr

from wentry_cli.contours.wedge import most_shift, wedge_shift, wedge_step
from wentry_cli.imaging.edges import edge_candidates

GROUND, SPHERE, WALL = 1.0, 0.25, 0.06
EDGE = 30.0


def picture(wide: float, blur: float) -> np.ndarray:
    """Sphere, wedge and ground from left to right; the edge of the sphere is met aslant, and so less steep."""
    x = np.arange(64.0)
    line = SPHERE + (WALL - SPHERE) * ndtr((x - EDGE) / (np.sqrt(2.0) * blur))
    line += (GROUND - WALL) * ndtr((x - EDGE - wide) / blur)
    return np.tile(line.astype(np.float32), (9, 1))


@pytest.mark.parametrize("blur", [0.9, 1.3, 1.8])
@pytest.mark.parametrize("wide", [0.7, 1.5, 2.5, 4.0, 7.0])
def test_the_shift_is_that_of_the_matched_filter(wide, blur):
    rays = np.array([[EDGE + wide, 4.0, 1.0, 0.0]])
    at, _, _ = edge_candidates(picture(wide, blur), rays, 8.0, 1.0, 1)
    shift = wedge_shift((SPHERE - WALL) / (GROUND - WALL), wide + at[0, 0], blur)
    assert at[0, 0] == pytest.approx(shift, abs=0.05)
    assert shift < most_shift((SPHERE - WALL) / (GROUND - WALL)) * (2.0 if blur > 1.5 else 1.5)


@pytest.mark.parametrize("blur", [0.9, 1.3])
def test_the_step_is_read_from_the_widest_wedges(blur):
    rays = np.array([[EDGE, 4.0, 1.0, 0.0]] * 2)
    step = wedge_step(picture(6.0, blur), rays, 0.0, np.array([6.0, 1.0]), blur)
    assert step == pytest.approx((SPHERE - WALL) / (GROUND - WALL), abs=0.02)
    dark = np.where(picture(6.0, blur) > 0.5, 1.0, WALL).astype(np.float32)
    assert abs(wedge_step(dark, rays, 0.0, np.array([6.0, np.nan]), blur)) < 0.02


def test_without_a_wall_there_is_no_step():
    rays = np.array([[EDGE, 4.0, 1.0, 0.0]])
    assert wedge_step(picture(6.0, 1.0), rays, 0.0, np.array([np.nan]), 1.0) == 0.0
