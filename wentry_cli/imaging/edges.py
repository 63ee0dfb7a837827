"""Sub-pixel edge samples along rays: bilinear profiles and a matched filter for a dark-to-bright step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Profile = NDArray[np.floating[Any]]

CANDIDATES = 3
KERNEL_SIGMA_PX = 1.6
KERNEL_REACH_PX = 4.0
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
def sum_lines(
    values: NDArray[np.float32], ray: Floats, reach: float, step: float, lines: int, profile: Profile
) -> float:
    """Fill ``profile`` with sums over parallel lines that lie inside the image; the total is NaN if any is."""
    overall = 0.0
    profile[:] = 0.0
    for line in range(lines):
        aside = line - 0.5 * (lines - 1)
        column = ray[0] - reach * ray[2] - aside * ray[3]
        row = ray[1] - reach * ray[3] + aside * ray[2]
        right, down = step * ray[2], step * ray[3]
        for n in range(profile.size):
            x, y = column + n * right, row + n * down
            i, j = np.uint32(y), np.uint32(x)
            fy, fx = np.float32(y - i), np.float32(x - j)
            upper = values[i, j] + fx * (values[i, j + np.uint32(1)] - values[i, j])
            below = i + np.uint32(1)
            lower = values[below, j] + fx * (values[below, j + np.uint32(1)] - values[below, j])
            profile[n] += upper + fy * (lower - upper)
    for n in range(profile.size):
        overall += profile[n]
        profile[n] /= lines
    return overall


@compiled
def sample_ray(
    values: NDArray[np.float32], ray: Floats, reach: float, step: float, lines: int, profile: Profile
) -> tuple[int, int]:
    """Fill ``profile`` from -reach outwards along one ray, averaged over parallel lines 1 px apart.

    Masked samples take the nearest valid value on the inner side (or the first valid one), and the ground's 1 behind
    bright ones. Returns the first and last valid index, (0, -1) where there is none.
    """
    longest = max(reach, step * (profile.size - 1) - reach)
    if ray_is_inside(values.shape, ray, longest, 0.5 * lines) and not math.isnan(
        sum_lines(values, ray, reach, step, lines, profile)
    ):
        return 0, profile.size - 1
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
def edge_kernel(step: float) -> Floats:
    """Odd kernel, the derivative of a Gaussian, scaled so that its response to a step is the step's height."""
    reach = int(KERNEL_REACH_PX / step)
    kernel = np.empty(2 * reach + 1)
    total = 0.0
    for n in range(2 * reach + 1):
        s = (n - reach) * step
        kernel[n] = s * math.exp(-0.5 * (s / KERNEL_SIGMA_PX) ** 2)
        total += 0.5 * abs(kernel[n])
    return kernel / total


@compiled
def correlate(profile: Floats, kernel: Floats, response: Floats) -> None:
    """Fill ``response`` with the sums of ``kernel`` times ``profile`` from each place on.

    Tap after tap for all places, which the compiler turns into vector instructions.
    """
    response[:] = 0.0
    for m in range(kernel.size):
        tap, shifted = kernel[m], profile[m : m + response.size]
        for n in range(response.size):
            response[n] += tap * shifted[n]


@compiled
def keep_candidate(at: Floats, height: Floats, position: float, strength: float) -> None:
    """Insert a candidate into the short list of one ray, strongest first."""
    for slot in range(CANDIDATES):
        if strength > height[slot]:
            for other in range(CANDIDATES - 1, slot, -1):
                at[other], height[other] = at[other - 1], height[other - 1]
            at[slot], height[slot] = position, strength
            return


@compiled
def edge_candidates(
    values: NDArray[np.float32], rays: Floats, half: float, step: float, lines: int
) -> tuple[Floats, Floats, float]:
    """Dark-to-bright edges along rays (x, y, nx, ny in pixels of ``values``; further columns are ignored).

    Returns positions along the rays (n, CANDIDATES), NaN where there is none, their heights, strongest first, and a
    robust estimate of the noise of one profile sample.
    """
    kernel = edge_kernel(step)
    margin = (kernel.size - 1) // 2
    span = math.ceil(2.0 * half / step) + 1
    profile = np.empty(span + 2 * margin)
    response = np.empty(span)
    at = np.full((rays.shape[0], CANDIDATES), math.nan)
    height = np.zeros((rays.shape[0], CANDIDATES))
    noises = np.empty(rays.shape[0])
    valid_rays = 0
    for k in range(rays.shape[0]):
        first, last = sample_ray(values, rays[k], half + margin * step, step, lines, profile)
        if last - first < margin:
            continue
        rough = 0.0
        for n in range(first + 2, last + 1, 2):
            rough += abs(profile[n] - 2.0 * profile[n - 1] + profile[n - 2])
        noises[valid_rays] = rough / max(1, (last - first) // 2)
        valid_rays += 1
        correlate(profile, kernel, response)
        least = 0.0
        for n in range(1, span - 1):
            here = response[n]
            if here <= least or here < response[n - 1] or here <= response[n + 1]:
                continue
            if n + margin < first or n + margin > last + 1:
                continue
            bend = response[n - 1] - 2.0 * here + response[n + 1]
            shift = 0.5 * (response[n - 1] - response[n + 1]) / bend if bend < 0.0 else 0.0
            keep_candidate(at[k], height[k], (n + shift) * step - half, here)
            least = height[k, CANDIDATES - 1]
    return at, height, 0.5 * median_of(noises, valid_rays)
