"""The two flanks of a silhouette: rays along the normals of the ellipse from its lowest point up, equally spaced.

A ray is looked along only where something asks for it: most of the outline lies on the sphere, and says so on few.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import departure_at, semi_axes
from wentry_cli.contours.band import ellipse_distance
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.outer_edge import AT, HEIGHT, UNSEEN, outer_edges

Floats = NDArray[np.float64]

SPACING_PX = 1.5
# The edge is looked for from here along a ray, at so many places.
SPAN = (-4.0, 16)
# Every eighth ray of the lower half tells how high the edge of the sphere is; so much of it counts as an edge.
SPARSE, STRONG = 8, 0.4


class Flank(NamedTuple):
    """One flank in a picture: rays (x, y, normal) along its ``path`` on the outline, and what was ``found`` on them.

    That is how far (px) outside of the outline the outermost edge of at least the height ``least`` lies, as `AT` of
    `outer_edges`: NaN where there is none, `UNSEEN` where nobody asked yet.
    """

    values: NDArray[np.float32]
    shape: Floats
    tilt: tuple[float, float]
    path: Floats
    found: Floats
    least: float


@compiled
def off_outline(shape: Floats, tilt: tuple[float, float], x: float, y: float) -> tuple[float, float, float]:
    """Signed distance of a point from the outline, px, and the direction in which it grows."""
    a, b = semi_axes(shape)
    c, s = tilt
    dx, dy = x - shape[0], y - shape[1]
    distance, cosine, sine = ellipse_distance(a, b, dx * c - dy * s, dx * s + dy * c)
    speed = math.sqrt(a * a * sine * sine + b * b * cosine * cosine)
    if shape.size > 5:
        distance -= a * b / speed * departure_at(shape, cosine, sine)
    nu, nv = b * cosine / speed, a * sine / speed
    return distance, nu * c + nv * s, nv * c - nu * s


@compiled
def lay_ray(path: Floats, n: int, shape: Floats, tilt: tuple[float, float], place: tuple[float, float]) -> None:
    """Fill in the ray on the outline at an eccentric angle, of which ``place`` is the cosine and the sine."""
    a, b = semi_axes(shape)
    c, s = tilt
    cosine, sine = place
    slowness = 1.0 / math.sqrt(a * a * sine * sine + b * b * cosine * cosine)
    u, v, nu, nv = a * cosine, b * sine, b * cosine * slowness, a * sine * slowness
    if shape.size > 5:
        away = a * b * slowness * departure_at(shape, cosine, sine)
        u, v = u + away * nu, v + away * nv
    path[n, 0], path[n, 1] = shape[0] + u * c + v * s, shape[1] - u * s + v * c
    path[n, 2], path[n, 3] = nu * c + nv * s, nv * c - nu * s


@compiled
def step_on(a: float, b: float, place: tuple[float, float], step: float) -> tuple[float, float]:
    """Cosine and sine of the eccentric angle ``step`` px further along an ellipse."""
    cosine, sine = place
    slowness = 1.0 / math.sqrt(a * a * sine * sine + b * b * cosine * cosine)
    turn = step * slowness
    # by the speed half a step ahead
    turn *= 1.0 - 0.5 * turn * (a * a - b * b) * sine * cosine * slowness * slowness
    square = turn * turn
    ahead, aside = 1.0 - square * (0.5 - square / 24.0), turn * (1.0 - square * (1.0 - square / 20.0) / 6.0)
    return ahead * cosine - aside * sine, ahead * sine + aside * cosine


@compiled
def walk(shape: Floats, tilt: tuple[float, float]) -> tuple[Floats, Floats]:
    """Rays from the lowest point to the highest on the left and on the right, see `Flank`.

    On both at once: the steps of one side wait for each other, those of the two sides do not.
    """
    a, b = semi_axes(shape)
    half = 0.5 * math.pi * (3.0 * (a + b) - math.sqrt((3.0 * a + b) * (a + 3.0 * b)))
    number = max(2, int(half / SPACING_PX))
    left, right = np.empty((number, 4)), np.empty((number, 4))
    norm = math.hypot(a * tilt[1], b * tilt[0])
    one = (-a * tilt[1] / norm, b * tilt[0] / norm)
    other = one
    for n in range(number):
        lay_ray(left, n, shape, tilt, one)
        lay_ray(right, n, shape, tilt, other)
        one, other = step_on(a, b, one, SPACING_PX), step_on(a, b, other, -SPACING_PX)
    return left, right


@compiled
def usual_height(values: NDArray[np.float32], left: Floats, right: Floats) -> float:
    """Median height of the edge on the lower half of the sphere, as far as it is in the picture, by a few rays."""
    number = (left.shape[0] // 2 + SPARSE - 1) // SPARSE
    rays, found = np.empty((2 * number, 4)), np.full((2 * number, 2), UNSEEN)
    for k in range(number):
        for column in range(4):
            rays[2 * k, column], rays[2 * k + 1, column] = left[SPARSE * k, column], right[SPARSE * k, column]
    outer_edges(values, rays, (0, 2 * number, 1), SPAN, math.inf, found)
    heights, seen = np.empty(2 * number), 0
    for k in range(2 * number):
        if found[k, HEIGHT] > 0.0:
            heights[seen] = found[k, HEIGHT]
            seen += 1
    return median_of(heights, seen)


@compiled
def both_flanks(values: NDArray[np.float32], shape: Floats) -> tuple[Flank, Flank]:
    """The left and the right flank of an outline (a parameter vector) in a picture; nobody has looked at them yet."""
    tilt = (math.cos(shape[4]), math.sin(shape[4]))
    left, right = walk(shape, tilt)
    least = STRONG * usual_height(values, left, right)
    one, other = np.full((left.shape[0], 2), UNSEEN), np.full((right.shape[0], 2), UNSEEN)
    return Flank(values, shape, tilt, left, one, least), Flank(values, shape, tilt, right, other, least)


@compiled
def see(flank: Flank, first: int, stop: int, step: int) -> None:
    """Look along the rays from ``first`` to before ``stop``, as far as there are any and nobody has."""
    found = flank.found
    first, stop = max(0, first), min(stop, found.shape[0])
    for n in range(first, stop, step):
        if found[n, AT] == UNSEEN:
            outer_edges(flank.values, flank.path, (n, stop, step), SPAN, flank.least, found)
            return
