"""Outlines of the sphere, droplets and other bodies as dense polygons in pixels or metres.

What is true of a sphere whose outline is no upright ellipse. The stretch is the greatest half-width over R, measured
across the body's own axis: of a misfit shape it is greater than the semi-axis of the ellipse that it started from, of
a tilted ellipsoid it is still the principal stretch, since tilting a body does not stretch it. The lowest point is the
lowest of the outline as it stands in the picture, tilted or not. A positive tilt moves the lower pole to the right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]
POINTS = 1440
STRETCHES = np.linspace(0.4, 4.0, 145)


def draw_sphere_outline(
    radius: float, stretch: float, *, tilt_deg: float = 0.0, misfit: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Outline of the deformed sphere about its centre, x right and y down, shape (n, 2).

    An ellipse with semi-axes ``stretch * radius`` across and ``radius / stretch**2`` along, whose distance from the
    centre is multiplied by 1 + e3 cos 3psi + e4 cos 4psi for ``misfit`` (e3, e4), psi from the lowest point, then
    turned by ``tilt_deg`` (positive: the lower pole moves to the right). With a misfit the greatest half-width and the
    lowest point are no longer those of the ellipse; :func:`measure_outline` gives them.
    """
    psi = np.arange(POINTS) * (2.0 * np.pi / POINTS)
    factor = 1.0 + misfit[0] * np.cos(3.0 * psi) + misfit[1] * np.cos(4.0 * psi)
    x = stretch * radius * np.sin(psi) * factor
    y = radius / stretch**2 * np.cos(psi) * factor
    if tilt_deg:
        c, s = np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))
        x, y = c * x + s * y, c * y - s * x
    return np.stack([x, y], axis=1)


def measure_outline(points: Floats) -> tuple[float, float]:
    """Greatest half-width and lowest point (y down) of an outline about its centre, refined by a parabola."""

    def peak(values: Floats) -> float:
        k = int(np.argmax(values))
        a, b, c = values[k - 1], values[k], values[(k + 1) % len(values)]
        curvature = a - 2.0 * b + c
        return float(b if curvature == 0.0 else b - (a - c) ** 2 / (8.0 * curvature))

    return 0.5 * (peak(points[:, 0]) + peak(-points[:, 0])), peak(points[:, 1])


@dataclass(frozen=True)
class Shape:
    """How the sphere departs from an upright ellipse at every stretch of the ellipse.

    ``widest`` is its greatest half-width, across its own axis, over that of the ellipse. ``profile`` is half the
    outline of a misfit shape that is not stretched, rows of (height above the centre, half-width) in radii, from below.
    """

    widest: float
    along: CubicSpline | None
    profile: Floats | None = None

    def lowest(self, stretch: Floats | float) -> Floats:
        """Depth of the lowest point below the centre, in radii."""
        stretch = np.asarray(stretch, float)
        return np.asarray((1.0 if self.along is None else self.along(stretch)) / stretch**2)

    def half_width(self, relative: Floats) -> Floats:
        """Half-width at heights above the centre, both in semi-axes of the ellipse; the tilt is left out of it."""
        if self.profile is None:
            return np.sqrt(1.0 - relative**2)
        return np.interp(relative, self.profile[:, 0], self.profile[:, 1])

    def lowest_slope(self, stretch: Floats) -> Floats:
        """Derivative of :meth:`lowest` with respect to the stretch."""
        slope = -2.0 * self.lowest(stretch) / stretch
        return slope if self.along is None else np.asarray(slope + self.along(stretch, 1) / stretch**2)


def describe_shape(tilt_deg: float, misfit: tuple[float, float]) -> Shape:
    """Measure the outlines of a misfit and a tilt once, over all stretches."""
    if not tilt_deg and not any(misfit):
        return Shape(1.0, None)
    upright = draw_sphere_outline(1.0, 1.0, misfit=misfit)
    widest, _ = measure_outline(upright)
    drawn = (draw_sphere_outline(1.0, float(s), tilt_deg=tilt_deg, misfit=misfit) for s in STRETCHES)
    lowest = np.array([measure_outline(points)[1] for points in drawn])
    profile = np.column_stack([-upright[:, 1], upright[:, 0]])[: POINTS // 2 + 1] if any(misfit) else None
    return Shape(widest, CubicSpline(STRETCHES, lowest * STRETCHES**2), profile)


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


def shift_outline(points: Floats, x: float, y: float) -> Floats:
    """The outline moved by (x, y)."""
    return np.asarray(points + np.array([x, y]))
