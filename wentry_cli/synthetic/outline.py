"""Outlines of the sphere, droplets and other bodies as dense polygons in pixels or metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
POINTS = 1440


def draw_sphere_outline(
    radius: float, stretch: float, *, tilt_deg: float = 0.0, misfit: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Outline of the deformed sphere about its centre, x right and y down, shape (n, 2).

    An ellipse with semi-axes ``stretch * radius`` across and ``radius / stretch**2`` along, whose distance from the
    centre is multiplied by 1 + e3 cos 3psi + e4 cos 4psi for ``misfit`` (e3, e4), psi from the lowest point. With a
    misfit the outline is scaled across and along so that the greatest half-width and the lowest point stay those of
    the ellipse to first order only; :func:`measure_outline` gives the exact ones.
    """
    psi = np.arange(POINTS) * (2.0 * np.pi / POINTS)
    factor = 1.0 + misfit[0] * np.cos(3.0 * psi) + misfit[1] * np.cos(4.0 * psi)
    x = stretch * radius * np.sin(psi) * factor
    y = radius / stretch**2 * np.cos(psi) * factor
    if tilt_deg:
        c, s = np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))
        x, y = c * x - s * y, s * x + c * y
    return np.stack([x, y], axis=1)


def measure_outline(points: Floats) -> tuple[float, float]:
    """Greatest half-width and lowest point (y down) of an outline about its centre, refined by a parabola."""

    def peak(values: Floats) -> float:
        k = int(np.argmax(values))
        a, b, c = values[k - 1], values[k], values[(k + 1) % len(values)]
        curvature = a - 2.0 * b + c
        return float(b if curvature == 0.0 else b - (a - c) ** 2 / (8.0 * curvature))

    return 0.5 * (peak(points[:, 0]) + peak(-points[:, 0])), peak(points[:, 1])


def draw_blob(
    center: tuple[float, float], radius: float, rng: np.random.Generator, ragged: float = 0.15, points: int = 40
) -> Floats:
    """A rounded irregular body: a circle whose radius wobbles by ``ragged`` in its second to fifth harmonics."""
    theta = np.arange(points) * (2.0 * np.pi / points)
    r = np.full(points, 1.0)
    for order in range(2, 6):
        r += ragged / order * rng.normal() * np.cos(order * theta + rng.uniform(0.0, 2.0 * np.pi))
    r = radius * np.clip(r, 0.3, 2.0)
    return np.stack([center[0] + r * np.cos(theta), center[1] + r * np.sin(theta)], axis=1)


def draw_streak(start: tuple[float, float], end: tuple[float, float], half_width: float) -> Floats:
    """A straight streak with round ends from ``start`` to ``end``."""
    direction = np.array([end[0] - start[0], end[1] - start[1]])
    length = float(np.hypot(*direction))
    along = direction / length if length else np.array([1.0, 0.0])
    across = np.array([-along[1], along[0]])
    angle = np.linspace(0.0, np.pi, 9)
    cap = half_width * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * along)
    return np.concatenate([np.array(end) + cap, np.array(start) - cap])


def shift_outline(points: Floats, x: float, y: float) -> Floats:
    """The outline moved by (x, y)."""
    return np.asarray(points + np.array([x, y]))
