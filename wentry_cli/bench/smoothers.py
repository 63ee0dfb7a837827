"""Speed against error of velocity and acceleration: ours against SciPy's splines and the usual differences.

The truths are falls into water integrated here by SciPy from an equation of motion of its own (slam, drag on the
stretched area, buoyancy): soft, rigid and very soft, 2000 fps, 340 frames, impact at a sub-frame phase, 4 px/mm.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import UnivariateSpline, make_smoothing_spline
from scipy.signal import savgol_filter

from wentry_cli.bench.row import BenchRow
from wentry_cli.kinematics.smoother import Mode, smooth_track
from wentry_cli.kinematics.state_pass import Ballistic

Array = NDArray[np.float64]
FPS, PX_PER_M, FRAMES, GRAVITY = 2000.0, 4000.0, 340, 9.81
DIAMETER, DENSITY, WATER = 0.051, 1070.0, 998.0
# amplitude and decay (1/s) of the oscillation in ln λ, shear modulus Pa
SPHERES = {"soft": (0.45, 12.0, 6900.0), "rigid": (0.0, 1.0, 1e6), "very soft": (0.9, 6.0, 1235.0)}
NOISE_PX = (0.02, 0.1, 0.5)
SETTLED_S = 0.004
Method = Callable[[Array, Array, float], tuple[Array, Array]]


@dataclass(frozen=True)
class Truth:
    """Times after impact and height, velocity, acceleration of the centre."""

    t: Array
    y: Array
    v: Array
    a: Array


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Velocity and acceleration away from impact and at it, every method at every noise; ``quick``: soft, 0.1 px."""
    spheres = ("soft",) if quick else tuple(SPHERES)
    noises = (0.1,) if quick else NOISE_PX
    rows = []
    for sphere in spheres:
        truth = make_truth(sphere)
        for noise in noises:
            for name, method in METHODS.items():
                rows += _measure(truth, (f"{sphere}, {noise:g} px", name), method, noise, (seed, 2 if quick else 4))
    return rows


def make_truth(sphere: str) -> Truth:
    """Integrate the fall of one of ``SPHERES``: 20 ms in air, 150 ms in water, first contact at 5 m/s."""
    speed = 5.0
    t = np.asarray((np.arange(FRAMES) - 40.3) / FPS, dtype=float)
    rate = _equation(*SPHERES[sphere])
    after = np.maximum(t, 0.0)
    end = (0.0, float(t[-1]) + 1e-6)
    path = solve_ivp(rate, end, [0.0, -speed], rtol=1e-9, atol=1e-11, max_step=2e-4, dense_output=True).sol(after)
    wet = np.array([rate(float(s), path[:, i])[1] for i, s in enumerate(after)])
    dry = t < 0.0
    return Truth(
        t,
        np.where(dry, -speed * t - 0.5 * GRAVITY * t**2, path[0]),
        np.where(dry, -speed - GRAVITY * t, path[1]),
        np.where(dry, -GRAVITY, wet),
    )


def _equation(amplitude: float, decay: float, stiffness: float) -> Callable[[float, Array], list[float]]:
    radius = 0.5 * DIAMETER
    volume = 4.0 / 3.0 * np.pi * radius**3
    period = 1.4 * DIAMETER / np.sqrt(stiffness / DENSITY)

    def rate(t: float, state: Array) -> list[float]:
        y, v = state
        start = 1.0 - np.exp(-((12.0 * t / period) ** 2))
        stretch = np.exp(amplitude * np.exp(-decay * t) * np.sin(2.0 * np.pi * t / period) * start)
        depth = max(-y, 0.0) / radius
        taper = np.exp(-((depth / 0.35) ** 1.5))
        added = 0.25 * stretch**3 * WATER * volume
        slam = added * 1.5 / 0.35 * np.sqrt(depth / 0.35) * taper / radius * v * v
        wet = 1.0 - np.exp(-2.0 * depth)
        drag = -0.5 * WATER * v * abs(v) * np.pi * (stretch * radius) ** 2 * 0.35 * wet * stretch**2
        force = drag + slam + 0.7 * WATER * GRAVITY * volume * wet - DENSITY * volume * GRAVITY
        return [v, float(force / (DENSITY * volume + added * (1.0 - taper)))]

    return rate


