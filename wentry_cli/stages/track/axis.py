"""Where the optical axis meets the side view, how well that is known, and whether the path of the sphere agrees."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.stages.track.scales import Scales

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)

UNKNOWN_PX = 50.0  # a lens shifted on its mount, a camera that is not level
GIVEN_PX = 5.0
STRONGEST_SLAM = 1.5  # force coefficient at impact; the most that stops a sphere within the frames looked at
LOOKED_AT, FEWEST = 5, 3


@dataclass(frozen=True)
class OpticalAxis:
    """Row at which the optical axis meets the picture and its standard uncertainty, px."""

    y_px: float
    unc_px: float


NO_AXIS = OpticalAxis(math.nan, math.nan)


def assumed_axis(drop: Drop, middle_px: tuple[float, float]) -> OpticalAxis:
    """The axis as given, else in the middle of the camera's image."""
    given = drop.view("side").optical_axis_y_px
    return OpticalAxis(middle_px[1], UNKNOWN_PX) if given == "auto" else OpticalAxis(float(given), GIVEN_PX)


def checked_axis(
    drop: Drop,
    axis: OpticalAxis,
    scales: Scales,
    t_s: NDArray[np.float64],
    centre_m: NDArray[np.float64],
) -> OpticalAxis:
    """The axis, less certain (and a warning) where the path breaks at the waterline by more than it explains.

    What is seen through the water is magnified about the axis, so that an axis wrong by ``d`` px shifts all heights
    below the surface by ``d (1/s_a − 1/s_w)``. The centre of the sphere (``centre_m``, heights at ``t_s``) does not
    jump: below the fall without water it can only stay behind, and by no more than a slam of ``STRONGEST_SLAM``.
    """
    per_px = 1.0 / scales.air - 1.0 / scales.water
    jump = _jump(drop, t_s, centre_m)
    if not (math.isfinite(jump) and abs(jump) > 3.0 * axis.unc_px * abs(per_px) > 0.0):
        return axis
    row = axis.y_px + jump / per_px
    logger.warning(
        f"{drop.name}: the path jumps by {jump * 1e3:+.1f} mm at the waterline, as if the optical axis met the picture "
        f"near row {row:.0f}, not at {axis.y_px:.0f}; measure views.side.optical_axis_y_px, heights below the surface "
        "have wide error bars until then",
        extra=puts_in_doubt("optical axis"),
    )
    return replace(axis, unc_px=abs(jump / per_px))


def _jump(drop: Drop, t_s: NDArray[np.float64], centre_m: NDArray[np.float64]) -> float:
    """Median of how far the first centres below the surface lie outside of what a sphere can do, m; NaN if unseen."""
    known = np.isfinite(t_s) & np.isfinite(centre_m)
    before, after = np.flatnonzero(known & (t_s < 0.0)), np.flatnonzero(known & (t_s > 0.0))[:LOOKED_AT]
    if len(before) < FEWEST or len(after) < FEWEST:
        return math.nan
    fall = -0.5 * drop.experiment.gravity_m_s2 * t_s**2
    slope, at_impact = np.polyfit(t_s[before], (centre_m - fall)[before], 1)
    late = t_s[after]
    behind = centre_m[after] - (at_impact + slope * late + fall[after])
    density = (drop.experiment.sphere.density or 0.0) / drop.experiment.liquid.density_kg_m3
    slam = 0.375 * STRONGEST_SLAM / max(density, 0.5) * slope**2 / drop.experiment.sphere.radius_m
    most = 0.5 * slam * late**2
    return float(np.median(np.where(behind > 0.0, np.maximum(behind - most, 0.0), behind)))
