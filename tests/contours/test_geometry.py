"""The ellipse, its sectors and the distances of pixels from it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wentry_cli.contours.arc import LENGTH, NX, NY, J, X, Y, arc_geometry, quadrant_table, sector_angles, sector_at
from wentry_cli.contours.band import collect_band, ellipse_distance
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.outline_fit import bottom_gradient

shapes = st.builds(
    EllipseShape,
    x=st.floats(-5, 5),
    y=st.floats(-5, 5),
    radius=st.floats(20, 130),
    stretch=st.floats(0.75, 1.7),
    tilt_deg=st.floats(-20, 20),
)


def sectors(shape):
    count, table = quadrant_table(shape.semi_across, shape.semi_along, 6.0, 0.2)
    return count, table, arc_geometry(shape.vector(), sector_angles(count, table))


@given(shape=shapes)
def test_volume_is_that_of_the_sphere(shape):
    assert shape.semi_across**2 * shape.semi_along == pytest.approx(shape.radius**3, rel=1e-12)


@given(shape=shapes)
def test_gradient_of_the_bottom(shape):
    vector = shape.vector()
    steps = []
    for i in range(5):
        ends = []
        for sign in (1.0, -1.0):
            moved = vector.copy()
            moved[i] += sign * 1e-5
            ends.append(EllipseShape(*moved[:4], math.degrees(moved[4])).bottom_y)
        steps.append((ends[0] - ends[1]) / 2e-5)
    assert bottom_gradient(shape.radius, shape.stretch, math.radians(shape.tilt_deg)) == pytest.approx(
        np.array(steps), abs=1e-4
    )


@given(shape=shapes)
@settings(max_examples=40)
def test_jacobian_of_the_sectors(shape):
    """A small step of a parameter moves the outline by J along the normal: the moved point lies on the new ellipse."""
    _, _, rows = sectors(shape)
    vector = shape.vector()
    for i, step in enumerate((1e-4, 1e-4, 1e-4, 1e-6, 1e-6)):
        moved = vector.copy()
        moved[i] += step
        x = rows[:, X] + rows[:, J + i] * step * rows[:, NX] - moved[0]
        y = rows[:, Y] + rows[:, J + i] * step * rows[:, NY] - moved[1]
        c, s = math.cos(moved[4]), math.sin(moved[4])
        u, v = x * c - y * s, x * s + y * c
        a, b = moved[2] * moved[3], moved[2] / moved[3] ** 2
        assert np.max(np.abs((u / a) ** 2 + (v / b) ** 2 - 1.0)) < 1e-7
    assert rows[:, LENGTH].sum() == pytest.approx(perimeter(shape), rel=0.01)


def perimeter(shape):
    phi = np.linspace(0, 2 * np.pi, 4001)
    return np.hypot(np.diff(shape.semi_across * np.cos(phi)), np.diff(shape.semi_along * np.sin(phi))).sum()


@given(shape=shapes, angle=st.floats(0, 2 * math.pi), off=st.floats(-3, 4))
def test_distance_of_a_point_from_the_ellipse(shape, angle, off):
    a, b = shape.semi_across, shape.semi_along
    speed = math.hypot(a * math.sin(angle), b * math.cos(angle))
    if off < -0.3 * speed**3 / (a * b):
        return
    u = a * math.cos(angle) + off * b * math.cos(angle) / speed
    v = b * math.sin(angle) + off * a * math.sin(angle) / speed
    distance, _, _ = ellipse_distance(a, b, u, v)
    assert distance == pytest.approx(off, abs=0.02)


def test_the_band_holds_each_pixel_once_and_no_other():
    shape = EllipseShape(45.3, 40.8, 30.0, 1.15, 7.0)
    count, table, _ = sectors(shape)
    values = np.arange(90 * 100, dtype=np.float32).reshape(90, 100)
    values[40, 5:40] = math.nan
    pixels, starts, places = collect_band(values, shape.vector(), count, table, np.array([4.0, 4.0, 20.0, math.nan]))
    rows = pixels[1].astype(int) // 100
    assert len(set(pixels[1])) == pixels.shape[1] == starts[-1]
    assert rows.min() >= 20
    assert np.array_equal(pixels[1], values.reshape(-1)[places])
    c, s = math.cos(math.radians(7.0)), math.sin(math.radians(7.0))
    expected = 0
    for row in range(20, 90):
        for column in range(100):
            x, y = column - shape.x, row - shape.y
            d, _, _ = ellipse_distance(shape.semi_across, shape.semi_along, x * c - y * s, x * s + y * c)
            expected += abs(d) < 3.9 and not math.isnan(values[row, column])
    inside = np.abs(pixels[0]) < 3.9
    assert inside.sum() == expected


@given(shape=shapes)
def test_sectors_know_their_own_directions(shape):
    count, table, _ = sectors(shape)
    for k, phi in enumerate(sector_angles(count, table)):
        cosine, sine = math.cos(phi), math.sin(phi)
        share = abs(sine) / (abs(cosine) + abs(sine))
        assert sector_at(share, cosine >= 0.0, sine >= 0.0, count, table) == k
