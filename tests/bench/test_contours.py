"""The comparison of contour methods: it compares what it says, and ours is nearer to the bound."""

import math

import numpy as np
import pytest

from wentry_cli.bench.contour_peers import recipes
from wentry_cli.bench.contours import CASES, bound_of, draw_frame, run


@pytest.fixture(scope="module")
def rows():
    return run(quick=True, seed=7)


def pick(rows, case, method, quantity):
    (row,) = (r for r in rows if (r.case, r.method, r.quantity) == (case, method, quantity))
    return row


def test_ours_is_near_the_bound_and_ordinary_recipes_are_not(rows):
    case = CASES[0].name
    accurate = pick(rows, case, "wentry accurate", "bottom_y")
    ordinary = pick(rows, case, "threshold + cv2.fitEllipse", "bottom_y")
    half_pixel = pick(rows, case, "threshold + cv2.fitEllipse + half pixel", "bottom_y")
    assert accurate.ratio_to_bound < 2.0
    assert accurate.failures == 0.0
    assert ordinary.ratio_to_bound > 30.0
    assert ordinary.bias == pytest.approx(-0.5, abs=0.2)
    assert abs(half_pixel.bias) < abs(ordinary.bias)


def test_every_method_has_a_time_and_a_share_of_failures(rows):
    assert {r.chapter for r in rows} == {"contours"}
    for row in rows:
        assert row.time_us > 0.0
        assert 0.0 <= row.failures <= 1.0
        assert math.isfinite(row.rmse) or row.failures == 1.0


@pytest.mark.parametrize("name", recipes())
def test_a_recipe_sees_a_clean_sphere(name):
    frame = draw_frame(CASES[0], 3)
    stretch, bottom = recipes()[name](frame.region, frame.shape.radius, frame.top_y)
    assert stretch == pytest.approx(frame.shape.stretch, abs=0.02)
    assert bottom == pytest.approx(frame.bottom_y, abs=0.8)


@pytest.mark.parametrize("name", recipes())
def test_a_recipe_without_a_sphere_has_no_number(name):
    assert all(math.isnan(v) for v in recipes()[name](np.ones((60, 60), np.float32), 20.0, 30.0))


def test_the_bound_of_a_moving_sphere_is_larger():
    moving = next(case for case in CASES if case.motion_px != (0.0, 0.0))
    assert bound_of(moving).bottom_y_px > bound_of(CASES[0]).bottom_y_px
