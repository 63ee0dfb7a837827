"""The outermost dark-to-bright edge on some of many rays, for estimators that look only where they need to.

The same matched filter as in `edges`, at steps of one pixel along one line. The loops over the places on a ray are
simple and in single precision, so that the compiler turns them into vector instructions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.edges import KERNEL_REACH_PX, KERNEL_SIGMA_PX, peak_between, rounder_than_parabola
from wentry_cli.imaging.ray_profiles import sample_ray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int32]

# Columns of what is found on a ray; `UNSEEN` where it has not been looked along.
AT, HEIGHT = 0, 1
UNSEEN = -math.inf
MARGIN = int(KERNEL_REACH_PX)
# The outer half of `edge_kernel` at unit steps; the inner half is the same with the opposite sign.
SLOPES = [s * math.exp(-0.5 * (s / KERNEL_SIGMA_PX) ** 2) for s in range(1, MARGIN + 1)]
ONE, TWO, THREE, FOUR = (np.float32(slope / sum(SLOPES)) for slope in SLOPES)
# Samples keep so far off the border of the picture, beyond what single precision may move them by.
BORDER_PX = 0.01


@compiled
def lies_inside(shape: tuple[int, int], ray: tuple[float, float, float, float], near: float, far: float) -> bool:
    """Whether a ray (x, y, direction) lies within an image of ``shape`` from ``near`` to ``far`` px."""
    x, y, dx, dy = ray
    columns, rows = shape[1] - 1.0 - BORDER_PX, shape[0] - 1.0 - BORDER_PX
    ends_inside = BORDER_PX <= x + near * dx < columns and BORDER_PX <= y + near * dy < rows
    return ends_inside and BORDER_PX <= x + far * dx < columns and BORDER_PX <= y + far * dy < rows


@compiled
def read_line(
    flat: Singles, width: int, line: tuple[float, float, float, float], pixel: Ints, parts: Singles, profile: Singles
) -> bool:
    """Fill in the profile along a line (x, y, direction) within a picture; False where a sample is masked.

    ``pixel`` and the rows of ``parts`` are for what is looked up and how it is shared out, place by place.
    """
    column, row, right, below = np.float32(line[0]), np.float32(line[1]), np.float32(line[2]), np.float32(line[3])
    across, down = parts[0], parts[1]
    for n in range(profile.size):
        x, y = column + np.float32(n) * right, row + np.float32(n) * below
        j, i = np.int32(x), np.int32(y)
        across[n], down[n] = x - np.float32(j), y - np.float32(i)
        pixel[n] = i * width + j
    for n in range(profile.size):
        k, m = np.uint64(pixel[n]), np.uint64(pixel[n]) + np.uint64(width)
        upper = flat[k] + across[n] * (flat[k + np.uint64(1)] - flat[k])
        lower = flat[m] + across[n] * (flat[m + np.uint64(1)] - flat[m])
        profile[n] = upper + down[n] * (lower - upper)
    masked = 0
    for n in range(profile.size):
        masked += 1 if profile[n] != profile[n] else 0
    return masked == 0


@compiled
def respond(profile: Singles, response: Singles) -> None:
    """Fill in what the matched filter says of a profile that goes on by its margin on both sides."""
    for n in range(response.size):
        response[n] = (
            ONE * (profile[n + 5] - profile[n + 3])
            + TWO * (profile[n + 6] - profile[n + 2])
            + THREE * (profile[n + 7] - profile[n + 1])
            + FOUR * (profile[n + 8] - profile[n])
        )


@compiled
def outermost(response: Singles, first: int, last: int, least: float) -> float:
    """Where the response has its last peak of at least the height ``least``; NaN where it has none."""
    rounder = rounder_than_parabola(1.0, KERNEL_SIGMA_PX)
    for n in range(last, first - 1, -1):
        here = response[n]
        if here >= least and here >= response[n - 1] and here > response[n + 1]:
            return n + peak_between(float(response[n - 1]), float(here), float(response[n + 1]), rounder)
    return math.nan


@compiled
def outer_edges(
    values: Singles, rays: Floats, which: tuple[int, int, int], span: tuple[float, int], least: float, found: Floats
) -> None:
    """Fill in place and height of the edges on the rays (x, y, direction, ...) that are `UNSEEN` yet.

    ``which`` are the first, the end and the step of the rays; ``span`` is from where outwards, and at how many places,
    an edge is looked for. The place (px along the ray, NaN where there is none) is that of the outermost edge at least
    ``least`` high, the height that of the highest.
    """
    inner, places = span
    near, size = inner - MARGIN, places + 2 * MARGIN
    flat, pixel, parts = values.reshape(-1), np.empty(size, np.int32), np.empty((2, size), np.float32)
    profile, response = np.empty(size, np.float32), np.empty(places, np.float32)
    for ray in range(which[0], which[1], which[2]):
        if found[ray, AT] != UNSEEN:
            continue
        found[ray, AT], found[ray, HEIGHT] = math.nan, 0.0
        x, y, dx, dy = rays[ray, 0], rays[ray, 1], rays[ray, 2], rays[ray, 3]
        first, last = 0, size - 1
        inside = lies_inside(values.shape, (x, y, dx, dy), near, near + last)
        line = (x + near * dx, y + near * dy, dx, dy)
        if not (inside and read_line(flat, values.shape[1], line, pixel, parts, profile)):
            first, last = sample_ray(values, rays[ray], -near, 1.0, 1, profile)
            if last - first < MARGIN:
                continue
        respond(profile, response)
        first, last = max(1, first - MARGIN), min(places - 2, last + 1 - MARGIN)
        highest = np.float32(0.0)
        for n in range(first, last + 1):
            highest = max(highest, response[n])
        found[ray, HEIGHT] = highest
        if highest >= least:
            found[ray, AT] = inner + outermost(response, first, last, least)
