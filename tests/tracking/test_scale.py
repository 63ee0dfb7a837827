from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.tracking.scale import (
    NO_RADIUS,
    PixelMap,
    PooledRadius,
    merge_media,
    pixel_to_metre,
    pool_radius,
    scale_from_radius,
)

AIR, WATER = 4400.0, 4620.0
PIXELS = PixelMap(AIR, WATER, surface_y_px=200.0, axis_x_px=511.5, axis_y_px=200.0 + 0.06 * AIR)


def seen(x_m: float, y_m: float, pixels: PixelMap) -> tuple[float, float]:
    """Where a camera in air sees a point: magnified about the axis, more so below the surface."""
    scale = pixels.scale_air_px_m if y_m >= 0 else pixels.scale_water_px_m
    axis_height = (pixels.surface_y_px - pixels.axis_y_px) / pixels.scale_air_px_m
    return pixels.axis_x_px + scale * x_m, pixels.axis_y_px - scale * (y_m - axis_height)


@given(x=st.floats(-0.05, 0.05), y=st.floats(-0.2, 0.2), roll_deg=st.floats(-6.0, 6.0), column=st.floats(0.0, 1023.0))
def test_a_rolled_camera_is_levelled(x: float, y: float, roll_deg: float, column: float) -> None:
    """Turned about its axis it sees the surface fall by that angle; any point of the surface may be named."""
    level = np.array(seen(x, y, PIXELS))
    if y < 0 and level[1] <= PIXELS.surface_y_px:
        return
    middle, roll = np.array([PIXELS.axis_x_px, PIXELS.axis_y_px]), math.radians(roll_deg)
    turn = np.array([[math.cos(roll), -math.sin(roll)], [math.sin(roll), math.cos(roll)]])
    turned = middle + turn @ (level - middle)
    at = middle + turn @ (np.array([column, PIXELS.surface_y_px]) - middle)
    rolled = replace(PIXELS, surface_x_px=float(at[0]), surface_y_px=float(at[1]), roll_rad=roll)
    back_x, back_y = pixel_to_metre(*turned, rolled, np.asarray(y < 0))
    assert (float(back_x), float(back_y)) == pytest.approx((x, y), abs=1e-12)


@given(x=st.floats(-0.1, 0.1), y=st.floats(-0.2, 0.2))
def test_the_map_undoes_the_camera_on_both_sides_of_the_surface(x: float, y: float) -> None:
    column, row = seen(x, y, PIXELS)
    if y < 0 and row <= PIXELS.surface_y_px:  # hidden behind the picture of the air
        return
    back_x, back_y = pixel_to_metre(column, row, PIXELS)
    assert float(back_x) == pytest.approx(x, abs=1e-12)
    assert float(back_y) == pytest.approx(y, abs=1e-12)


def test_the_jump_at_the_waterline() -> None:
    above = float(pixel_to_metre(0.0, 200.0, PIXELS)[1])
    below = float(pixel_to_metre(0.0, 200.0 + 1e-9, PIXELS)[1])
    assert above == 0.0
    assert below == pytest.approx(-0.06 * AIR * (1 / AIR - 1 / WATER))
    assert seen(0.0, -1e-12, PIXELS)[1] - 200.0 == pytest.approx(-0.06 * (WATER - AIR))


def test_equal_scales_make_one_straight_map() -> None:
    rows = np.linspace(0, 1000, 11)
    height = pixel_to_metre(0.0, rows, PixelMap(1000.0, 1000.0, 300.0, 0.0, 512.0))[1]
    assert height == pytest.approx((300.0 - rows) / 1000.0)


def test_pooling_ignores_outliers_and_states_the_scatter() -> None:
    rng = np.random.default_rng(1)
    radius = 60.0 + 0.01 * rng.normal(size=40)
    radius[::10] += 2.0
    pooled = pool_radius(radius, np.full(40, 0.01))
    assert pooled.value == pytest.approx(60.0, abs=4 * pooled.unc)
    assert pooled.unc == pytest.approx(0.01 / 6, rel=0.4)
    slow = pool_radius(radius, np.full(40, 0.01), correlated_over=8)
    assert slow.unc > 2 * pooled.unc


def test_pooling_nothing_is_unknown() -> None:
    assert not pool_radius([math.nan], [0.1]).known
    assert not pool_radius([], []).known


def test_media_are_one_unless_a_wall_magnifies() -> None:
    air = PooledRadius(60.0, 0.002, 10, 0.01)
    one, two = merge_media(air, PooledRadius(60.01, 0.01, 10, 0.05))
    assert one == two
    assert one.value == pytest.approx(60.0, abs=0.002)
    wall = PooledRadius(63.0, 0.01, 10, 0.05)
    assert merge_media(air, wall) == (air, wall)
    assert merge_media(air, NO_RADIUS) == (air, NO_RADIUS)


def test_a_doubtful_water_is_not_merged_when_it_is_far() -> None:
    air, doubtful = PooledRadius(60.0, 0.002, 10, 0.01), PooledRadius(62.4, 1.0, 3, 2.0)
    assert merge_media(air, doubtful) == (air, doubtful)


def test_scale_carries_radius_and_diameter() -> None:
    scale, unc = scale_from_radius(PooledRadius(50.0, 0.05, 5, 0.1), 0.05, 0.0001)
    assert scale == 2000.0
    assert unc == pytest.approx(2000.0 * math.hypot(0.001, 0.002))
