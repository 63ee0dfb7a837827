"""The outermost dark-to-bright edge on some of many rays, for estimators that look only where they need to.

The same matched filter as in `edges`, at steps of one pixel along one line. The loops over the places on a ray are
simple and in single precision, so that the compiler turns them into vector instructions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.edges import KERNEL_REACH_PX, KERNEL_SIGMA_PX, sample_ray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

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
def outermost(response: Singles, first: int, last: int, least: float) -> float:
    """Where the response has its last peak of at least the height ``least``; NaN where it has none."""
    for n in range(last, first - 1, -1):
        here = response[n]
        if here >= least and here >= response[n - 1] and here > response[n + 1]:
            before, after = float(response[n - 1]), float(response[n + 1])
            return n + 0.5 * (before - after) / (before - 2.0 * here + after)
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
    width = values.shape[1]
    flat, next_row = values.reshape(-1), np.uint64(width)
    pixel, work = np.empty(size, np.int32), np.empty((4, size), np.float32)
    across, down, profile, response = work[0], work[1], work[2], work[3]
    for ray in range(which[0], which[1], which[2]):
        if found[ray, AT] != UNSEEN:
            continue
        x, y, dx, dy = rays[ray, 0], rays[ray, 1], rays[ray, 2], rays[ray, 3]
        first, last, masked = 0, size - 1, 1
        if lies_inside(values.shape, (x, y, dx, dy), near, near + last):
            column, row = np.float32(x + near * dx), np.float32(y + near * dy)
            right, below = np.float32(dx), np.float32(dy)
            for n in range(size):
                here, there = column + np.float32(n) * right, row + np.float32(n) * below
                j, i = np.int32(here), np.int32(there)
                across[n], down[n] = here - np.float32(j), there - np.float32(i)
                pixel[n] = i * width + j
            masked = 0
            for n in range(size):
                k = np.uint64(pixel[n])
                m = k + next_row
                upper = flat[k] + across[n] * (flat[k + np.uint64(1)] - flat[k])
                lower = flat[m] + across[n] * (flat[m + np.uint64(1)] - flat[m])
                profile[n] = upper + down[n] * (lower - upper)
            for n in range(size):
                masked += 1 if profile[n] != profile[n] else 0
        if masked > 0:
            first, last = sample_ray(values, rays[ray], -near, 1.0, 1, profile)
        found[ray, AT], found[ray, HEIGHT] = math.nan, 0.0
        if last - first < MARGIN:
            continue
        for n in range(places):
            response[n] = (
                ONE * (profile[n + 5] - profile[n + 3])
                + TWO * (profile[n + 6] - profile[n + 2])
                + THREE * (profile[n + 7] - profile[n + 1])
                + FOUR * (profile[n + 8] - profile[n])
            )
        first, last = max(1, first - MARGIN), min(places - 2, last + 1 - MARGIN)
        highest = np.float32(0.0)
        for n in range(first, last + 1):
            highest = max(highest, response[n])
        found[ray, HEIGHT] = highest
        if highest >= least:
            found[ray, AT] = inner + outermost(response, first, last, least)
