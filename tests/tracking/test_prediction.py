from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.tracking.prediction import Path, lagrange_weights


def shape(frame: float) -> EllipseShape:
    return EllipseShape(100 + 0.3 * frame, 50 + 7 * frame - 0.02 * frame**2, 60.0, 1.1 - 0.01 * frame)


@given(at=st.lists(st.integers(-30, 30), min_size=3, max_size=3, unique=True), frame=st.integers(-40, 40))
def test_the_weights_reproduce_a_parabola(at: list[int], frame: int) -> None:
    points = np.array(at, float)
    weights = np.array(lagrange_weights(points.tolist(), float(frame)))
    assert weights @ (2 - 3 * points + 0.5 * points**2) == pytest.approx(2 - 3 * frame + 0.5 * frame**2, abs=1e-6)


@pytest.mark.parametrize("step", [1, -1])
def test_a_path_goes_on_in_both_directions_of_time(step: int) -> None:
    path = Path(60.0)
    for k in range(5):
        path.add(10 + step * k, shape(10 + step * k))
    expected = path.predict(10 + 5 * step)
    assert expected.y == pytest.approx(shape(10 + 5 * step).y, abs=3e-3)
    assert expected.stretch == pytest.approx(shape(10 + 5 * step).stretch)
    assert path.velocity()[0] == pytest.approx(0.3)


def test_a_long_gap_is_bridged_by_a_line_with_the_last_stretch() -> None:
    path = Path(60.0)
    for k in range(4):
        path.add(k, shape(k))
    assert path.predict(13).stretch == shape(3).stretch
    assert path.predict(13).y == pytest.approx(shape(3).y + 10 * (shape(3).y - shape(2).y))


def test_shapes_fitted_with_another_radius_go_on_where_they_are_seen() -> None:
    path = Path(60.0)
    for k in range(3):
        seen = shape(k)
        if k == 1:
            seen = EllipseShape(seen.x, seen.y, 63.0, seen.semi_across / 63.0)
            seen = EllipseShape(seen.x, seen.y + shape(k).bottom_y - seen.bottom_y, 63.0, seen.stretch)
        path.add(k, seen)
    expected = path.predict(3)
    assert expected.bottom_y == pytest.approx(shape(3).bottom_y, abs=0.01)
    assert expected.stretch == pytest.approx(shape(3).stretch, abs=1e-3)


def test_a_frame_that_is_seen_again_replaces_itself() -> None:
    path = Path(60.0, [0, 1], [shape(0), shape(1)])
    path.add(0, shape(0))
    assert path.frames == [1, 0]
    assert path.predict(2).bottom_y == pytest.approx(2 * shape(1).bottom_y - shape(0).bottom_y)


def test_a_stiff_sphere_stays_round() -> None:
    path = Path(60.0, [0, 1], [shape(0), shape(1)], stiff=True)
    assert path.predict(2).stretch == 1.0
    assert path.turned().stiff
    assert path.turned().frames == [1, 0]
