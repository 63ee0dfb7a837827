"""The pixels in a narrow band about the ellipse, sector by sector: signed distance to the edge and grey level."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import arc_geometry, quadrant_table, sector_angles, sector_at, semi_axes
from wentry_cli.contours.plateau import PLATEAU_PX, sum_plateaus

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Sectors of an outline that is hidden in part are smaller: what hides them costs less.
SECTOR_PX, SMALL_SECTOR_PX = 4.0, 3.0
SECTOR_ANGLE = math.radians(40.0)
# The band of the edge ends where its blur does, so many standard deviations away.
REACH_SIGMA, LEAST_BLUR = 4.2, 1.0


class Band(NamedTuple):
    """Pixels about the outline ``shape``, sector by sector, where each sector starts, and what the scene is like.

    ``places`` says where in the patch, read line by line, a pixel is. ``plateaus`` are the moments of what lies beyond
    them (see `plateau`), ``width`` is that of the band, px, and ``fewest`` the pixels that a sector must have.
    ``scene`` holds centre (x, y), radius and motion (x, y); ``settings`` the top row, the motion (x, y), the ceiling,
    1 where outliers lie outside only, and 1 where much of the outline is hidden.
    """

    shape: Floats
    pixels: Floats
    starts: Ints
    places: Ints
    plateaus: Floats
    rows: Floats
    scene: Floats
    settings: Floats
    width: float
    fewest: float


@compiled
def distance_rounds(a: float, b: float) -> int:
    """Steps after which the distance from an ellipse is good: one suffices where it is not far from round."""
    return 1 if 0.45 < a / b < 2.2 else 3


@compiled
def ellipse_distance(a: float, b: float, u: float, v: float) -> tuple[float, float, float]:
    """Signed distance (outside positive) of (u, v) from the ellipse, and the direction of its eccentric angle.

    The distance to the circle of curvature at the point below; its error is of third order in the error of that
    point (after A. Stephens' iteration through the evolute). NaN beyond the centre of curvature.
    """
    p, q = abs(u), abs(v)
    tx, ty = p / a, q / b
    norm = math.sqrt(tx * tx + ty * ty) + 1e-300
    tx, ty = tx / norm, ty / norm
    c2 = a * a - b * b
    rounds = distance_rounds(a, b)
    distance = 0.0
    for turn in range(rounds):
        ex, ey = c2 * tx * tx * tx / a, -c2 * ty * ty * ty / b
        rx, ry = a * tx - ex, b * ty - ey
        qx, qy = p - ex, q - ey
        if qx * rx + qy * ry <= 0.0:
            return math.nan, tx, ty
        rho, away = math.sqrt(rx * rx + ry * ry), math.sqrt(qx * qx + qy * qy)
        distance = away - rho
        if turn + 1 < rounds:
            tx = max(0.0, (qx * rho / away + ex) / a)
            ty = max(0.0, (qy * rho / away + ey) / b)
            norm = math.sqrt(tx * tx + ty * ty) + 1e-300
            tx, ty = tx / norm, ty / norm
    return distance, math.copysign(tx, u), math.copysign(ty, v)


@compiled
def row_span(tilt: tuple[float, float], a: float, b: float, dy: float) -> tuple[float, float]:
    """Columns (relative to the centre) between which a row cuts the ellipse of axes a, b; empty: (1, -1).

    ``tilt`` is its cosine and sine.
    """
    if a <= 0.0 or b <= 0.0:
        return 1.0, -1.0
    c, s = tilt
    square = (c / a) ** 2 + (s / b) ** 2
    cross = dy * c * s * (1.0 / (b * b) - 1.0 / (a * a))
    constant = dy * dy * ((s / a) ** 2 + (c / b) ** 2) - 1.0
    inside = cross * cross - square * constant
    if inside <= 0.0:
        return 1.0, -1.0
    root = math.sqrt(inside)
    return (-cross - root) / square, (-cross + root) / square


@compiled
def runs_of_band(shape: Floats, limits: Floats, size: tuple[int, int]) -> tuple[Ints, int]:
    """Row, first column and end of the runs of pixels that hold the band, and how many pixels there are.

    ``limits`` as in `collect_band`. The runs are a little longer than the band is wide, and leave out what is well
    inside of it.
    """
    a, b = semi_axes(shape)
    inner, outer = limits[0], limits[1]
    c, s = math.cos(shape[4]), math.sin(shape[4])
    reach = math.sqrt((a * s) ** 2 + (b * c) ** 2) + outer
    first = math.ceil(max(0.0, limits[2], shape[1] - reach))
    last = math.floor(min(size[0] - 1.0, shape[1] + reach))
    runs = np.empty((2 * max(0, last - first + 1), 3), dtype=np.int64)
    number, total = 0, 0
    for row in range(first, last + 1):
        dy = row - shape[1]
        left, right = row_span((c, s), a + outer + 0.3, b + outer + 0.3, dy)
        if left > right:
            continue
        begin = math.ceil(max(0.0, shape[0] + left))
        end = math.floor(min(size[1] - 1.0, shape[0] + right)) + 1
        stop, again = end, end
        hole_left, hole_right = row_span((c, s), a - 1.3 * inner, b - 1.3 * inner, dy)
        if hole_left < hole_right:
            stop = min(end, math.floor(shape[0] + hole_left) + 1)
            again = max(begin, stop, math.ceil(shape[0] + hole_right))
        for here, there in ((begin, stop), (again, end)):
            if here < there:
                runs[number, 0], runs[number, 1], runs[number, 2] = row, here, there
                number += 1
                total += there - here
    return runs[:number], total


@compiled
def read_runs(
    values: NDArray[np.float32], shape: Floats, runs: Ints, across: Floats, along: Floats, levels: Floats
) -> None:
    """Fill in where the pixels of the runs lie in the frame of the ellipse, and their grey levels."""
    c, s = math.cos(shape[4]), math.sin(shape[4])
    number = 0
    for k in range(runs.shape[0]):
        row, begin, end = runs[k, 0], runs[k, 1], runs[k, 2]
        line = values[row, begin:end]
        dy = row - shape[1]
        for m in range(end - begin):
            dx = begin + m - shape[0]
            across[number + m] = dx * c - dy * s
            along[number + m] = dx * s + dy * c
            levels[number + m] = line[m]
        number += end - begin


@compiled
def ellipse_distances(a: float, b: float, across: Floats, along: Floats, distance: Floats, share: Floats) -> None:
    """`ellipse_distance` of many points, and the pseudo-angle (see `quadrant_table`) of the point of the ellipse below.

    The angle of the pixel itself is not good enough: at oblique places it drifts off with the distance, and motion
    would smear the inner pixels of a sector otherwise than the outer ones. Without a branch in the loops the compiler
    turns them into vector instructions.
    """
    c2, by_a, by_b = a * a - b * b, 1.0 / a, 1.0 / b
    cosine, sine = np.empty(across.size), np.empty(across.size)
    for n in range(across.size):
        cosine[n], sine[n], distance[n] = abs(across[n]) * by_a, abs(along[n]) * by_b, 0.0
    for _ in range(distance_rounds(a, b)):
        for n in range(across.size):
            tx, ty = cosine[n], sine[n]
            norm = 1.0 / (math.sqrt(tx * tx + ty * ty) + 1e-300)
            tx, ty = tx * norm, ty * norm
            ex, ey = c2 * by_a * tx * tx * tx, -c2 * by_b * ty * ty * ty
            rx, ry = a * tx - ex, b * ty - ey
            qx, qy = abs(across[n]) - ex, abs(along[n]) - ey
            rho, away = math.sqrt(rx * rx + ry * ry), math.sqrt(qx * qx + qy * qy)
            lost = (qx * rx + qy * ry <= 0.0) | math.isnan(distance[n])
            distance[n] = math.nan if lost else away - rho
            ratio = rho / away
            tx, ty = (qx * ratio + ex) * by_a, (qy * ratio + ey) * by_b
            cosine[n], sine[n] = tx if tx > 0.0 else 0.0, ty if ty > 0.0 else 0.0
    for n in range(across.size):
        share[n] = sine[n] / (cosine[n] + sine[n] + 1e-300)


@compiled
def collect_band(
    values: NDArray[np.float32], shape: Floats, count: int, table: Floats, limits: Floats
) -> tuple[Floats, Ints, Ints]:
    """Distances and grey levels (2, n) sector by sector, where each sector starts, and where in ``values`` they are.

    ``limits`` holds the inner and outer half-width of the band (px), the top row that may be used, and the level that
    masked pixels outside of the edge are taken to have (NaN: they are left out).
    """
    a, b = semi_axes(shape)
    runs, total = runs_of_band(shape, limits, values.shape)
    across, along, levels = np.empty(total), np.empty(total), np.empty(total)
    read_runs(values, shape, runs, across, along, levels)
    distance, share = np.empty(total), np.empty(total)
    ellipse_distances(a, b, across, along, distance, share)
    sectors = np.full(total, -1)
    starts = np.zeros(4 * count + 1, dtype=np.int64)
    for n in range(total):
        if not (-limits[0] <= distance[n] <= limits[1]):
            continue
        if math.isnan(levels[n]):
            levels[n] = limits[3] if distance[n] > 0.0 else math.nan
            if math.isnan(levels[n]):
                continue
        sectors[n] = sector_at(share[n], across[n] >= 0.0, along[n] >= 0.0, count, table)
        starts[sectors[n] + 1] += 1
    for k in range(4 * count):
        starts[k + 1] += starts[k]
    pixels, filled = np.empty((2, starts[4 * count])), starts.copy()
    places = np.empty(starts[4 * count], dtype=np.int64)
    n = 0
    for k in range(runs.shape[0]):
        first = runs[k, 0] * values.shape[1] + runs[k, 1]
        for m in range(runs[k, 2] - runs[k, 1]):
            if sectors[n] >= 0:
                place = filled[sectors[n]]
                filled[sectors[n]] += 1
                pixels[0, place], pixels[1, place], places[place] = distance[n], levels[n], first + m
            n += 1
    return pixels, starts, places


@compiled
def reach_of(ln_blur: float) -> float:
    """Half-width of the band that an edge of this blur fills, px."""
    return REACH_SIGMA * max(LEAST_BLUR, math.exp(ln_blur))


@compiled
def gather_band(
    values: NDArray[np.float32], shape: Floats, settings: Floats, reach: float, masked: float, fewest: float
) -> Band:
    """Cut the outline of ``shape`` into sectors and collect the pixels within ``reach`` (px) of it.

    ``masked`` is the level that masked pixels outside of the edge are taken to have; NaN leaves them out.
    Sectors with less than ``fewest`` pixels are left out.
    """
    a, b = semi_axes(shape)
    count, table = quadrant_table(a, b, SMALL_SECTOR_PX if settings[5] > 0.0 else SECTOR_PX, SECTOR_ANGLE)
    rows = arc_geometry(shape, sector_angles(count, table))
    motion = 0.5 * math.hypot(settings[1], settings[2])
    limits = np.array([min(reach + motion, 0.5 * min(a, b)), reach + motion, settings[0], masked])
    pixels, starts, places = collect_band(values, shape, count, table, limits)
    # outside of a sphere seen from above stands the splash ring; levels do not tell where the edge of clipped light is
    clipped = settings[3] < math.inf
    far = 0.0 if settings[4] > 0.0 or clipped else limits[1] + PLATEAU_PX
    deep = 0.0 if clipped else min(limits[0] + PLATEAU_PX, 0.5 * min(a, b))
    plateaus = sum_plateaus(values, rows, starts, (limits[0], deep), (limits[1], far), settings[0], fewest)
    scene = np.array([shape[0], shape[1], shape[2], settings[1], settings[2]])
    return Band(shape.copy(), pixels, starts, places, plateaus, rows, scene, settings, limits[0] + limits[1], fewest)
