"""How large a pixel is: radii pooled over frames, and the one change from pixels to metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

EDGE_MODEL_PX = 0.001
COMMON_MEDIUM = 0.004


@dataclass(frozen=True)
class PixelMap:
    """What the change from pixels to metres needs.

    Scales in px/m in air and of what is seen through the water, the row of the undisturbed surface, and where the
    optical axis meets the image. Of a camera that is rolled, the surface falls to the right by ``roll_rad`` and
    ``surface_y_px`` is its row at the column ``surface_x_px``.
    """

    scale_air_px_m: float
    scale_water_px_m: float
    surface_y_px: float
    axis_x_px: float
    axis_y_px: float
    surface_x_px: float = 0.0
    roll_rad: float = 0.0


def levelled(
    x_px: ArrayLike, y_px: ArrayLike, about: tuple[float, float], roll_rad: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Turn image positions to where a level camera would have them, about a point (x, y) of the surface.

    In the picture of a camera by which the surface falls to the right by r, the true vertical is (−sin r, cos r).
    """
    x, y = np.asarray(x_px, dtype=np.float64), np.asarray(y_px, dtype=np.float64)
    if not roll_rad:
        return x, y
    cos, sin = math.cos(roll_rad), math.sin(roll_rad)
    right, down = x - about[0], y - about[1]
    return about[0] + cos * right + sin * down, about[1] + cos * down - sin * right


def pixel_to_metre(
    x_px: ArrayLike, y_px: ArrayLike, pixels: PixelMap, wet: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Change image positions into metres in the plane of the sphere.

    x is to the right of the optical axis, y upwards from the undisturbed surface.

    A camera in air looks at right angles through a flat wall. Seen from it, what lies in air appears at the scale
    ``s_a``, and what lies in water nearer, at ``s_w > s_a``; both magnifications are about the optical axis, which
    meets the image at ``(x_0, y_0)`` and the plane of the sphere at the height ``Y_0``:

        air    y = y_0 − s_a (Y − Y_0),        water    y = y_0 − s_w (Y − Y_0).

    The undisturbed surface ``Y = 0`` is seen in air at the row ``y_s = y_0 + s_a Y_0``, hence
    ``Y_0 = (y_s − y_0) / s_a``, and

        air    Y = (y_s − y) / s_a,
        water  Y = (y_s − y_0) / s_a − (y − y_0) / s_w.

    The picture breaks at the waterline: from below, the surface would appear at ``y_0 + s_w Y_0``, that is
    ``(s_w − s_a) Y_0`` from the row ``y_s``. With an axis 60 mm below the surface and scales of 4.4 and 4.62 px/mm
    those are 13 px upwards, so a layer of 13 px just below the surface is hidden behind the air's picture, and the row
    ``y_s`` itself shows, in water, the depth ``(y_0 − y_s)(1/s_a − 1/s_w)``. ``wet`` says through which medium each
    row was seen; without it rows at or above ``y_s`` are taken as air, rows below as water. With equal scales both are
    ``(y_s − y) / s``. What a rolled camera saw is levelled first, and its axis with it.
    """
    about = pixels.surface_x_px, pixels.surface_y_px
    x, y = levelled(x_px, y_px, about, pixels.roll_rad)
    axis_x, axis_y = levelled(pixels.axis_x_px, pixels.axis_y_px, about, pixels.roll_rad)
    wet = y > pixels.surface_y_px if wet is None else wet
    air, water = pixels.scale_air_px_m, pixels.scale_water_px_m
    axis_height = (pixels.surface_y_px - axis_y) / air
    height = np.where(wet, axis_height - (y - axis_y) / water, (pixels.surface_y_px - y) / air)
    return (x - axis_x) / np.where(wet, water, air), height


@dataclass(frozen=True)
class PooledRadius:
    """A radius in pixels from many frames: value, standard uncertainty, number of frames, their scatter in px."""

    value: float
    unc: float
    count: int
    scatter: float

    @property
    def known(self) -> bool:
        """Whether any frame gave a radius."""
        return math.isfinite(self.value)


NO_RADIUS = PooledRadius(math.nan, math.nan, 0, math.nan)


def pool_radius(radius_px: ArrayLike, unc_px: ArrayLike, *, correlated_over: int = 1) -> PooledRadius:
    """Pool the radii of single frames: weighted mean without outliers.

    Frames further than 4 scaled median deviations from the median are left out. The uncertainty is that of the
    weights or that of the scatter, whichever is larger; a scatter that is slow in time (a shape that is no ellipse
    oscillates with the sphere) counts as one independent value per ``correlated_over`` frames. What the model of an
    edge leaves out, a thousandth of a pixel, no number of frames averages away.
    """
    radius, unc = np.asarray(radius_px, np.float64), np.asarray(unc_px, np.float64)
    good = np.isfinite(radius) & np.isfinite(unc) & (unc > 0)
    radius, unc = radius[good], unc[good]
    if radius.size == 0:
        return NO_RADIUS
    middle = float(np.median(radius))
    spread = 1.4826 * float(np.median(np.abs(radius - middle)))
    kept = np.abs(radius - middle) <= 4.0 * np.maximum(spread, unc)
    radius, unc = radius[kept], np.maximum(unc[kept], 0.5 * spread)
    weight = 1.0 / unc**2
    value = float(np.sum(weight * radius) / np.sum(weight))
    scatter = math.sqrt(float(np.sum(weight * (radius - value) ** 2) / np.sum(weight)))
    independent = max(1.0, radius.size / correlated_over)
    by_chance = max(1.0 / math.sqrt(float(np.sum(weight))), scatter / math.sqrt(independent))
    return PooledRadius(value, math.hypot(by_chance, EDGE_MODEL_PX), int(radius.size), scatter)


def merge_media(air: PooledRadius, water: PooledRadius) -> tuple[PooledRadius, PooledRadius]:
    """Decide whether air and water have one scale or two.

    A flat wall before water magnifies by 3–8 %. A ratio within 0.4 % of one (or three standard deviations, if that
    is more, up to 2 %) means that there is no such wall, and both media share the pooled radius. Otherwise, or where
    only one is known, the two are returned as they are.
    """
    if not (air.known and water.known):
        return air, water
    ratio = water.value / air.value
    doubt = 3.0 * math.hypot(air.unc / air.value, water.unc / water.value)
    if abs(ratio - 1.0) > min(max(COMMON_MEDIUM, doubt), 0.02):
        return air, water
    unc = np.array([air.unc, water.unc])
    weight = 1.0 / unc**2
    value = float(np.sum(weight * np.array([air.value, water.value])) / np.sum(weight))
    pull = abs(air.value - water.value) / math.hypot(air.unc, water.unc)
    common = max(1.0, pull) / math.sqrt(float(np.sum(weight)))
    both = PooledRadius(value, common, air.count + water.count, max(air.scatter, water.scatter))
    return both, both


def scale_from_radius(radius: PooledRadius, diameter_m: float, diameter_unc_m: float = 0.0) -> tuple[float, float]:
    """Scale in px/m and its standard uncertainty from a radius in pixels and the known diameter."""
    scale = 2.0 * radius.value / diameter_m
    return scale, scale * math.hypot(radius.unc / radius.value, diameter_unc_m / diameter_m)
