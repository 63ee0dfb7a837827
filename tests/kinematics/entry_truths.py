"""Falls into water integrated here, by SciPy, from an equation that the package does not know."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

FPS, PX_PER_M = 2000.0, 4000.0
D, RHO, WATER, G = 0.051, 1070.0, 998.0, 9.81
KINDS = {"soft": (6900.0, 0.45, 12.0), "rigid": (5.66e5, 0.0, 1.0), "very_soft": (1235.0, 0.9, 6.0)}


@dataclass(frozen=True)
class Fall:
    """Times after impact (s), height, velocity and acceleration of the centre; 20 ms of fall, 150 ms of entry."""

    t: np.ndarray
    y: np.ndarray
    v: np.ndarray
    a: np.ndarray

    @property
    def inside(self) -> np.ndarray:
        return self.t > 0.004

    @property
    def at_impact(self) -> np.ndarray:
        return (self.t >= 0.0) & (self.t <= 0.004)


@cache
def fall(kind: str, *, speed: float = 5.0, phase: float = 0.3, frames: int = 340) -> Fall:
    """Added mass that grows with depth (slam), drag on the stretched area, a little buoyancy."""
    stiffness, amplitude, damping = KINDS[kind]
    radius, period = D / 2, 1.4 * D / np.sqrt(stiffness / RHO)
    volume = 4 / 3 * np.pi * radius**3

    def rate(t: float, state: np.ndarray) -> list[float]:
        y, v = state
        ring = amplitude * np.exp(-damping * t) * np.sin(2 * np.pi * t / period)
        stretch = np.exp(ring * (1 - np.exp(-((12 * t / period) ** 2))))
        depth = max(-y, 0.0) / radius
        taper = np.exp(-((depth / 0.35) ** 1.5))
        added = 0.25 * stretch**3 * WATER * volume * (1 - taper)
        slam = 0.25 * stretch**3 * WATER * volume * 1.5 / 0.35 * (depth / 0.35) ** 0.5 * taper / radius * v * v
        wet = 1 - np.exp(-2 * depth)
        drag = -0.5 * WATER * v * abs(v) * np.pi * (stretch * radius) ** 2 * 0.35 * wet * stretch**2
        force = drag + slam + 0.7 * WATER * G * volume * wet - RHO * volume * G
        return [v, force / (RHO * volume + added)]

    t = (np.arange(frames) - 40 - phase) / FPS
    after = np.maximum(t, 0.0)
    path = solve_ivp(rate, (0, t[-1] + 1e-6), [0.0, -speed], rtol=1e-9, atol=1e-11, max_step=2e-4, dense_output=True)
    state = path.sol(after)
    wet_a = np.array([rate(s, state[:, i])[1] for i, s in enumerate(after)])
    dry = t < 0
    return Fall(
        t,
        np.where(dry, -speed * t - 0.5 * G * t**2, state[0]),
        np.where(dry, -speed - G * t, state[1]),
        np.where(dry, -G, wet_a),
    )


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
