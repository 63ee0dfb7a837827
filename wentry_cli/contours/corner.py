"""The corner that the cavity wall makes with the sphere on one side of the silhouette.

Below it the outline is the ellipse, above it a wall that leaves at any angle. Blur fills the corner itself, so the
wall is followed from a few pixels away, along rays half-way between the normal of the ellipse and its tangent, and
carried back to the ellipse as a parabola.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import NX, NY, X, Y, departure_at, semi_axes
from wentry_cli.contours.band import ellipse_distance
from wentry_cli.contours.leaving import base_below, clings, first_departure
from wentry_cli.contours.normal_equations import factorise, invert_block, substitute
from wentry_cli.contours.wedge import DOUBT, SLANTED, most_shift, wedge_shift, wedge_step
from wentry_cli.imaging.edges import CANDIDATES, edge_candidates

Floats = NDArray[np.float64]

SEEN, NO_CORNER, TOO_SHORT = 0.0, 1.0, 2.0
LEAST_RAYS_BELOW = 7
BELOW_PX, ABOVE_PX, SPACING_PX = 4.0, 20.0, 1.0
INWARDS_PX, HALF_PX, STEP_PX = 4.0, 16.0, 1.0
NEAR_PX, FIRST_FAR_PX, LAST_FAR_PX = 2.5, 8.0, 15.0
LEAST_POINTS, LEAST_OFF_PX = 5, 0.25
# Curvature that a wall may have, over that of the sphere.
BENT = 0.5
MOST_RESIDUAL_PX, MOST_RESIDUAL, POINT_PX, BASE_UNC_PX = 0.3, 3.0, 0.04, 0.03
TURNS, SETTLED_PX, MOST_UNSETTLED_PX = 8, 0.05, 0.4
STEEPEST_STEP_PX = 4.0
# A wall that is followed over the near range alone is believed less.
TRUST_RANGE = 3.0
# How far the outline stays off a right-angled corner by blur alone, and what more of it may hide of the wall.
FILLED_PX, BENT_AWAY = 0.6, 5.0
# Where the wall leaves at a right angle, what happens within the blur is not seen at all.
BLIND_PX = 0.4


@compiled
def slanted_rays(length: Floats, path: Floats, found: int) -> Floats:
    """Rays (x, y, direction) from the ellipse about ray ``found``, half-way between outwards and downwards."""
    count = int((BELOW_PX + ABOVE_PX) / SPACING_PX) + 1
    rays = np.empty((count, 4))
    n, number = 0, 0
    for k in range(count):
        at = length[found] - BELOW_PX + k * SPACING_PX
        while n + 2 < length.size and length[n + 1] <= at:
            n += 1
        if at < length[0] or at > length[n + 1]:
            continue
        share = (at - length[n]) / (length[n + 1] - length[n])
        nx = path[n, NX] + share * (path[n + 1, NX] - path[n, NX])
        ny = path[n, NY] + share * (path[n + 1, NY] - path[n, NY])
        norm = math.hypot(nx, ny)
        nx, ny = nx / norm, ny / norm
        turn = 1.0 if (path[n, X] - path[n + 1, X]) * ny - (path[n, Y] - path[n + 1, Y]) * nx > 0.0 else -1.0
        dx, dy = (nx + turn * ny) * math.sqrt(0.5), (ny - turn * nx) * math.sqrt(0.5)
        reach = HALF_PX - INWARDS_PX
        rays[number, 0] = path[n, X] + share * (path[n + 1, X] - path[n, X]) + reach * dx
        rays[number, 1] = path[n, Y] + share * (path[n + 1, Y] - path[n, Y]) + reach * dy
        rays[number, 2], rays[number, 3] = dx, dy
        number += 1
    return rays[:number]


@compiled
def off_ellipse(shape: Floats, x: float, y: float) -> float:
    """Signed distance of a point from the outline, px."""
    a, b = semi_axes(shape)
    c, s = math.cos(shape[4]), math.sin(shape[4])
    u, v = (x - shape[0]) * c - (y - shape[1]) * s, (x - shape[0]) * s + (y - shape[1]) * c
    distance, tx, ty = ellipse_distance(a, b, u, v)
    if shape.size > 5:
        phi = math.atan2(ty, tx)
        distance -= departure_at(shape, phi) * math.hypot(a * math.cos(phi), b * math.sin(phi))
    return distance


@compiled
def wall_points(
    values: NDArray[np.float32], shape: Floats, rays: Floats, base: float, light: tuple[float, float]
) -> Floats:
    """The outermost strong edge on each ray, rows of (x, y, how far off the outline of ``shape``, doubt in px).

    ``base`` is how far the edge of the sphere lies off the ellipse, ``light`` the least height of an edge and the blur.
    """
    at, height, _ = edge_candidates(values, rays, HALF_PX, STEP_PX, 1)
    outer = np.full(rays.shape[0], math.nan)
    for k in range(rays.shape[0]):
        for slot in range(CANDIDATES):
            if height[k, slot] >= light[0] and not outer[k] >= at[k, slot]:
                outer[k] = at[k, slot]
    inner = SLANTED * base + INWARDS_PX - HALF_PX
    step = wedge_step(values, rays, inner, outer, light[1])
    points = np.empty((rays.shape[0], 4))
    number = 0
    for k in range(rays.shape[0]):
        if math.isnan(outer[k]):
            continue
        shift = wedge_shift(step, outer[k] - inner, light[1]) if most_shift(step) > POINT_PX else 0.0
        points[number, 0] = rays[k, 0] + (outer[k] - shift) * rays[k, 2]
        points[number, 1] = rays[k, 1] + (outer[k] - shift) * rays[k, 3]
        points[number, 2] = off_ellipse(shape, points[number, 0], points[number, 1])
        points[number, 3] = DOUBT * shift
        number += 1
    return points[:number]


@compiled
def choose_points(points: Floats, base: float, corner: Floats, far: float) -> Floats:
    """The points of the wall that lie clear of the corner and of the sphere."""
    kept = np.empty_like(points)
    number = 0
    for k in range(points.shape[0]):
        away = math.hypot(points[k, 0] - corner[0], points[k, 1] - corner[1])
        if NEAR_PX < away < far and points[k, 2] - base > LEAST_OFF_PX:
            kept[number] = points[k]
            number += 1
    return kept[:number]


@compiled
def fit_wall(points: Floats, corner: Floats, bend: float) -> tuple[Floats, Floats, Floats, float]:
    """A parabola through the points: direction of the wall from the corner, coefficients, covariance, residual (px).

    Along the direction, from the corner, it lies ``c0 + c1 u + c2 u^2 / 2`` aside; ``bend`` is the prior of c2.
    """
    mx, my = np.mean(points[:, 0]), np.mean(points[:, 1])
    xx = np.sum((points[:, 0] - mx) ** 2)
    yy = np.sum((points[:, 1] - my) ** 2)
    xy = np.sum((points[:, 0] - mx) * (points[:, 1] - my))
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    along = np.array([math.cos(angle), math.sin(angle)])
    if (mx - corner[0]) * along[0] + (my - corner[1]) * along[1] < 0.0:
        along = -along
    normal, right, row = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - corner[0], points[k, 1] - corner[1]
        u, v = dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]
        row[0], row[1], row[2] = 1.0, u, 0.5 * u * u
        for i in range(3):
            right[i] += row[i] * v / POINT_PX**2
            for j in range(3):
                normal[i, j] += row[i] * row[j] / POINT_PX**2
    normal[2, 2] += 1.0 / bend**2
    if not factorise(normal):
        return along, right, normal, math.nan
    substitute(normal, right)
    left = 0.0
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - corner[0], points[k, 1] - corner[1]
        u, v = dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]
        left += (v - right[0] - right[1] * u - 0.5 * right[2] * u * u) ** 2
    residual = math.sqrt(left / max(1, points.shape[0] - 2))
    return along, right, invert_block(normal, 3, max(1.0, (residual / POINT_PX) ** 2)), residual


@compiled
def meet(shape: Floats, base: float, corner: Floats, along: Floats, wall: Floats) -> tuple[float, float]:
    """Where along the wall it meets the outline of the sphere (px), and the sine of the angle between them."""
    u, slope = 0.0, math.nan
    for _ in range(8):
        level = np.empty(2)
        for k in range(2):
            w = u + 0.1 * k
            v = wall[0] + wall[1] * w + 0.5 * wall[2] * w * w
            x, y = corner[0] + w * along[0] - v * along[1], corner[1] + w * along[1] + v * along[0]
            level[k] = off_ellipse(shape, x, y) - base
        slope = (level[1] - level[0]) / 0.1
        if not slope > 0.02:
            return math.nan, slope
        step = -level[0] / slope
        u += min(STEEPEST_STEP_PX, max(-STEEPEST_STEP_PX, step))
        if abs(step) < 0.005:
            break
    return u, slope


@compiled
def filling(shape: Floats, points: Floats, base: float, corner: Floats, along: Floats, wall: Floats) -> float:
    """How much farther the outline stays off the corner, px, than blur fills one between straight lines.

    What is more has been bent already out of sight: a wall that leaves the sphere by and by.
    """
    x, y = corner[0], corner[1]
    here = off_ellipse(shape, x, y)
    nx, ny = (off_ellipse(shape, x + 0.2, y) - here) / 0.2, (off_ellipse(shape, x, y + 0.2) - here) / 0.2
    norm = math.hypot(nx, ny)
    sine = (along[0] * nx + along[1] * ny) / norm
    cosine = (along[0] * ny - along[1] * nx) / norm
    cosine = cosine if nx < 0.0 else -cosine
    sharp = FILLED_PX * sine / max(0.2, 1.0 + cosine)
    deepest = 0.0
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        if math.hypot(dx, dy) > NEAR_PX + SPACING_PX:
            continue
        u, v = dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]
        aside = abs(v - wall[0] - wall[1] * u - 0.5 * wall[2] * u * u)
        deepest = max(deepest, min(aside, points[k, 2] - base))
    return float(max(0.0, deepest - 1.1 * sharp - POINT_PX))


@compiled
def carry_back(
    shape: Floats, points: Floats, base: tuple[float, float, float], corner: Floats, far: float
) -> tuple[float, float, float]:
    """Move ``corner`` in place to where the wall, seen out to ``far``, meets the sphere; row, uncertainty, residual.

    ``base`` is how far the edge of the sphere lies off the ellipse there, how well that is known, and its scatter.
    """
    nan = math.nan
    for turn in range(TURNS):
        kept = choose_points(points, base[0], corner, far)
        if kept.shape[0] < LEAST_POINTS:
            return nan, nan, nan
        along, wall, covariance, residual = fit_wall(kept, corner, BENT / shape[2])
        if not residual < max(MOST_RESIDUAL_PX, MOST_RESIDUAL * base[2]):
            return nan, nan, residual
        u, sine = meet(shape, base[0], corner, along, wall)
        if math.isnan(u):
            return nan, nan, residual
        powers = np.array([1.0, u, 0.5 * u * u])
        variance = base[1] ** 2 + np.mean(kept[:, 3]) ** 2
        for i in range(3):
            for j in range(3):
                variance += powers[i] * covariance[i, j] * powers[j]
        v = wall[0] + wall[1] * u + 0.5 * wall[2] * u * u
        dx, dy = u * along[0] - v * along[1], u * along[1] + v * along[0]
        corner[0] += dx
        corner[1] += dy
        row, unc = corner[1], math.sqrt(variance) / sine
        moved = math.hypot(dx, dy)
        if moved < SETTLED_PX or (turn == TURNS - 1 and moved < MOST_UNSETTLED_PX):
            unc = math.hypot(unc, moved)
            more = filling(shape, points, base[0], corner, along, wall)
            return row, math.hypot(math.hypot(unc, BLIND_PX * sine * sine), BENT_AWAY * more), residual
    return nan, nan, nan


@compiled
def find_corner(
    values: NDArray[np.float32],
    shape: Floats,
    outline: tuple[Floats, Floats, Floats],
    light: tuple[float, float],
) -> tuple[float, float, float]:
    """Row of the corner on one side, its uncertainty (px) and how it was seen.

    ``outline`` is its arc length, ray and departure from the bottom up, ``light`` as for `wall_points`.
    """
    length, path, off = outline
    found = first_departure(length, off)
    if found < 0:
        return math.nan, math.nan, NO_CORNER
    if found < LEAST_RAYS_BELOW:
        return math.nan, math.nan, TOO_SHORT
    middle, scatter, number = base_below(length, off, found)
    base = (middle, math.hypot(BASE_UNC_PX, scatter / math.sqrt(max(1, number))), scatter)
    points = wall_points(values, shape, slanted_rays(length, path, found), middle, light)
    corner = np.array([path[found, X], path[found, Y]])
    wider = corner.copy()
    row, unc, residual = carry_back(shape, points, base, corner, FIRST_FAR_PX)
    again, less, rest = carry_back(shape, points, base, wider, LAST_FAR_PX)
    change = abs(again - row)
    if math.isnan(again):
        unc *= TRUST_RANGE
    if math.isnan(row) or (less < unc and rest < max(0.1, 1.5 * residual)):
        row, unc, corner = again, less, wider
    if math.isnan(row):
        return math.nan, math.nan, NO_CORNER
    if not math.isnan(change):  # what no parabola follows moves the corner with the range
        unc = math.hypot(unc, change)
    nearest, at = math.inf, math.nan
    for n in range(length.size):
        away = math.hypot(path[n, X] - corner[0], path[n, Y] - corner[1])
        if away < nearest:
            nearest, at = away, length[n]
    if clings(length, off, at):
        return math.nan, math.nan, NO_CORNER
    return row, unc, SEEN
