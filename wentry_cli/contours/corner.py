"""The corner that the cavity wall makes with the sphere on one flank of the silhouette.

Below it the outline is the ellipse, above it a wall that leaves at any angle. Blur fills the corner itself, so the
wall is followed from a few pixels away, along rays half-way between the normal of the ellipse and its tangent, and
carried back to the ellipse as a parabola.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.flank import SPACING_PX, Flank, off_outline
from wentry_cli.contours.leaving import base_below, clings, first_departure
from wentry_cli.contours.wall import POINT_PX, Point, choose_points, filling, fit_wall, meet, place_on, variance_at
from wentry_cli.contours.wedge import DOUBT, SLANTED, most_shift, wedge_shift, wedge_step
from wentry_cli.imaging.outer_edge import AT, UNSEEN, outer_edges

Floats = NDArray[np.float64]

SEEN, NO_CORNER, TOO_SHORT = 0, 1, 2
Corner = tuple[float, float, int]
LEAST_RAYS_BELOW = 7
BELOW_PX, ABOVE_PX, SLANTED_PX = 4.0, 20.0, 1.0
SLANTED_SPAN = (-4.0, 24)
FIRST_FAR_PX, LAST_FAR_PX = 8.0, 15.0
LEAST_POINTS = 5
# Curvature that a wall may have, over that of the sphere.
BENT = 0.5
MOST_RESIDUAL_PX, MOST_RESIDUAL, BASE_UNC_PX = 0.3, 3.0, 0.03
TURNS, SETTLED_PX, MOST_UNSETTLED_PX = 8, 0.05, 0.4
# A wall that is followed over the near range alone is believed less.
TRUST_RANGE = 3.0
# What a corner that is filled by more than blur may hide of the wall.
BENT_AWAY = 5.0
# Where the wall leaves at a right angle, what happens within the blur is not seen at all.
BLIND_PX = 0.4


@compiled
def slanted_rays(path: Floats, found: int) -> Floats:
    """Rays (x, y, direction) from the ellipse about ray ``found``, half-way between outwards and downwards."""
    rays = np.empty((int((BELOW_PX + ABOVE_PX) / SLANTED_PX) + 1, 4))
    number = 0
    for k in range(rays.shape[0]):
        at = found + (k * SLANTED_PX - BELOW_PX) / SPACING_PX
        n = math.floor(at)
        if n < 0 or n + 1 >= path.shape[0]:
            continue
        share = at - n
        nx = path[n, 2] + share * (path[n + 1, 2] - path[n, 2])
        ny = path[n, 3] + share * (path[n + 1, 3] - path[n, 3])
        turn = 1.0 if (path[n, 0] - path[n + 1, 0]) * ny - (path[n, 1] - path[n + 1, 1]) * nx > 0.0 else -1.0
        norm = math.sqrt(2.0 * (nx * nx + ny * ny))
        rays[number, 0] = path[n, 0] + share * (path[n + 1, 0] - path[n, 0])
        rays[number, 1] = path[n, 1] + share * (path[n + 1, 1] - path[n, 1])
        rays[number, 2], rays[number, 3] = (nx + turn * ny) / norm, (ny - turn * nx) / norm
        number += 1
    return rays[:number]


@compiled
def wall_points(flank: Flank, rays: Floats, base: float, blur: float) -> Floats:
    """The outermost strong edge on each ray, rows of (x, y, how far off the outline, doubt in px).

    ``base`` is how far the edge of the sphere lies off the ellipse.
    """
    found = np.full((rays.shape[0], 2), UNSEEN)
    outer_edges(flank.values, rays, (0, rays.shape[0], 1), SLANTED_SPAN, flank.least, found)
    outer = found[:, AT]
    inner = SLANTED * base
    step = wedge_step(flank.values, rays, inner, outer, blur)
    pulls = most_shift(step) > POINT_PX
    shape, tilt = flank.shape, flank.tilt
    points = np.empty((rays.shape[0], 4))
    number = 0
    for k in range(rays.shape[0]):
        if math.isnan(outer[k]):
            continue
        shift = wedge_shift(step, outer[k] - inner, blur) if pulls else 0.0
        points[number, 0] = rays[k, 0] + (outer[k] - shift) * rays[k, 2]
        points[number, 1] = rays[k, 1] + (outer[k] - shift) * rays[k, 3]
        points[number, 2] = off_outline(shape, tilt, points[number, 0], points[number, 1])[0]
        points[number, 3] = DOUBT * shift
        number += 1
    return points[:number]


@compiled
def carry_back(
    flank: Flank, points: Floats, base: tuple[float, float, float], start: Point, far: float
) -> tuple[Point, float, float]:
    """Where the wall, seen out to ``far`` px from it, meets the sphere; its uncertainty and the residual of the wall.

    ``base`` is how far the edge of the sphere lies off the outline there, how well that is known, and its scatter.
    """
    shape, tilt, x, y = flank.shape, flank.tilt, start[0], start[1]
    kept = np.empty(points.shape)
    for turn in range(TURNS):
        number = choose_points(points, base[0], (x, y), far, kept)
        if number < LEAST_POINTS:
            break
        wall = fit_wall(kept, number, BENT / shape[2])
        if not wall.residual < max(MOST_RESIDUAL_PX, MOST_RESIDUAL * base[2]):
            break
        u, sine = meet(shape, tilt, base[0], (x, y), wall)
        if math.isnan(u):
            break
        dx, dy = place_on(wall, u)
        x, y, moved = x + dx, y + dy, math.hypot(dx, dy)
        if moved < SETTLED_PX or (turn == TURNS - 1 and moved < MOST_UNSETTLED_PX):
            _, nx, ny = off_outline(shape, tilt, x, y)
            more = filling(points, base[0], (nx, ny), (x, y), wall)
            along = (base[1] ** 2 + variance_at(wall, u)) / sine**2 + moved**2
            unc = math.sqrt(along + (BLIND_PX * sine * sine) ** 2 + (BENT_AWAY * more) ** 2)
            return (x, y), unc, wall.residual
    return (math.nan, math.nan), math.nan, math.nan


@compiled
def nearest_ray(path: Floats, corner: Point) -> int:
    """The ray that begins next to a corner."""
    nearest, at = math.inf, 0
    for n in range(path.shape[0]):
        square = (path[n, 0] - corner[0]) ** 2 + (path[n, 1] - corner[1]) ** 2
        if square < nearest:
            nearest, at = square, n
    return at


@compiled
def find_corner(flank: Flank, blur: float) -> Corner:
    """Row of the corner on a flank, its uncertainty (px) and how it was seen."""
    path = flank.path
    found = first_departure(flank)
    if found < 0:
        return math.nan, math.nan, NO_CORNER
    if found < LEAST_RAYS_BELOW:
        return math.nan, math.nan, TOO_SHORT
    middle, scatter, number = base_below(flank, found)
    base = (middle, math.hypot(BASE_UNC_PX, scatter / math.sqrt(max(1, number))), scatter)
    points = wall_points(flank, slanted_rays(path, found), middle, blur)
    start = (path[found, 0], path[found, 1])
    corner, unc, residual = carry_back(flank, points, base, start, FIRST_FAR_PX)
    wider, less, rest = carry_back(flank, points, base, start if math.isnan(unc) else corner, LAST_FAR_PX)
    change = abs(wider[1] - corner[1])
    if math.isnan(less):
        unc *= TRUST_RANGE
    elif math.isnan(unc) or (less < unc and rest < max(0.1, 1.5 * residual)):
        corner, unc = wider, less
    if math.isnan(unc) or clings(flank, nearest_ray(path, corner)):
        return math.nan, math.nan, NO_CORNER
    # what no parabola follows moves the corner with the range
    return corner[1], unc if math.isnan(change) else math.hypot(unc, change), SEEN
