"""The Cramér–Rao bound against limits that are known on paper."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from wentry_cli.contours.bounds import cramer_rao_bound, edge_information, visible_top
from wentry_cli.contours.ellipse import EllipseShape


def test_information_of_an_edge_about_its_place():
    # integral of the squared derivative of a blurred step: A^2 / (2 sqrt(pi) s sigma^2)
    local = edge_information(0.02, 0.02, 1.3, 0.7)
    assert local[0, 0] == pytest.approx(0.7**2 / (2 * math.sqrt(math.pi) * 1.3 * 0.02**2), rel=1e-6)


def test_a_whole_circle_on_paper():
    # without nuisances cov(x) = 1 / (I pi R) and cov(R) = 1 / (2 I pi R); the levels cost the radius a little
    b = cramer_rao_bound(EllipseShape(0, 0, 72.0), free="x y R", noise=0.01, blur_px=1.04, contrast=1.0)
    information = edge_information(0.01, 0.01, 1.04, 1.0)[0, 0]
    assert b.x_px == pytest.approx(1.0 / math.sqrt(information * math.pi * 72.0), rel=0.05)
    assert b.x_px == pytest.approx(b.y_px, rel=1e-6)
    assert 0.00085 < b.radius_px < 0.00125


@settings(max_examples=20)
@given(factor=st.floats(1.1, 8.0), stretch=st.floats(0.8, 1.9), visible=st.floats(0.2, 1.0))
def test_bounds_are_proportional_to_noise_over_contrast(factor, stretch, visible):
    shape = EllipseShape(3.0, 4.0, 50.0, stretch)
    low = cramer_rao_bound(shape, noise=0.01, visible=visible)
    high = cramer_rao_bound(shape, noise=0.01 * factor, visible=visible)
    assert high.stretch == pytest.approx(factor * low.stretch, rel=1e-6)
    assert high.bottom_y_px == pytest.approx(factor * low.bottom_y_px, rel=1e-6)


def test_the_scene_of_the_design_notes():
    b = cramer_rao_bound(EllipseShape(0, 0, 60.0, 1.2), noise=0.01, contrast=1.0, visible=0.5)
    assert b.x_px == pytest.approx(0.0026, rel=0.08)
    assert b.y_px == pytest.approx(0.0025, rel=0.08)
    assert b.stretch == pytest.approx(0.41e-4, rel=0.1)
    assert b.bottom_y_px == pytest.approx(0.0021, rel=0.1)


@settings(max_examples=20)
@given(stretch=st.floats(0.8, 1.9), visible=st.floats(0.1, 0.95))
def test_more_arc_and_fewer_parameters_never_hurt(stretch, visible):
    shape = EllipseShape(0.0, 0.0, 60.0, stretch)
    some = cramer_rao_bound(shape, noise=0.01, visible=visible)
    all_of_it = cramer_rao_bound(shape, noise=0.01)
    held = cramer_rao_bound(shape, free="x y", noise=0.01, visible=visible)
    assert all_of_it.bottom_y_px <= some.bottom_y_px * 1.0001
    assert held.y_px <= some.y_px * 1.0001
    assert math.isnan(held.stretch)


def test_half_of_the_arc_lies_below_the_centre():
    assert visible_top(EllipseShape(5.0, 70.0, 40.0, 1.3), 0.5) == pytest.approx(70.0, abs=0.2)
    assert visible_top(EllipseShape(5.0, 70.0, 40.0, 1.3), 1.0) == -np.inf


FINE, SIDE, BLUR = 4, 140, 1.2


def picture(change=()):
    """A dark ellipse on a ground of level 1, blurred on a fine grid; ``change`` moves x, y, stretch, and nuisances."""
    x, y, stretch, inside, outside, across, down, ln_blur = (
        np.array([70.1, 68.3, 1.2, 0.1, 1.0, 0.0, 0.0, 0.0]) + change
    )
    row, column = np.mgrid[: SIDE * FINE, : SIDE * FINE] / FINE
    a, b = 40.0 * stretch, 40.0 / stretch**2
    u, v = (column - x) / a, (row - y) / b
    radius = np.hypot(u, v)
    distance = (radius - 1.0) * radius / np.hypot(u / a, v / b)
    covered = gaussian_filter(np.clip(0.5 - FINE * distance, 0.0, 1.0), FINE * BLUR * math.exp(ln_blur))[::FINE, ::FINE]
    ground = outside + across * (column - 70.1)[::FINE, ::FINE] / 40.0 + down * (row - 68.3)[::FINE, ::FINE] / 40.0
    return inside * covered + ground * (1.0 - covered), distance[::FINE, ::FINE]


@pytest.fixture(scope="module")
def derivatives():
    """Change of each pixel with x, y, stretch and the nuisances (8, rows, columns), and its distance from the edge."""
    steps = np.diag([0.2, 0.2, 0.004, 0.01, 0.01, 0.01, 0.01, 0.02])
    slopes = [(picture(step)[0] - picture(-step)[0]) / (2.0 * step.sum()) for step in steps]
    return np.array(slopes), picture(np.zeros(8))[1]


@pytest.mark.parametrize("dimmed_to", [0.0, 0.6])
@pytest.mark.parametrize("seed", [1, 2])
def test_of_what_is_left_the_pixels_tell_as_much_as_their_derivatives_say(derivatives, dimmed_to, seed):
    slopes, distance = derivatives
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:SIDE, :SIDE]
    seen = np.ones((SIDE, SIDE))
    for angle, size in zip(rng.uniform(0.0, 2.0 * np.pi, 9), rng.uniform(4.0, 10.0, 9), strict=True):
        centre = 70.1 + 48.0 * np.cos(angle), 68.3 + 27.8 * np.sin(angle)
        seen[np.hypot(column - centre[0], row - centre[1]) < size] = dimmed_to
    told = (slopes * seen)[:, np.abs(distance) < 12.0]
    expected = 0.01 * np.sqrt(np.diag(np.linalg.inv(told @ told.T)))[:3]
    shape = EllipseShape(70.1, 68.3, 40.0, 1.2)
    found = cramer_rao_bound(shape, noise=0.01, blur_px=BLUR, contrast=0.9, counts=seen**2)
    assert [found.x_px, found.y_px, found.stretch] == pytest.approx(expected, rel=0.03)
    whole = cramer_rao_bound(shape, noise=0.01, blur_px=BLUR, contrast=0.9)
    assert found.y_px > 1.1 * whole.y_px


@pytest.mark.parametrize("motion_px", [(0.0, 0.0), (1.0, 3.0)])
def test_a_picture_that_nothing_hides_is_as_none(motion_px):
    shape = EllipseShape(70.1, 68.3, 40.0, 1.2)
    one = cramer_rao_bound(shape, noise=0.01, visible=0.6, motion_px=motion_px, counts=np.ones((SIDE, SIDE)))
    other = cramer_rao_bound(shape, noise=0.01, visible=0.6, motion_px=motion_px)
    assert one.covariance == pytest.approx(other.covariance, rel=1e-9)
    with pytest.raises(np.linalg.LinAlgError):
        cramer_rao_bound(shape, noise=0.01, motion_px=motion_px, counts=np.zeros((SIDE, SIDE)))
