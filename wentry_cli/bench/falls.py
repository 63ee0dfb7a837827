"""Falls into water with exact derivatives, integrated here by SciPy from an equation of motion of its own.

A soft, a rigid and a very soft sphere of 51 mm: slam, drag on the stretched area, buoyancy. Speed, phase of the impact
between two frames, extent of the slam, drag and oscillation are drawn from a seed, so that every seed is other drops.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
FPS, PX_PER_M, FRAMES, BEFORE, GRAVITY = 2000.0, 4000.0, 340, 40, 9.81
DIAMETER, DENSITY, WATER = 0.051, 1070.0, 998.0
SPHERES = ("soft", "rigid", "very soft")
SETTLED_S = 0.004
SLAM_WITHIN_S = 0.012


@dataclass(frozen=True)
class Truth:
    """Times after impact and height, velocity, acceleration of the centre."""

    t: Array
    y: Array
    v: Array
    a: Array

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Frames later than 4 ms after impact."""
        return np.asarray(self.t > SETTLED_S)

    @property
    def at_impact(self) -> NDArray[np.bool_]:
        """Frames within 4 ms after impact."""
        return np.asarray((self.t >= 0.0) & (self.t <= SETTLED_S))


@dataclass(frozen=True)
class _Draw:
    """What differs between drops: m/s, Pa, amplitude and decay (1/s) of ln λ, extent of the slam in radii, drag."""

    speed: float
    stiffness: float
    amplitude: float
    decay: float
    extent: float
    drag: float


def make_truth(sphere: str, seed: int, *, frames: int = FRAMES) -> Truth:
    """Integrate the fall of one of ``SPHERES``: 20 ms in air, then water."""
    random = np.random.default_rng([seed, SPHERES.index(sphere)])
    draw = _draw(sphere, random)
    return _fall(draw, np.asarray((np.arange(frames) - BEFORE - random.uniform(0.05, 0.95)) / FPS, dtype=float))


def make_falls(t: Array, count: int, seed: int) -> list[Truth]:
    """Return ``count`` other falls, of all spheres in turn, at the times ``t`` after impact."""
    random = np.random.default_rng([seed, count])
    return [_fall(_draw(SPHERES[k % len(SPHERES)], random), t) for k in range(count)]


def slam_of(sphere: str, seed: int) -> tuple[float, float]:
    """Return the greatest acceleration, m/s², of the fall of that name and seed and how long it has half of it, s."""
    t = np.linspace(0.0, SLAM_WITHIN_S, 1201)
    a = _fall(_draw(sphere, np.random.default_rng([seed, SPHERES.index(sphere)])), t).a
    top = int(np.argmax(a))
    low = np.flatnonzero(a < 0.5 * a[top])
    after = low[low > top]
    return float(a[top]), float((t[after[0]] if after.size else t[-1]) - t[low[low < top][-1]])


def _fall(draw: _Draw, t: Array) -> Truth:
    rate = _equation(draw)
    after, end = np.maximum(t, 0.0), (0.0, float(t[-1]) + 1e-6)
    start = [0.0, -draw.speed]
    path = solve_ivp(rate, end, start, rtol=1e-9, atol=1e-11, max_step=2e-4, dense_output=True).sol(after)
    wet = np.array([rate(float(s), path[:, i])[1] for i, s in enumerate(after)])
    dry = t < 0.0
    return Truth(
        t,
        np.where(dry, -draw.speed * t - 0.5 * GRAVITY * t**2, path[0]),
        np.where(dry, -draw.speed - GRAVITY * t, path[1]),
        np.where(dry, -GRAVITY, wet),
    )


def _draw(sphere: str, random: np.random.Generator) -> _Draw:
    elastic = {
        "soft": (random.uniform(5e3, 9e3), random.uniform(0.3, 0.5), random.uniform(8.0, 15.0)),
        "rigid": (1e6, 0.0, 1.0),
        "very soft": (random.uniform(1000.0, 1500.0), random.uniform(0.6, 0.95), random.uniform(5.0, 8.0)),
    }[sphere]
    return _Draw(random.uniform(3.2, 6.7), *elastic, random.uniform(0.25, 0.45), random.uniform(0.25, 0.45))


def _equation(draw: _Draw) -> Callable[[float, Array], list[float]]:
    radius = 0.5 * DIAMETER
    volume = 4.0 / 3.0 * np.pi * radius**3
    period = 1.4 * DIAMETER / np.sqrt(draw.stiffness / DENSITY)

    def rate(t: float, state: Array) -> list[float]:
        y, v = state
        start = 1.0 - np.exp(-((12.0 * t / period) ** 2))
        stretch = np.exp(draw.amplitude * np.exp(-draw.decay * t) * np.sin(2.0 * np.pi * t / period) * start)
        depth = max(-y, 0.0) / radius
        taper = np.exp(-((depth / draw.extent) ** 1.5))
        added = 0.25 * stretch**3 * WATER * volume
        slam = added * 1.5 / draw.extent * np.sqrt(depth / draw.extent) * taper / radius * v * v
        wet = 1.0 - np.exp(-2.0 * depth)
        drag = -0.5 * WATER * v * abs(v) * np.pi * (stretch * radius) ** 2 * draw.drag * wet * stretch**2
        force = drag + slam + 0.7 * WATER * GRAVITY * volume * wet - DENSITY * volume * GRAVITY
        return [v, float(force / (DENSITY * volume + added * (1.0 - taper)))]

    return rate
