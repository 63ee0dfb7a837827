"""The parabola of a wall: against least squares, and where it meets the sphere."""

import math

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.wall import POINT_PX, choose_points, fit_wall, meet, place_on, variance_at

BEND = 0.01


def points(angle: float, curvature: float, noise: float = 0.0, number: int = 14) -> np.ndarray:
    """Points of a wall that starts at the origin, seen from there: x, y, how far off the sphere, doubt."""
    u = np.linspace(2.6, 14.0, number)
    v = 0.5 * curvature * u * u + np.random.default_rng(4).normal(0.0, noise, number)
    x, y = u * math.cos(angle) - v * math.sin(angle), u * math.sin(angle) + v * math.cos(angle)
    return np.stack([x, y, np.full(number, 3.0), np.full(number, 0.02)], axis=1)


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.4])
def test_the_fit_is_that_of_least_squares(angle):
    kept = points(angle, 0.004, noise=0.06)
    wall = fit_wall(kept, len(kept), BEND)
    u = kept[:, 0] * wall.dx + kept[:, 1] * wall.dy
    v = kept[:, 1] * wall.dx - kept[:, 0] * wall.dy
    design = np.vstack([np.stack([np.ones_like(u), u, 0.5 * u * u], 1) / POINT_PX, [0.0, 0.0, 1.0 / BEND]])
    expected, *_ = np.linalg.lstsq(design, np.append(v / POINT_PX, 0.0), rcond=None)
    assert [wall.c0, wall.c1, wall.c2] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert math.atan2(wall.dy, wall.dx) == pytest.approx(angle, abs=0.1)
    left = v - design[:-1] @ expected * POINT_PX
    assert wall.residual == pytest.approx(math.sqrt(np.sum(left**2) / (len(kept) - 2)), rel=1e-6)
    row = np.array([1.0, -2.0, 2.0])
    scaled = row @ np.linalg.inv(design.T @ design) @ row * max(1.0, (wall.residual / POINT_PX) ** 2)
    assert variance_at(wall, -2.0) == pytest.approx(scaled + 0.02**2, rel=1e-6)


def test_points_near_the_corner_or_on_the_sphere_or_far_away_are_left_out():
    corner, kept = (10.0, 20.0), np.empty((5, 4))
    rows = np.array([[11.0, 20.0, 2.0, 0.0], [14.0, 20.0, 2.0, 0.1], [15.0, 20.0, 0.2, 0.0], [30.0, 20.0, 9.0, 0.0]])
    assert choose_points(rows, 0.0, corner, 8.0, kept) == 1
    assert kept[0, [0, 1, 3]].tolist() == [4.0, 0.0, 0.1]


@pytest.mark.parametrize("curvature", [0.0, 0.006])
def test_the_wall_is_carried_back_to_the_sphere(curvature):
    """From a corner that is 1.5 px off along the wall, back to where it leaves a sphere, straight sideways."""
    shape = EllipseShape(0.0, 0.0, 60.0)
    seen = points(0.0, curvature)
    seen[:, 0] -= 1.5
    wall = fit_wall(seen, len(seen), BEND)
    u, sine = meet(shape.vector(), (1.0, 0.0), 0.0, (60.0 + 1.5, 0.0), wall)
    x, y = place_on(wall, u)
    assert math.hypot(61.5 + x, y) == pytest.approx(60.0, abs=0.01)
    assert y == pytest.approx(0.0, abs=0.1)
    assert sine == pytest.approx(1.0, abs=0.02)