def _ours(mode: Mode) -> Method:
    def smooth(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
        events = (0.0,) if mode == "impact_aware" else ()
        track = smooth_track(t, y, noise, events_s=events, mode=mode, ballistic=Ballistic(-GRAVITY, 0.0))
        return track.frames.velocity, track.frames.acceleration

    return smooth


def _differences(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    del noise
    v = np.gradient(y, t)
    return v, np.gradient(v, t)


def _cubic_gcv(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    del noise
    # in frames: in seconds the search for the penalty ends at its bound
    spline = make_smoothing_spline((t - t[0]) * FPS, y)
    frames = (t - t[0]) * FPS
    return spline.derivative(1)(frames) * FPS, spline.derivative(2)(frames) * FPS**2


def _quintic_known_noise(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    spline = UnivariateSpline(t, y / noise, k=5, s=t.size)
    return spline.derivative(1)(t) * noise, spline.derivative(2)(t) * noise


def _savitzky_golay(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Window by generalised cross validation of the smoothed position, degree 4."""
    del noise
    windows = [w for w in range(7, 62, 4) if w < t.size]
    scores = []
    for w in windows:
        own = savgol_filter(np.eye(1, w, w // 2)[0], w, 4)[w // 2]
        scores.append(np.mean((y - savgol_filter(y, w, 4)) ** 2) / (1.0 - own) ** 2)
    best, step = windows[int(np.argmin(scores))], 1.0 / FPS
    return savgol_filter(y, best, 4, 1, step), savgol_filter(y, best, 4, 2, step)


METHODS: dict[str, Method] = {
    "wentry, impact_aware": _ours("impact_aware"),
    "wentry, gcv": _ours("gcv"),
    "wentry, epps": _ours("epps"),
    "scipy make_smoothing_spline, GCV": _cubic_gcv,
    "scipy UnivariateSpline k=5, true noise": _quintic_known_noise,
    "scipy savgol_filter, window by GCV": _savitzky_golay,
    "central differences": _differences,
}


def _measure(
    truth: Truth, names: tuple[str, str], method: Method, pixels: float, draws: tuple[int, int]
) -> list[BenchRow]:
    """Four rows: v and a, away from impact and within 4 ms of it, over ``draws`` = (seed, number of them)."""
    noise, found, seconds = pixels / PX_PER_M, [], []
    random = np.random.default_rng(draws[0])
    samples = [truth.y + noise * random.normal(size=truth.t.size) for _ in range(draws[1])]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # FITPACK complains of a tolerance that it cannot meet
        method(truth.t, samples[0], noise)
        for y in samples:
            started = time.perf_counter()
            v, a = method(truth.t, y, noise)
            seconds.append(time.perf_counter() - started)
            found.append((v - truth.v, a - truth.a))
    settled = truth.t > SETTLED_S
    strike = (truth.t >= 0.0) & ~settled
    rows = []
    for where, part in (("inside", settled), ("at impact", strike)):
        for i, (quantity, unit) in enumerate((("velocity", "m/s"), ("acceleration", "m/s²"))):
            error = np.concatenate([pair[i][part] for pair in found])
            rows.append(
                BenchRow(
                    chapter="smoothers",
                    case=f"{names[0]}, {where}",
                    method=names[1],
                    quantity=quantity,
                    unit=unit,
                    bias=float(np.mean(error)),
                    rmse=float(np.sqrt(np.mean(error**2))),
                    ratio_to_bound=float("nan"),
                    failures=float(np.mean(~np.isfinite(error))),
                    time_us=1e6 * float(np.median(seconds)),
                )
            )
    return rows
