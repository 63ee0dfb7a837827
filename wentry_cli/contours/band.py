"""The pixels in a narrow band about the ellipse: signed distance to the edge, sector and grey level."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import sector_of, semi_axes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
    rounds = 1 if 0.45 < a / b < 2.2 else 3
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
def row_span(shape: Floats, a: float, b: float, dy: float) -> tuple[float, float]:
    """Columns (relative to the centre) between which a row cuts the ellipse of axes a, b; empty: (1, -1)."""
    if a <= 0.0 or b <= 0.0:
        return 1.0, -1.0
    c, s = math.cos(shape[4]), math.sin(shape[4])
    square = (c / a) ** 2 + (s / b) ** 2
    cross = dy * c * s * (1.0 / (b * b) - 1.0 / (a * a))
    constant = dy * dy * ((s / a) ** 2 + (c / b) ** 2) - 1.0
    inside = cross * cross - square * constant
    if inside <= 0.0:
        return 1.0, -1.0
    root = math.sqrt(inside)
    return (-cross - root) / square, (-cross + root) / square


@compiled
def collect_band(
    values: NDArray[np.float32], shape: Floats, count: int, table: Floats, limits: Floats
) -> tuple[Floats, Ints, int]:
    """Distances and grey levels (n, 2), sectors (n), and the number of masked pixels met in the band.

    ``limits`` holds the inner and outer half-width of the band (px), the top row that may be used, and the level that
    masked pixels outside of the edge are taken to have (NaN: they are left out).
    """
    a, b = semi_axes(shape)
    inner, outer = limits[0], limits[1]
    rows, columns = values.shape
    c, s = math.cos(shape[4]), math.sin(shape[4])
    reach = math.sqrt((a * s) ** 2 + (b * c) ** 2) + outer
    first = math.ceil(max(0.0, limits[2], shape[1] - reach))
    last = math.floor(min(rows - 1.0, shape[1] + reach))
    room = int(8.0 * (a + b + 2.0 * outer) * (inner + outer + 2.0)) + 64
    pixels = np.empty((room, 2))
    sectors = np.empty(room, dtype=np.int64)
    number, masked = 0, 0
    for row in range(first, last + 1):
        dy = row - shape[1]
        left, right = row_span(shape, a + outer + 0.3, b + outer + 0.3, dy)
        if left > right:
            continue
        hole_left, hole_right = row_span(shape, a - 1.3 * inner, b - 1.3 * inner, dy)
        column = math.ceil(max(0.0, shape[0] + left))
        end = math.floor(min(columns - 1.0, shape[0] + right))
        while column <= end:
            dx = column - shape[0]
            if hole_left < dx < hole_right:
                column = math.ceil(shape[0] + hole_right)
                if column > end:
                    break
                dx = column - shape[0]
            level = float(values[row, column])
            column += 1
            distance, tx, ty = ellipse_distance(a, b, dx * c - dy * s, dx * s + dy * c)
            if not (-inner <= distance <= outer):
                continue
            if math.isnan(level):
                masked += 1
                level = limits[3] if distance > 0.0 else math.nan
                if math.isnan(level):
                    continue
            if number == room:
                break
            pixels[number, 0], pixels[number, 1] = distance, level
            sectors[number] = sector_of(tx, ty, count, table)
            number += 1
    return pixels[:number], sectors[:number], masked
