"""The wall of the cavity near the corner that it makes with the sphere: a parabola through points of its edge."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.flank import off_outline

Floats = NDArray[np.float64]
Point = tuple[float, float]
Tilt = tuple[float, float]

# Columns of the points of a wall; OFF is how far off the outline of the sphere, DOUBT how well the place is known, px.
X, Y, OFF, DOUBT = 0, 1, 2, 3
NEAR_PX, LEAST_OFF_PX, POINT_PX = 2.5, 0.25, 0.04
STEEPEST_STEP_PX, MEET_ROUNDS, MET_PX = 4.0, 8, 0.005
# How far the outline stays off a right-angled corner by blur alone, and up to where that is looked for.
FILLED_PX, FILLED_FAR_PX = 0.6, 3.5


class Wall(NamedTuple):
    """A parabola ``c0 + c1 u + c2 u^2 / 2`` aside of a direction (``dx``, ``dy``), u px along it from the corner.

    ``residual`` is how far the points scatter about it and ``doubt`` how well their places are known, px; the others
    are the Cholesky factor of the normal equations, row by row.
    """

    dx: float
    dy: float
    c0: float
    c1: float
    c2: float
    residual: float
    doubt: float
    l00: float
    l10: float
    l11: float
    l20: float
    l21: float
    l22: float


@compiled
def choose_points(points: Floats, base: float, corner: Point, far: float, kept: Floats) -> int:
    """Copy the points that lie clear of the corner and of the sphere to ``kept``; how many.

    There they are seen from the corner; ``far`` is how far away they may lie, ``base`` how far off the outline the
    edge of the sphere itself lies, px.
    """
    number = 0
    for k in range(points.shape[0]):
        x, y = points[k, X] - corner[0], points[k, Y] - corner[1]
        if NEAR_PX**2 < x * x + y * y < far**2 and points[k, OFF] - base > LEAST_OFF_PX:
            kept[number, X], kept[number, Y], kept[number, DOUBT] = x, y, points[k, DOUBT]
            number += 1
    return number


@compiled
def direction_of(kept: Floats, number: int) -> Point:
    """The direction from the corner in which the kept points scatter most."""
    mx, my, xx, yy, xy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(number):
        x, y = kept[k, X], kept[k, Y]
        mx, my, xx, yy, xy = mx + x, my + y, xx + x * x, yy + y * y, xy + x * y
    angle = 0.5 * math.atan2(2.0 * (xy - mx * my / number), xx - yy - (mx * mx - my * my) / number)
    dx, dy = math.cos(angle), math.sin(angle)
    return (-dx, -dy) if mx * dx + my * dy < 0.0 else (dx, dy)


@compiled
def fit_wall(kept: Floats, number: int, bend: float) -> Wall:
    """The parabola through the first ``number`` kept points, ``bend`` being the prior of its curvature (1/px)."""
    dx, dy = direction_of(kept, number)
    s1, s2, s3, s4, t0, t1, t2, doubt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(number):
        u, v = kept[k, X] * dx + kept[k, Y] * dy, kept[k, Y] * dx - kept[k, X] * dy
        square = u * u
        s1, s2, s3, s4 = s1 + u, s2 + square, s3 + u * square, s4 + square * square
        t0, t1, t2, doubt = t0 + v, t1 + u * v, t2 + square * v, doubt + kept[k, DOUBT]
    l00 = math.sqrt(number) / POINT_PX
    l10, l20 = s1 / (l00 * POINT_PX**2), 0.5 * s2 / (l00 * POINT_PX**2)
    l11 = math.sqrt(s2 / POINT_PX**2 - l10 * l10)
    l21 = (0.5 * s3 / POINT_PX**2 - l20 * l10) / l11
    l22 = math.sqrt(0.25 * s4 / POINT_PX**2 + 1.0 / bend**2 - l20 * l20 - l21 * l21)
    r0 = t0 / (l00 * POINT_PX**2)
    r1 = (t1 / POINT_PX**2 - l10 * r0) / l11
    c2 = (0.5 * t2 / POINT_PX**2 - l20 * r0 - l21 * r1) / (l22 * l22)
    c1 = (r1 - l21 * c2) / l11
    c0 = (r0 - l10 * c1 - l20 * c2) / l00
    left = 0.0
    for k in range(number):
        u, v = kept[k, X] * dx + kept[k, Y] * dy, kept[k, Y] * dx - kept[k, X] * dy
        left += (v - c0 - u * (c1 + 0.5 * u * c2)) ** 2
    residual = math.sqrt(left / max(1, number - 2))
    return Wall(dx, dy, c0, c1, c2, residual, doubt / number, l00, l10, l11, l20, l21, l22)


@compiled
def variance_at(wall: Wall, u: float) -> float:
    """Variance of where the wall lies ``u`` px from the corner (px^2): its fit, and what is in doubt of its points."""
    x0 = 1.0 / wall.l00
    x1 = (u - wall.l10 * x0) / wall.l11
    x2 = (0.5 * u * u - wall.l20 * x0 - wall.l21 * x1) / wall.l22
    fitted = (x0 * x0 + x1 * x1 + x2 * x2) * max(1.0, (wall.residual / POINT_PX) ** 2)
    return fitted + wall.doubt * wall.doubt


@compiled
def place_on(wall: Wall, u: float) -> Point:
    """The point of the wall ``u`` px along it, from the corner."""
    v = wall.c0 + u * (wall.c1 + 0.5 * u * wall.c2)
    return u * wall.dx - v * wall.dy, u * wall.dy + v * wall.dx


@compiled
def meet(shape: Floats, tilt: Tilt, base: float, corner: Point, wall: Wall) -> tuple[float, float]:
    """Where along the wall it meets the outline of the sphere (px), and the sine of the angle between them."""
    u, slope = 0.0, math.nan
    for _ in range(MEET_ROUNDS):
        x, y = place_on(wall, u)
        off, nx, ny = off_outline(shape, tilt, corner[0] + x, corner[1] + y)
        steep = wall.c1 + wall.c2 * u
        slope = (wall.dx - steep * wall.dy) * nx + (wall.dy + steep * wall.dx) * ny
        if not slope > 0.02:
            return math.nan, slope
        step = (base - off) / slope
        u += min(STEEPEST_STEP_PX, max(-STEEPEST_STEP_PX, step))
        if abs(step) < MET_PX:
            break
    return u, slope


@compiled
def filling(points: Floats, base: float, normal: Point, corner: Point, wall: Wall) -> float:
    """How much farther the outline stays off the corner, px, than blur fills one between straight lines.

    What is more has been bent already out of sight: a wall that leaves the sphere by and by.
    """
    nx, ny = normal
    sine = wall.dx * nx + wall.dy * ny
    cosine = wall.dx * ny - wall.dy * nx
    cosine = cosine if nx < 0.0 else -cosine
    sharp = FILLED_PX * sine / max(0.2, 1.0 + cosine)
    deepest = 0.0
    for k in range(points.shape[0]):
        x, y = points[k, X] - corner[0], points[k, Y] - corner[1]
        if x * x + y * y <= FILLED_FAR_PX**2:
            u, v = x * wall.dx + y * wall.dy, y * wall.dx - x * wall.dy
            aside = abs(v - wall.c0 - u * (wall.c1 + 0.5 * u * wall.c2))
            deepest = max(deepest, min(aside, points[k, OFF] - base))
    return max(0.0, deepest - 1.1 * sharp - POINT_PX)
