"""How deep the sphere of a top view is, how far its camera, and when it touches, as far as the views can tell."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wentry_cli.tracking.impact import weighted_line

Floats = NDArray[np.float64]

GRAVITY = 9.81
# Least and greatest force coefficient of an entering sphere, over 1/2 rho U^2 pi R^2.
FORCES = (0.2, 2.5)
# Nothing is known of a camera but that it stands a metre or more above the water: 1/distance is uniform up to 1 / m.
UNKNOWN_INVERSE, UNKNOWN_INVERSE_UNC = 0.5, 0.5 / math.sqrt(3.0)
FEWEST_FRAMES = 4
LONGEST_STEP, UNSURE = 3.5, 0.3  # frames; share of what a gap bends
RISES = (1.5, 2.0)
TRIALS_PER_FRAME = 10
EARLY_SHARE = 0.67


@dataclass(frozen=True)
class Height:
    """Height of the sphere's greatest circle above the surface and its standard uncertainty, m, a value per frame.

    ``zero_unc_m`` is that of the surface from which all are counted, which moves them alike.
    """

    value_m: Floats
    unc_m: Floats
    zero_unc_m: float = 0.0


@dataclass(frozen=True)
class TopCamera:
    """One over the distance of the camera from the surface, 1/m, with its standard uncertainty and origin.

    ``source`` is given, ``views`` (from how the size of the sphere changes with its height) or unknown.
    """

    inverse_1_m: float
    unc_1_m: float
    source: str

    @property
    def distance_m(self) -> float:
        """Distance of the camera from the surface; infinite where the size does not change with the height."""
        return 1.0 / self.inverse_1_m if self.inverse_1_m > 0 else math.inf


UNKNOWN_CAMERA = TopCamera(UNKNOWN_INVERSE, UNKNOWN_INVERSE_UNC, "unknown")


def fall_height(t_s: ArrayLike, speed: tuple[float, float], radius_m: float, *, impact_unc_s: float = 0.0) -> Height:
    """Height of the centre at ``t_s`` (s after impact) where no side view shows it.

    ``speed`` is that of impact and its standard uncertainty, m/s. Before impact the sphere falls freely. Afterwards it
    is slowed by a constant force coefficient C between 0.2 (rigid) and 2.5 (soft, at its widest) and is about as dense
    as water: its depth is U tau ln(1 + t/tau), tau = 8 R / (3 C U). The middle of the range is taken, and the range as
    that of a uniform distribution; ``impact_unc_s`` is that of the zero of time.
    """
    t = np.asarray(t_s, np.float64)
    fast, unc = speed
    free = fast * t + 0.5 * GRAVITY * t**2
    wet = np.maximum(t, 0.0)
    slowing = [8.0 * radius_m / (3.0 * force * fast) for force in FORCES]
    deep, shallow = (np.where(t > 0, fast * tau * np.log1p(wet / tau), free) for tau in slowing)
    depth = 0.5 * (deep + shallow)
    spread = (deep - shallow) / math.sqrt(12.0)
    return Height(radius_m - depth, np.hypot(spread, unc * t), fast * impact_unc_s)


def between_frames(t_s: Floats, seen: Height, when_s: Floats) -> tuple[Height, NDArray[np.bool_]]:
    """Height at ``when_s`` from that in the frames at ``t_s`` (s, rising), and where no frame was near.

    Lines from frame to frame; over a gap the cubic with the speeds at its ends, of which a part of what it differs
    from the line is uncertain.
    """
    value = np.interp(when_s, t_s, seen.value_m)
    unc = np.interp(when_s, t_s, seen.unc_m)
    if t_s.size < 3:
        return Height(value, unc, seen.zero_unc_m), np.zeros(when_s.shape, dtype=bool)
    step = np.diff(t_s)
    wide = step > LONGEST_STEP * float(np.median(step))
    chord = np.diff(seen.value_m) / step
    before, after = np.append(chord[0], chord), np.append(chord, chord[-1])
    lost_before, lost_after = np.append(False, wide), np.append(wide, False)
    slope = np.where(lost_before == lost_after, 0.5 * (before + after), np.where(lost_before, after, before))
    k = np.clip(np.searchsorted(t_s, when_s, side="right") - 1, 0, t_s.size - 2)
    gap = wide[k] & (when_s > t_s[k]) & (when_s < t_s[k + 1])
    s = np.clip((when_s - t_s[k]) / step[k], 0.0, 1.0)
    bend = s * (1.0 - s) * step[k] * ((1.0 - s) * (slope[k] - chord[k]) - s * (slope[k + 1] - chord[k]))
    unc = np.hypot(unc, np.where(gap, UNSURE * np.abs(bend), 0.0))
    return Height(value + np.where(gap, bend, 0.0), unc, seen.zero_unc_m), gap


def find_camera(height: Height, size_ratio: ArrayLike, ratio_unc: ArrayLike, *, scale_known: bool) -> TopCamera:
    """Distance of the camera from how the image shrinks with the depth of the sphere.

    ``size_ratio`` is the radius that the undistorted sphere would show in the plane of the surface over that which it
    shows, known stretch included: a (1 - h/Z), with a = 1 where the scale is known. Weighted least squares over the
    frames with a value; unknown where these are fewer than four or do not tell the distance to a third.
    """
    ratio, unc = np.asarray(size_ratio, np.float64), np.asarray(ratio_unc, np.float64)
    good = np.isfinite(ratio) & np.isfinite(unc) & np.isfinite(height.value_m)
    if np.count_nonzero(good) < FEWEST_FRAMES:
        return UNKNOWN_CAMERA
    h, target, sigma = height.value_m[good], ratio[good], np.maximum(unc[good], 1e-6)
    if scale_known:
        solution, covariance, _ = weighted_line(-h[:, None], target - 1.0, sigma)
        inverse, variance = float(solution[0]), float(covariance[0, 0])
    else:
        solution, covariance, _ = weighted_line(np.stack([np.ones_like(h), -h], axis=1), target, sigma)
        inverse = float(solution[1] / solution[0])
        slope = np.array([-inverse, 1.0]) / float(solution[0])
        variance = float(slope @ covariance @ slope)
    found = TopCamera(inverse, math.sqrt(variance), "views")
    if not 3.0 * found.unc_1_m < max(inverse, UNKNOWN_INVERSE):
        return UNKNOWN_CAMERA
    return found


@dataclass(frozen=True)
class Approach:
    """Impact speed, m/s, and the instant at which the sphere has the size of first contact, s, with uncertainties.

    The instant counts from the zero of the times that were given; NaN without a scale.
    """

    speed_m_s: float
    speed_unc_m_s: float
    contact_s: float
    contact_unc_s: float


NO_APPROACH = Approach(math.nan, math.nan, math.nan, math.nan)


def find_approach(
    time_s: ArrayLike,
    radius_px: ArrayLike,
    unc_px: ArrayLike,
    radius_m: float,
    distance_m: float,
    scale: tuple[float, float] = (math.nan, math.nan),
) -> Approach:
    """What the shrinking image of the undeformed sphere tells where the distance of the camera is known.

    ``time_s`` counts from about impact; one over the radius (px) is proportional to Z - h, h = R - U t - g t^2 / 2.
    ``scale`` is px/m in the plane of the surface and its relative uncertainty, that of the sphere's diameter included.
    At first contact the centre is one radius above the surface. The outline of a sphere is not quite its greatest
    circle, by (R/Z)^2 / 2, which goes into the uncertainty. Nothing where fewer than four frames before impact are
    known.
    """
    time, radius, unc = (np.asarray(item, np.float64) for item in (time_s, radius_px, unc_px))
    before = (time < 0) & np.isfinite(radius) & np.isfinite(unc) & (unc > 0)
    if np.count_nonzero(before) < FEWEST_FRAMES:
        return NO_APPROACH
    t, inverse = time[before], 1.0 / radius[before]
    far = distance_m - radius_m
    design = np.stack([far + 0.5 * GRAVITY * t**2, t], axis=1)
    solution, covariance, _ = weighted_line(design, inverse, unc[before] * inverse**2)
    speed = float(solution[1] / solution[0])
    slope = np.array([-speed, 1.0]) / float(solution[0])
    speed_unc = math.sqrt(float(slope @ covariance @ slope))
    if not speed > 3.0 * speed_unc:
        return NO_APPROACH
    level, relative = 1.0 / (scale[0] * radius_m * distance_m), math.hypot(scale[1], 0.5 * (radius_m / distance_m) ** 2)
    contact = (level / float(solution[0]) - 1.0) * far / speed
    random = math.sqrt(covariance[0, 0]) / float(solution[0])
    return Approach(speed, speed_unc, contact, math.hypot(relative, random) * far / speed)


def find_turn(time_s: ArrayLike, radius_px: ArrayLike) -> tuple[float, float]:
    """Find when the radius, which shrinks on a line while the sphere approaches, starts to rise: time and unc, s.

    A line and, behind a hinge, a power of the time since: 3/2 and 2, for nobody knows how the sphere gives way within
    the first millisecond. The mean of both is the impact, half their difference, the spread of the hinges that fit
    almost as well and a tenth of a frame its uncertainty. NaN where fewer than six frames or no rise is seen.
    """
    time, radius = np.asarray(time_s, np.float64), np.asarray(radius_px, np.float64)
    good = np.isfinite(radius)
    time, radius = time[good], radius[good]
    if time.size < 6:
        return math.nan, math.nan
    lowest = int(np.argmin(radius[: max(2, int(np.argmax(radius)))]))
    peak = float(np.max(radius[lowest:]))
    if peak - radius[lowest] < 0.02 * radius[lowest]:
        return math.nan, math.nan
    above = lowest + np.flatnonzero(radius[lowest:] > radius[lowest] + (1 - EARLY_SHARE) * (peak - radius[lowest]))
    last = max(int(above[0]) + 1, 6)
    frame = float(np.median(np.diff(time)))
    hinges, spreads = zip(*(_hinge(time[:last], radius[:last], power) for power in RISES), strict=True)
    doubt = 0.5 * abs(hinges[1] - hinges[0])
    return float(np.mean(hinges)), math.sqrt(doubt**2 + max(spreads) ** 2 + (0.1 * frame) ** 2)


def _hinge(time: Floats, values: Floats, power: float) -> tuple[float, float]:
    """The hinge with the smallest residual and half the width of those that fit almost as well."""
    trials = np.linspace(time[0], time[-2], TRIALS_PER_FRAME * time.size)
    residual = np.empty(trials.size)
    line = np.stack([np.ones_like(time), time - time[0]], axis=1)
    for number, trial in enumerate(trials):
        rise = np.maximum(time - trial, 0.0) ** power
        design = np.column_stack([line, rise / max(float(rise.max()), 1e-30)])
        left = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
        residual[number] = float(left @ left)
    best = int(np.argmin(residual))
    near = trials[residual <= residual[best] * (1.0 + 1.0 / max(1, time.size - 4))]
    return float(trials[best]), 0.5 * float(np.ptp(near))
