"""Scales of the side view in px/m, from what the user gave and what the radii say, and the uncertainty of a height."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius, scale_from_radius

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)
CLIPPED_EDGE = 0.0045
CONTRADICTED, SLIGHT = 3.0, 0.003


@dataclass(frozen=True)
class Scales:
    """Scales in px/m with standard uncertainties, in air and through the water, and where they came from."""

    air: float
    air_unc: float
    water: float
    water_unc: float
    source: str


NO_SCALES = Scales(math.nan, math.nan, math.nan, math.nan, "unknown")


def given_radii(drop: Drop) -> tuple[PooledRadius, PooledRadius]:
    """Radii in px, in air and below the surface, from scales that the user gave; unknown where they are ``auto``."""
    view, sphere = drop.view("side"), drop.experiment.sphere

    def radius(scale: float | str) -> PooledRadius:
        if isinstance(scale, str):
            return NO_RADIUS
        unc = math.hypot(view.scale_px_per_m_unc / scale, sphere.diameter_m_unc / sphere.diameter_m)
        value = scale * sphere.radius_m
        return PooledRadius(value, value * unc, 0, 0.0)

    return radius(view.scale_pair.air), radius(view.scale_pair.water)


def warn_of_wrong_scale(drop: Drop, seen: PooledRadius) -> bool:
    """Warn where the scale that the user gave for air is not that of the sphere, whose radius was ``seen`` in air.

    Returns whether it is so: outlines are then not to be held at the radius that the scale gives.
    """
    sphere, view = drop.experiment.sphere, drop.view("side")
    given = view.scale_pair.air
    if given == "auto" or not seen.known:
        return False
    scale, unc = scale_from_radius(seen, sphere.diameter_m, sphere.diameter_m_unc)
    wrong = abs(float(given) - scale) > CONTRADICTED * math.hypot(unc, view.scale_px_per_m_unc) + SLIGHT * scale
    if wrong:
        key = "views.side.scale_px_per_m" + ("" if view.scale_pair.air == view.scale_pair.water else ".air")
        logger.warning(
            f"{drop.name}: {key} is {float(given):g}, but the sphere of {sphere.diameter_m * 1e3:g} mm measures "
            f"{scale:.6g} ± {unc:.2g} px/m in air: check the scale or sphere.diameter_m; heights and speeds go by the "
            "scale that was given",
            extra=puts_in_doubt("scale of the side view"),
        )
    return wrong


def find_scales(drop: Drop, air: PooledRadius, water: PooledRadius, ground: Background) -> Scales:
    """Scales from the radii: a number of the user wins, else the diameter, else the size below the surface.

    Where the light is clipped by the sensor the level of the edge is not known, and with it .45 % of the diameter.
    Nothing is seen through water where there is none: that scale is then the one in air, and is not spoken of.
    """
    sphere, pair = drop.experiment.sphere, drop.view("side").scale_pair
    clipped = CLIPPED_EDGE if math.isfinite(ground.ceiling) else 0.0
    seen_air = air if air.known else water
    seen_water = water if water.known else air
    values = []
    for given, radius in ((pair.air, seen_air), (pair.water, seen_water)):
        if given != "auto":
            values.append((float(given), drop.view("side").scale_px_per_m_unc))
            continue
        scale, unc = scale_from_radius(radius, sphere.diameter_m, sphere.diameter_m_unc)
        values.append((scale, math.hypot(unc, clipped * scale)))
    air_source = "given" if pair.air != "auto" else ("diameter" if air.known else "wet_ellipse")
    wet_source = "given" if pair.water != "auto" else ("wet_ellipse" if water.known else "diameter")
    if drop.experiment.kind != "water_entry":
        return Scales(*values[0], *values[0], air_source)
    return Scales(*values[0], *values[1], f"air {air_source}, water {wet_source}")


def with_clipped_edge(surface: SurfaceRow, radius: PooledRadius, ground: Background) -> SurfaceRow:
    """The row of y = 0, less certain by what a sensor that clips the light leaves unknown of the edge of the sphere.

    An outline that is too small in all frames has its lowest point too high in all of them: heights and the moment of
    impact come out as if the row of the surface were wrong by as much.
    """
    if not (math.isfinite(ground.ceiling) and radius.known):
        return surface
    return replace(surface, unc_px=math.hypot(surface.unc_px, CLIPPED_EDGE * radius.value))


def height_unc(
    bottom: tuple[NDArray[np.float64], NDArray[np.float64]],
    scales: Scales,
    surface: tuple[float, float],
    axis: tuple[float, float],
    wet: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Uncertainty of a height in m: row, surface, scales and optical axis (see ``pixel_to_metre``).

    ``bottom``, ``surface`` and ``axis`` are rows and their uncertainties, px, ``wet`` as there. The row of the surface
    is seen in air and moves all heights alike, in both media; a wrong axis those below the surface.
    A scale that both media share stretches the distance from the surface; two scales stretch those from the axis.
    """
    row = bottom[0]
    wet = row > surface[0] if wet is None else wet
    scale = np.where(wet, scales.water, scales.air)
    by_air, by_water = scales.air_unc / scales.air**2, scales.water_unc / scales.water**2
    by_scale = (row - surface[0]) * by_air
    if (scales.air, scales.air_unc) != (scales.water, scales.water_unc):
        through_wall = np.hypot((surface[0] - axis[0]) * by_air, (row - axis[0]) * by_water)
        by_scale = np.where(wet, through_wall, by_scale)
    by_surface = surface[1] / scales.air
    by_axis = np.where(wet, axis[1] * axis_effect(scales.air, scales.water), 0.0)
    return np.asarray(np.sqrt((bottom[1] / scale) ** 2 + by_surface**2 + by_scale**2 + by_axis**2))


def axis_effect(scale_air: float, scale_water: float) -> float:
    """By how many m an optical axis that is wrong by a pixel shifts the heights below the surface (0 if unknown)."""
    effect = abs(1.0 / scale_air - 1.0 / scale_water)
    return effect if math.isfinite(effect) else 0.0
