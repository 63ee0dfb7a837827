from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.imaging.free_surface import find_free_surface, find_surfaces
from wentry_cli.imaging.plate import find_plate
from wentry_cli.imaging.surface_band import clear_of_band


def scene(centre: float, thickness: float, depth: float, slope: float = 0.0, noise: float = 0.002) -> np.ndarray:
    rng = np.random.default_rng(7)
    y, x = np.mgrid[:300, :240].astype(float)
    light = 150.0 + 0.1 * x - 0.05 * y
    edge = thickness / 2 - np.abs(y - centre - slope * (x - 120))
    band = np.clip(edge + 0.5, 0.0, 1.0)
    return (light * (1 - depth * band) * (1 + noise * rng.normal(size=y.shape))).astype(np.float32)


@given(centre=st.floats(40, 250), thickness=st.floats(2.0, 24.0), depth=st.floats(0.1, 0.8))
def test_the_centre_of_the_band(centre: float, thickness: float, depth: float) -> None:
    found = find_free_surface(scene(centre, thickness, depth))
    assert found.status == "ok"
    assert abs(found.y_px - centre) < min(max(0.05, 0.2 * thickness * 0.1 / depth), 3 * found.unc_px)
    assert found.thickness_px == pytest.approx(thickness, abs=2.0)


def test_a_sloping_surface_is_read_at_the_column_asked_for() -> None:
    found = find_free_surface(scene(100.0, 4.0, 0.5, slope=0.02), x_px=220.0)
    assert found.y_px == pytest.approx(102.0, abs=0.15)


@pytest.mark.parametrize("slope", [-0.09, -0.052, 0.035, 0.07])
def test_a_camera_that_is_not_level_sees_the_surface_all_the_same(slope: float) -> None:
    found = find_free_surface(scene(150.0, 3.0, 0.5, slope=slope), x_px=100.0)
    assert found.status == "ok"
    assert found.y_px == pytest.approx(150.0 - 20.0 * slope, abs=0.15)
    assert found.slant == pytest.approx(slope, abs=0.002)
    assert found.thickness_px < 4.5


def test_strips_that_show_something_else_do_not_tilt_the_surface() -> None:
    level = scene(100.0, 3.0, 0.5)
    level[:, 70:135] = np.roll(level[:, 70:135], 4, axis=0)  # 6 of 24 strips, on one side
    found = find_free_surface(level, x_px=120.0)
    assert abs(found.y_px - 100.0) < 3.0 * found.unc_px
    assert found.unc_px < 0.1


def test_an_uneven_band_is_less_certain_than_a_line() -> None:
    thick, thin = find_free_surface(scene(100.0, 20.0, 0.5)), find_free_surface(scene(100.0, 2.0, 0.5))
    assert thick.unc_px > 1.0
    assert thin.unc_px < 0.1


def test_nothing_like_a_surface() -> None:
    assert find_free_surface(scene(100.0, 3.0, 0.0)).status == "no_edge"
    assert find_free_surface(scene(100.0, 3.0, 0.5), rows=(150.0, 290.0)).status == "no_edge"


@pytest.mark.parametrize("edge", [150.0, 200.3, 260.75])
def test_the_upper_edge_of_a_plate(edge: float) -> None:
    y = np.arange(300.0)[:, None]
    dark = np.clip(y - edge + 0.5, 0.0, 1.0)
    level = (160.0 * (1 - 0.9 * dark) * np.ones((1, 200))).astype(np.float32)
    found = find_plate(level)
    assert found.status == "ok"
    assert found.y_px == pytest.approx(edge, abs=0.05)
    assert find_plate(np.full((100, 100), 150.0, np.float32)).status == "no_edge"


def test_the_reach_of_an_uneven_band_is_where_the_ground_is_clear() -> None:
    level = scene(100.0, 12.0, 0.7)
    level[:, 150:190] = np.roll(level[:, 150:190], 3, axis=0)
    found = find_free_surface(level, x_px=60.0)
    above, below = clear_of_band(level, found, (20.0, 120.0))
    assert above == pytest.approx(7.0, abs=1.0)
    assert below == pytest.approx(7.0, abs=1.0)
    _, lower = clear_of_band(level, found, (100.0, 220.0))
    assert lower == pytest.approx(10.0, abs=1.0)


def test_the_reach_of_a_band_beside_the_picture_is_half_its_thickness() -> None:
    level = scene(100.0, 12.0, 0.7)
    found = find_free_surface(level)
    assert clear_of_band(level, found, (-50.0, 2.0)) == (0.5 * found.thickness_px + 1.0,) * 2


@pytest.mark.parametrize("thickness", [30.0, 50.0])
def test_a_band_that_blurs_into_something_else_reaches_no_further_than_it_can(thickness: float) -> None:
    level = scene(100.0, thickness, 0.6)
    found = find_free_surface(level)
    level[100:180, 90:150] *= 0.2  # the remains of a cavity in the empty scene
    assert clear_of_band(level, found, (80.0, 160.0))[1] <= found.thickness_px + 6.0


def test_several_lines_are_told_the_darkest_first_and_a_band_is_one() -> None:
    level = scene(80.0, 2.0, 0.2)
    level *= scene(180.0, 14.0, 0.7, noise=0.0) / scene(180.0, 14.0, 0.0, noise=0.0)
    assert [row.y_px for row in find_surfaces(level)] == pytest.approx([180.0, 80.0], abs=0.3)
    assert len(find_surfaces(scene(100.0, 24.0, 0.8))) == 1


def test_a_dark_piece_of_a_row_is_no_second_line() -> None:
    level = scene(100.0, 3.0, 0.5)
    level[180:184, :170] *= 0.7
    assert len(find_surfaces(level)) == 1


@pytest.mark.parametrize(("border", "foot"), [(6, 6), (12, 12), (0, 8)])
def test_a_black_border_is_no_surface_and_hides_none(border: int, foot: int) -> None:
    level = scene(100.25, 3.0, 0.5)
    level[300 - foot :] = 0.4
    if border:
        level[:border], level[:, :border], level[:, -border:] = 0.4, 0.4, 0.4
    (found,) = find_surfaces(level, x_px=120.0)
    assert found.y_px == pytest.approx(100.25, abs=0.05)


@pytest.mark.parametrize("water", [1.0, 0.8, 0.45, 0.2])
@pytest.mark.parametrize("blur", [1, 5])
def test_water_that_is_darker_than_the_air_leaves_the_surface_in_doubt(water: float, blur: int) -> None:
    level = scene(100.3, 2.5, 0.6)
    level[np.arange(300) > 100] *= water
    level = cv2.GaussianBlur(level, (0, 0), 0.4 * blur)
    found = find_free_surface(level)
    assert abs(found.y_px - 100.3) < 2.5 * found.unc_px
    assert found.unc_px < (3.0 if water < 1.0 else 0.06 if blur == 1 else 1.2)
