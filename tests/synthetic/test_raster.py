from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import erf, ndtr

from wentry_cli.synthetic.outline import draw_sphere_outline, measure_outline, shift_outline
from wentry_cli.synthetic.raster import Polygon, Window, draw_polygons

WINDOW = Window(0, 0, 128, 120)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


@settings(max_examples=30, deadline=None)
@given(
    x=st.floats(50.0, 70.0),
    y=st.floats(45.0, 70.0),
    radius=st.floats(15.0, 30.0),
    stretch=st.floats(0.85, 1.25),
    psf=st.floats(0.6, 1.5),
)
def test_light_taken_away_is_the_area_and_its_centroid_the_centre(x, y, radius, stretch, psf):
    outline = shift_outline(draw_sphere_outline(radius, stretch), x, y)
    hidden = 1.0 - draw_polygons([[Polygon(outline, 0.0, 1)]], WINDOW, psf).astype(float)
    rows, columns = np.mgrid[: hidden.shape[0], : hidden.shape[1]]
    area = np.pi * radius**2 / stretch
    assert hidden.sum() == pytest.approx(area, rel=3e-5)
    assert (hidden * columns).sum() / hidden.sum() == pytest.approx(x, abs=1e-3)
    assert (hidden * rows).sum() / hidden.sum() == pytest.approx(y, abs=1e-3)


@pytest.mark.parametrize("edge", [20.0, 20.2, 20.5, 20.9])
def test_straight_edge_is_a_blurred_step_integrated_over_the_pixel(edge):
    image = draw_polygons([[Polygon(rectangle(edge, -50.0, 300.0, 300.0), 0.0, 1)]], WINDOW, 1.0)
    x = np.arange(128)[:, None] + np.linspace(-0.4995, 0.4995, 1000)[None, :]
    expected = 1.0 - ndtr(x - edge).mean(axis=1)
    assert np.abs(image[60] - expected).max() < 2e-5


@pytest.mark.parametrize("edge", [40.0, 40.001, 40.125, 40.31, 40.4, 40.77, 40.999])
def test_level_edge_is_where_it_is(edge):
    image = draw_polygons([[Polygon(rectangle(-50.0, edge, 300.0, 300.0), 0.0, 1)]], WINDOW, 1.0)
    depth = (1.0 - image[:, 64].astype(float)).sum()
    assert 119.5 - depth == pytest.approx(edge, abs=5e-5)
    y = np.arange(120)[:, None] + np.linspace(-0.4995, 0.4995, 1000)[None, :]
    assert np.abs(image[:, 64] - (1.0 - ndtr(y - edge).mean(axis=1))).max() < 2e-3


@pytest.mark.parametrize("row", [45, 60, 70])
def test_chords_of_an_ellipse_are_right_to_a_thousandth_of_a_pixel(row):
    center, along, across = np.array([64.3, 59.6]), 25.2 / 1.1**2, 25.2 * 1.1
    outline = draw_sphere_outline(25.2, 1.1) + center
    image = draw_polygons([[Polygon(outline, 0.0, 1)]], WINDOW, 1.0)
    u = np.linspace(row - 6.0, row + 6.0, 4001)
    weight = erf((row + 0.5 - u) / np.sqrt(2.0)) - erf((row - 0.5 - u) / np.sqrt(2.0))
    chord = 2.0 * across * np.sqrt(np.clip(1.0 - ((u - center[1]) / along) ** 2, 0.0, None))
    assert (1.0 - image[row].astype(float)).sum() == pytest.approx((weight * chord).sum() / weight.sum(), abs=2e-3)


def test_higher_layer_hides_and_a_hole_lets_through():
    big, small = rectangle(20.0, 20.0, 100.0, 100.0), rectangle(40.0, 40.0, 80.0, 80.0)
    image = draw_polygons([[Polygon(small, 0.8, 2), Polygon(big, 0.1, 1)]], WINDOW, 0.7)
    assert image[60, 60] == pytest.approx(0.8, abs=1e-5)
    assert image[60, 30] == pytest.approx(0.1, abs=1e-5)
    assert image[10, 10] == pytest.approx(1.0, abs=1e-5)
    holed = np.concatenate([big, big[:1], small[:1], small[::-1]])
    assert draw_polygons([[Polygon(holed, 0.1, 1)]], WINDOW, 0.7)[60, 60] == pytest.approx(1.0, abs=1e-5)


def test_overlap_of_one_layer_is_not_counted_twice():
    left, right = rectangle(20.0, 20.0, 70.0, 90.0), rectangle(50.0, 20.0, 100.0, 90.0)
    both = draw_polygons([[Polygon(left, 0.2, 1), Polygon(right, 0.2, 1)]], WINDOW, 1.0)
    one = draw_polygons([[Polygon(rectangle(20.0, 20.0, 100.0, 90.0), 0.2, 1)]], WINDOW, 1.0)
    np.testing.assert_allclose(both, one, atol=1e-6)


def test_a_window_shows_the_same_as_the_whole_frame():
    outline = shift_outline(draw_sphere_outline(30.0, 1.2), 60.3, 55.4)
    whole = draw_polygons([[Polygon(outline, 0.1, 1)]], WINDOW, 1.0)
    part = draw_polygons([[Polygon(outline, 0.1, 1)]], Window(37, 20, 90, 88), 1.0)
    np.testing.assert_allclose(part, whole[20:88, 37:90], atol=1e-5)


def test_exposure_is_the_mean_of_its_instants():
    outline = draw_sphere_outline(20.0, 1.0)
    instants = [[Polygon(shift_outline(outline, 60.0 + d, 60.0), 0.1, 1)] for d in (-1.0, 0.0, 1.0)]
    mean = np.mean([draw_polygons([polygons], WINDOW, 1.0) for polygons in instants], axis=0)
    np.testing.assert_allclose(draw_polygons(instants, WINDOW, 1.0), mean, atol=1e-5)


def test_outline_is_measured_between_its_points():
    half, bottom = measure_outline(draw_sphere_outline(50.0, 1.3))
    assert (half, bottom) == pytest.approx((65.0, 50.0 / 1.69), abs=1e-6)
    half, bottom = measure_outline(draw_sphere_outline(50.0, 1.0, misfit=(0.0, 0.01)))
    assert (half, bottom) == pytest.approx((50.5, 50.5), abs=1e-6)
