"""Motion of a sphere through an entry: y_b and λ in every frame become y_c, v_b, v_c and a_c with error bars."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.ballistic import fit_parabola
from wentry_cli.kinematics.centre import centre_height
from wentry_cli.kinematics.outliers import scatter_ratio
from wentry_cli.kinematics.smoother import Mode, SmoothTrack, TrackState, smooth_track
from wentry_cli.kinematics.state_pass import Ballistic

Array = NDArray[np.float64]
AIR_DENSITY = 1.2
SPHERE_DRAG = 0.5
STILL = 0.003
LEAST_SCATTER = 0.01
SWINGING = 8  # frames after impact in which the slam is not resolved
CLEARLY = 3.0  # neighbours share their noise: forty frames know their scatter to a factor of two only


@dataclass(frozen=True)
class EntryMotion:
    """Per frame: measured y_b and y_c (m), smoothed velocities and acceleration, each with standard uncertainty.

    ``bottom_random_m`` and ``centre_random_m`` are what of the uncertainties of the positions scatters from frame to
    frame. Where a position was not measured its velocity is NaN. ``outlier`` marks frames whose y_c does not belong to
    the track, ``held`` those before the release; ``bottom`` and ``centre`` are the smoothed tracks themselves.
    """

    bottom_m: Array
    bottom_unc_m: Array
    bottom_random_m: Array
    centre_m: Array
    centre_unc_m: Array
    centre_random_m: Array
    bottom_velocity: Array
    bottom_velocity_unc: Array
    velocity: Array
    velocity_unc: Array
    acceleration: Array
    acceleration_unc: Array
    outlier: NDArray[np.bool_]
    held: NDArray[np.bool_]
    bottom: SmoothTrack
    centre: SmoothTrack


def solve_entry_motion(
    times_s: Array,
    bottom: tuple[Array, Array],
    stretch: tuple[Array, Array],
    radius_m: float,
    *,
    ballistic: Ballistic,
    mode: Mode = "impact_aware",
    slow_s: float = math.inf,
    fixed_m: float | Array = 0.0,
    tilt_deg: float | Array = 0.0,
    below_m: float | Array = 0.0,
    released_s: float = -math.inf,
) -> EntryMotion:
    """Smooth y_b and y_c = y_b + R/λ² of a sphere that meets the surface at time 0.

    ``bottom`` and ``stretch`` are values and standard uncertainties, (n,) each, NaN where not measured (a rigid sphere:
    ones and zeros). Before impact a stretch that agrees with 1 is taken as 1 (see ``stretch_in_air``).

    Positions may scatter less than their uncertainties say: the rest is an error that varies slowly (a shape that is no
    ellipse, a scale) and that no smoothing sees. It is taken to turn round within ``slow_s`` and widens the error bars
    of velocity and acceleration by itself over ``slow_s`` and its square; one of λ also by the rates at which its lever
    2R/λ³ on y_c changes. What is wrong below the surface has come about since impact: after it, no slower than that.
    ``fixed_m`` is the part that is one and the same in all frames before or in all after impact (the height of the
    surface, the optical axis): it moves no speed. ``tilt_deg`` is how the axis leans in each frame (``centre_height``),
    ``below_m`` how much lower than an ellipsoid its outline reaches (``below_ellipsoid``). Frames up to
    ``released_s``, in which the sphere is still held, are no part of its fall: they are smoothed by themselves.
    """
    times = np.asarray(times_s, dtype=float)
    rigid = bool(np.all(stretch[1] == 0.0))
    resting = stretch_in_air(times, *stretch)
    height, height_unc = centre_height(bottom[0] + below_m, bottom[1], *resting, radius_m, tilt_deg)
    falls = times > released_s
    # the impact stops the bottom of a soft sphere at once, its centre only by and by
    stopped = replace(ballistic, velocity_jump=0.0 if rigid else _speed(times[falls], bottom[0][falls]))
    pairs = (bottom, (height, height_unc))
    random = _random_parts(times, bottom, resting, height, radius_m)
    tracks = [
        _with_held(
            smooth_track(times, np.where(falls, pair[0], np.nan), u, events_s=(0.0,), mode=mode, ballistic=known),
            pair[0],
            u,
            falls,
        )
        for pair, u, known in zip(pairs, random, (stopped, ballistic), strict=True)
    ]
    low, middle = (track.frames for track in tracks)
    seen, known = np.isfinite(bottom[0]), np.isfinite(height)
    moving = [np.sqrt(np.maximum(pair[1] ** 2 - fixed_m**2, 0.0)) for pair in pairs]
    hidden = [_hidden_part(times, unc, u, track) for unc, u, track in zip(moving, random, tracks, strict=True)]
    scatters = [_shown_part(pair[1], u, track) for pair, u, track in zip(pairs, random, tracks, strict=True)]
    turning, bending = _shape_changes(tracks, hidden, radius_m)
    slow = _turning_time(times, slow_s)
    return EntryMotion(
        bottom_m=bottom[0],
        bottom_unc_m=bottom[1],
        bottom_random_m=scatters[0],
        centre_m=height,
        centre_unc_m=height_unc,
        centre_random_m=scatters[1],
        bottom_velocity=np.where(seen, low.velocity, np.nan),
        bottom_velocity_unc=np.where(seen, np.hypot(low.velocity_unc, hidden[0] / slow), np.nan),
        velocity=np.where(known, middle.velocity, np.nan),
        velocity_unc=np.where(known, _add(middle.velocity_unc, hidden[1] / slow, turning), np.nan),
        acceleration=np.where(known, middle.acceleration, np.nan),
        acceleration_unc=np.where(
            known, _add(middle.acceleration_unc, hidden[1] / slow**2, bending, _unresolved(times, middle)), np.nan
        ),
        outlier=known & falls & ~tracks[1].used & np.isfinite(middle.velocity),
        held=~falls,
        bottom=tracks[0],
        centre=tracks[1],
    )


def _with_held(track: SmoothTrack, position: Array, unc: Array, falls: NDArray[np.bool_]) -> SmoothTrack:
    """The track with its states before the release from those frames alone, which the fall tells nothing of."""
    if falls.all():
        return track
    frames, held = track.frames, ~falls
    state, covariance = fit_parabola(frames.times_s[held], position[held], unc[held], relative=True).evaluate(
        frames.times_s[held]
    )
    states = np.stack([frames.position, frames.velocity, frames.acceleration], axis=1)
    spread = np.array(frames.covariance)
    states[held], spread[held] = state, covariance
    position, velocity, acceleration = states.T
    return replace(track, frames=TrackState(frames.times_s, position, velocity, acceleration, spread))


def _random_parts(
    times: Array, bottom: tuple[Array, Array], stretch: tuple[Array, Array], height: Array, radius: float
) -> tuple[Array, Array]:
    """What scatters of y_b and of y_c: of y_c the parts of y_b and of λ, each by its own scatter, then both together.

    An uncertainty that is mostly common to all frames (a scale) must not hide that λ scatters more where one view sees
    it alone.
    """
    low = _random_part(times, *bottom)
    wide = np.where(stretch[1] > 0.0, _random_part(times, *stretch), 0.0)
    both = np.hypot(low, 2.0 * radius / stretch[0] ** 3 * wide)
    return low, _random_part(times, height, both)


def _random_part(times: Array, position: Array, unc: Array) -> Array:
    """The uncertainties scaled to the scatter from frame to frame, in air and in water apart if clearly different.

    Where the few frames in air scatter more, they are taken at that: an error bar that a chance made too wide harms
    less than one that the many frames in water made too narrow.
    """
    parts = (times < 0.0, times >= 0.0)
    ratios = np.array([scatter_ratio(times[part], position[part], unc[part]) for part in parts])
    common = scatter_ratio(times, position, unc)
    if not np.all(np.isfinite(ratios)) or 1.0 / CLEARLY < ratios[0] / ratios[1] < CLEARLY:
        common = common if math.isfinite(common) else 1.0
        ratios = np.array([np.fmax(ratios[0], common), common])
    return np.where(parts[0], *(max(float(r), LEAST_SCATTER) for r in ratios)) * unc


def _turning_time(times: Array, slow_s: float) -> Array:
    """How long a common error takes to change at each frame: ``slow_s``, after impact at most the time since then."""
    wet = times >= 0.0
    if times.size < 2 or not math.isfinite(slow_s):
        return np.full(times.shape, slow_s)
    return np.where(wet, np.clip(times, float(np.median(np.diff(times))), slow_s), slow_s)


def _hidden_part(times: Array, unc: Array, random: Array, track: SmoothTrack) -> Array:
    """What of the uncertainty the scatter does not show; in air, where one line passes all frames, its median."""
    if track.status != "ok":
        return unc
    hidden = np.sqrt(np.maximum(unc**2 - (random * track.noise_scale) ** 2, 0.0))
    dry = (times < 0.0) & np.isfinite(hidden)
    return np.where(dry, np.median(hidden[dry]), hidden) if dry.any() else hidden


def _shown_part(unc: Array, random: Array, track: SmoothTrack) -> Array:
    """What of the uncertainty the scatter shows."""
    return np.minimum(unc, random * (track.noise_scale if track.status == "ok" else 1.0))


def _shape_changes(tracks: list[SmoothTrack], hidden: list[Array], radius: float) -> tuple[Array, Array]:
    """What a steady error of λ does to v_c and a_c while its lever ∂y_c/∂λ = 2R/λ³ = 2R q^(3/2) changes.

    q = (y_c − y_b)/R and its derivatives are those of the two smoothed tracks.
    """
    if any(track.status != "ok" for track in tracks):
        return np.zeros_like(hidden[0]), np.zeros_like(hidden[0])
    low, middle = (track.frames for track in tracks)
    q = np.maximum((middle.position - low.position) / radius, 0.05)
    rate, bend = (middle.velocity - low.velocity) / radius, (middle.acceleration - low.acceleration) / radius
    relative = np.sqrt(np.maximum(hidden[1] ** 2 - hidden[0] ** 2, 0.0)) / q**1.5
    return relative * 1.5 * np.sqrt(q) * np.abs(rate), relative * np.abs(
        1.5 * np.sqrt(q) * bend + 0.75 * rate**2 / np.sqrt(q)
    )


def _unresolved(times: Array, track: TrackState) -> Array:
    """What the acceleration turns within a frame just after impact, m/s²: half its second difference.

    The slam passes in a frame or two, of which a position shows the integral alone: a track that swings from frame to
    frame there has its swings from what the smoother expects, not from the frames.
    """
    out = np.zeros_like(times)
    wet = np.flatnonzero((times > 0.0) & np.isfinite(track.acceleration))[: SWINGING + 1]
    if wet.size > 1:
        value = track.acceleration[wet]
        steps = np.diff(value)
        out[wet[0]] = 0.5 * abs(steps[0])
        out[wet[1:-1]] = 0.5 * np.abs(np.diff(steps))
    return out


def _add(*parts: Array) -> Array:
    """Add in quadrature."""
    total: Array = np.sqrt(np.sum(np.square(parts), axis=0))
    return total


def _speed(times: Array, height: Array) -> float:
    """A rough speed, m/s: the median step between measured frames."""
    good = np.isfinite(height)
    return float(np.median(np.abs(np.diff(height[good]) / np.diff(times[good])))) if good.sum() > 1 else 0.0


def stretch_in_air(times_s: Array, stretch: Array, stretch_unc: Array) -> tuple[Array, Array]:
    """Take the stretch before impact as exactly 1 where its mean agrees with 1: a sphere at rest in its own frame.

    It agrees within three standard errors or 0.003; what of the difference is no noise stays as its uncertainty (a
    sphere that is not quite round). A sphere that still rings from its release keeps what was measured. Frames without
    a stretch before impact are filled in the same way.
    """
    before = times_s < 0.0
    known = before & np.isfinite(stretch) & (stretch_unc > 0.0)
    doubt = 0.0
    if not before.any():
        return stretch, stretch_unc
    if known.any():
        weight = 1.0 / stretch_unc[known] ** 2
        mean = float(np.sum(weight * stretch[known]) / np.sum(weight))
        if abs(mean - 1.0) > max(STILL, 3.0 / float(np.sqrt(np.sum(weight)))):
            return stretch, stretch_unc
        doubt = float(np.sqrt(max(0.0, (mean - 1.0) ** 2 - 1.0 / np.sum(weight))))
    return np.where(before, 1.0, stretch), np.where(before, doubt, stretch_unc)


def fall_before_impact(
    gravity_m_s2: float, speed_m_s: float, radius_m: float, density_kg_m3: float, *, position_jump_m: float = 0.0
) -> Ballistic:
    """Return what is known of the fall: −g, uncertain by the drag of the air (⅜ C_D ρ_air/ρ_s U²/R)."""
    drag = 0.375 * SPHERE_DRAG * AIR_DENSITY / density_kg_m3 * speed_m_s**2 / radius_m
    return Ballistic(-gravity_m_s2, drag, position_jump_m)


def impact_velocity(times_s: Array, velocity: Array, velocity_unc: Array, acceleration: Array) -> tuple[float, float]:
    """Return v_c(0⁻) and its uncertainty from the last frame before impact (ballistic: exact); NaN without one."""
    good = (times_s <= 0.0) & np.isfinite(velocity) & np.isfinite(acceleration)
    if not good.any():
        return float("nan"), float("nan")
    last = int(np.flatnonzero(good)[-1])
    return float(velocity[last] - acceleration[last] * times_s[last]), float(velocity_unc[last])


def fall_speed(
    times_s: Array, height_m: Array, height_unc_m: Array, ballistic: Ballistic, released_s: float = -math.inf
) -> tuple[float, float]:
    """Return the speed at time 0 (positive downwards) of what falls before it, and its uncertainty; NaN below 3 frames.

    Least squares of height, speed and acceleration in the frames from the release to impact, the acceleration with its
    prior. ``released_s`` is when a sphere that was held is let go.
    """
    good = (times_s < 0.0) & np.isfinite(height_m) & (height_unc_m > 0.0)
    good &= times_s > released_s
    if good.sum() < 3:
        return float("nan"), float("nan")
    t, unc = times_s[good], height_unc_m[good]
    length = float(np.ptp(t))
    sure = max(ballistic.uncertainty, 1e-6)
    rows = np.stack([np.ones_like(t), t / length, 0.5 * (t / length) ** 2], axis=1) / unc[:, None]
    design = np.vstack([rows, [0.0, 0.0, 1.0 / (sure * length**2)]])
    right = np.append(height_m[good] / unc, ballistic.acceleration / sure)
    solution = np.linalg.lstsq(design, right, rcond=None)[0]
    residual = right - design @ solution
    scale = max(1.0, float(np.sqrt(np.sum(residual**2) / max(int(good.sum()) - 2, 1))))
    spread = float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1])) / length
    return -float(solution[1]) / length, scale * spread
