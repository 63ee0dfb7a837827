"""Bilinear profiles of a picture along rays: all rays at once, and one by one where a picture ends or has holes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Profile = NDArray[np.floating[Any]]
Ints = NDArray[np.int32]

# Masked samples behind one brighter than this are taken to be clipped ground, whose transmission is 1.
BRIGHT = 0.22


@compiled
def ray_is_inside(shape: tuple[int, int], ray: Floats, reach: float, aside: float) -> bool:
    """Whether both ends of a ray of lines keep clear of the border of an image of ``shape``."""
    for end in (-1.0, 1.0):
        column, row = ray[0] + end * reach * ray[2], ray[1] + end * reach * ray[3]
        if not (aside <= column < shape[1] - 1.0 - aside and aside <= row < shape[0] - 1.0 - aside):
            return False
    return True


@compiled
def sample_ray(
    values: NDArray[np.float32], ray: Floats, reach: float, step: float, lines: int, profile: Profile
) -> tuple[int, int]:
    """Fill ``profile`` from -reach outwards along one ray, averaged over parallel lines 1 px apart.

    Masked samples take the nearest valid value on the inner side (or the first valid one), and the ground's 1 behind
    bright ones. Returns the first and last valid index, (0, -1) where there is none.
    """
    first, last, held = -1, -1, math.nan
    lowest, farthest = values.shape[0] - 1.0, values.shape[1] - 1.0
    for n in range(profile.size):
        along = n * step - reach
        total = 0.0
        for line in range(lines):
            aside = line - 0.5 * (lines - 1)
            column = ray[0] + along * ray[2] - aside * ray[3]
            row = ray[1] + along * ray[3] + aside * ray[2]
            if not (0.0 <= column <= farthest and 0.0 <= row <= lowest):
                total = math.nan
                continue
            i, j = np.uint32(min(row, lowest - 1.0)), np.uint32(min(column, farthest - 1.0))
            fy, fx = row - i, column - j
            upper = values[i, j] + fx * (values[i, j + np.uint32(1)] - values[i, j])
            below = i + np.uint32(1)
            lower = values[below, j] + fx * (values[below, j + np.uint32(1)] - values[below, j])
            total += upper + fy * (lower - upper)
        if math.isnan(total):
            profile[n] = max(1.0, held) if held > BRIGHT else held
            continue
        held = total / lines
        profile[n] = held
        if first < 0:
            first = n
        last = n
    if first < 0:
        return 0, -1
    for n in range(first):
        profile[n] = profile[first]
    return first, last


@compiled
def place_lines(rays: Floats, inside: NDArray[np.bool_], reach: float, step: float, starts: Singles) -> None:
    """Fill in where parallel lines 1 px apart begin and how they go on (x, y and their steps to the next place).

    The columns are those of the first lines of all rays, then of the second. Rays that are not ``inside`` stay at a
    corner of the picture.
    """
    number = rays.shape[0]
    lines = starts.shape[1] // number
    for k in range(number):
        seen = 1.0 if inside[k] else 0.0
        right, down = seen * rays[k, 2], seen * rays[k, 3]
        x = seen * rays[k, 0] - reach * right + 0.5 * (lines - 1) * down
        y = seen * rays[k, 1] - reach * down - 0.5 * (lines - 1) * right
        for line in range(lines):
            column = np.uint64(line * number + k)
            starts[0, column], starts[1, column] = x - line * down, y + line * right
            starts[2, column], starts[3, column] = step * right, step * down


@compiled
def sample_lines(values: Singles, starts: Singles, place: int, parts: Singles, pixel: Ints, samples: Singles) -> None:
    """Bilinear samples at one place on all lines.

    ``pixel`` and the rows of ``parts`` are for what is looked up and how it is shared out. The loops go over lines
    and make no views, so that the compiler turns what it can into vector instructions.
    """
    flat, width, away = values.reshape(-1), np.int32(values.shape[1]), np.float32(place)
    for k in range(pixel.size):
        x, y = starts[0, k] + away * starts[2, k], starts[1, k] + away * starts[3, k]
        j, i = np.int32(x), np.int32(y)
        parts[0, k], parts[1, k] = x - np.float32(j), y - np.float32(i)
        pixel[k] = i * width + j
    for k in range(pixel.size):
        above = np.uint64(pixel[k])
        below = above + np.uint64(width)
        upper = flat[above] + parts[0, k] * (flat[above + np.uint64(1)] - flat[above])
        lower = flat[below] + parts[0, k] * (flat[below + np.uint64(1)] - flat[below])
        samples[k] = upper + parts[1, k] * (lower - upper)


@compiled
def sample_rays(
    values: Singles, rays: Floats, reach: float, step: float, lines: int, places: int
) -> tuple[Singles, Ints]:
    """Profiles of all rays from -reach outwards (places, rays), and the first and last valid place of each (rays, 2).

    As `sample_ray` makes them, which is asked where a ray leaves the picture or meets a masked pixel.
    """
    number = rays.shape[0]
    whole, ends = np.empty(number, np.bool_), np.zeros((number, 2), np.int32)
    for k in range(number):
        whole[k] = ray_is_inside(values.shape, rays[k], max(reach, step * (places - 1) - reach), 0.5 * lines)
        ends[k, 1] = places - 1
    starts, parts = np.empty((4, lines * number), np.float32), np.empty((2, lines * number), np.float32)
    pixel, samples = np.empty(lines * number, np.int32), np.empty(lines * number, np.float32)
    place_lines(rays, whole, reach, step, starts)
    profiles, total, share = np.zeros((places, number), np.float32), np.zeros(number, np.float32), np.float32(1 / lines)
    for n in range(places):
        sample_lines(values, starts, n, parts, pixel, samples)
        for line in range(lines):
            first = np.uint64(line * number)
            for k in range(number):
                profiles[n, k] += share * samples[first + np.uint64(k)]
        for k in range(number):
            total[k] += profiles[n, k]
    profile = np.empty(places, np.float32)
    for k in range(number):
        if not whole[k] or math.isnan(total[k]):
            ends[k, 0], ends[k, 1] = sample_ray(values, rays[k], reach, step, lines, profile)
            for n in range(places):
                profiles[n, k] = profile[n]
    return profiles, ends
