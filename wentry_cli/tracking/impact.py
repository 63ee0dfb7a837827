"""The moment of impact below one frame: the path of the bottom before contact, followed to the surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wentry_cli.compiled import compiled

FEWEST_FRAMES = 3


@dataclass(frozen=True)
class Impact:
    """First contact: time and its uncertainty in s, speed in px/s downwards, rms residual of the path in px.

    ``status`` is ok, ``too_few`` (no path to extrapolate; NaN), ``no_object`` (the path never meets the surface)
    or ``clip_ended`` (it does so ``beyond_s`` after the last frame). ``time_random_s`` is what the uncertainty of the
    time would be if the surface were known.
    """

    time_s: float
    time_unc_s: float
    speed_px_s: float
    speed_unc_px_s: float
    residual_px: float
    status: str
    beyond_s: float = math.nan
    time_random_s: float = math.nan


def find_impact(
    time_s: ArrayLike, bottom_px: ArrayLike, unc_px: ArrayLike, surface_px: tuple[float, float], fall_px_s2: float
) -> Impact:
    """Follow the falling bottom to the row of the surface.

    The bottom ``y(t) = y_0 + v t + ½ g t²`` (px, down) is fitted by weighted least squares for ``y_0`` and ``v`` with
    ``g`` given as ``fall_px_s2`` (the drag of the air over the few frames seen is below 2 % of it) to the frames
    before contact (arrays of equal length in s and px); ``surface_px`` is the row of the surface and its standard
    uncertainty. Time zero of the fit is in the middle of the frames, so that both unknowns are nearly uncorrelated.
    """
    time, bottom, unc = (np.asarray(item, np.float64) for item in (time_s, bottom_px, unc_px))
    good = np.isfinite(bottom) & np.isfinite(unc) & (unc > 0)
    time, bottom, unc = time[good], bottom[good], unc[good]
    if time.size < FEWEST_FRAMES:
        return Impact(math.nan, math.nan, math.nan, math.nan, math.nan, "too_few")
    start = float(np.mean(time))
    design = np.stack([np.ones_like(time), time - start], axis=1)
    target = bottom - 0.5 * fall_px_s2 * (time - start) ** 2
    solution, covariance, residual = weighted_line(design, target, unc)
    height, speed = float(solution[0]), float(solution[1])
    inside = speed**2 + 2.0 * fall_px_s2 * (surface_px[0] - height)
    if inside <= 0.0:
        return Impact(math.nan, math.nan, speed, math.sqrt(covariance[1, 1]), residual, "no_object")
    at_surface = math.sqrt(inside)
    later = 2.0 * (surface_px[0] - height) / (speed + at_surface)
    slope = np.array([-1.0, -later]) / at_surface
    by_frames = math.sqrt(float(slope @ covariance @ slope))
    time_unc, speed_unc = math.hypot(by_frames, surface_px[1] / at_surface), math.sqrt(covariance[1, 1])
    return Impact(start + later, time_unc, at_surface, speed_unc, residual, "ok", time_random_s=by_frames)


def weighted_line(
    design: NDArray[np.float64], target: NDArray[np.float64], unc: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Weighted least squares: solution, covariance (scaled up where the residuals exceed ``unc``), rms residual."""
    weighted = design / unc[:, None]
    normal = np.linalg.inv(weighted.T @ weighted)
    solution = normal @ (weighted.T @ (target / unc))
    left = (target - design @ solution) / unc
    freedom = max(1, target.size - design.shape[1])
    excess = max(1.0, float(left @ left) / freedom)
    residual = math.sqrt(float(np.mean((target - design @ solution) ** 2)))
    return solution, normal * excess, residual


def back_to_surface(time_s: ArrayLike, row_px: ArrayLike, surface_px: tuple[float, float]) -> tuple[float, float]:
    """Estimate the impact of a clip that starts after it: a parabola through the first wet frames, followed back.

    ``row_px`` is the row of the centre plus the undeformed radius, which meets the surface at impact and slows down
    more evenly than the lowest point does. Half of what the parabola changes against a line is its uncertainty. NaN
    where fewer than six frames are known.
    """
    time, row = np.asarray(time_s, np.float64), np.asarray(row_px, np.float64)
    good = np.isfinite(row)
    time, row = time[good][:12], row[good][:12]
    if time.size < 6:
        return math.nan, math.nan
    bend, speed, height = np.polyfit(time - time[0], row - surface_px[0], 2)
    line_speed, line_height = np.polyfit(time - time[0], row - surface_px[0], 1)
    inside = speed**2 - 4.0 * bend * height
    if speed <= 0 or line_speed <= 0 or inside < 0:
        return math.nan, math.nan
    back = 2.0 * height / (speed + math.sqrt(inside))
    doubt = 0.5 * abs(back - line_height / line_speed)
    return float(time[0] - back), math.hypot(doubt, surface_px[1] / speed)


@compiled
def _hinge_residual(time: NDArray[np.float64], values: NDArray[np.float64], hinge: float) -> tuple[float, float]:
    # values = a + b (t - hinge)^1.5 for t > hinge: a stretch that starts smoothly, with a the level before
    count = time.size
    s1 = sb = sbb = sy = sby = 0.0
    for index in range(count):
        rise = max(time[index] - hinge, 0.0) ** 1.5
        s1 += 1.0
        sb += rise
        sbb += rise * rise
        sy += values[index]
        sby += rise * values[index]
    determinant = s1 * sbb - sb * sb
    if determinant <= 1e-30:
        return np.inf, 0.0
    slope = (s1 * sby - sb * sy) / determinant
    level = (sy - slope * sb) / s1
    total = 0.0
    for index in range(count):
        rise = max(time[index] - hinge, 0.0) ** 1.5
        total += (values[index] - level - slope * rise) ** 2
    return total, slope
