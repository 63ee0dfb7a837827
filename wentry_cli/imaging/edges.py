"""Sub-pixel edges along rays: a matched filter for a dark-to-bright step on the profiles of a picture."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.ray_profiles import sample_rays

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int32]

CANDIDATES = 3
# The filter is the derivative of a Gaussian, cut off at so many sigma.
KERNEL_SIGMA_PX, KERNEL_REACH = 1.6, 2.5
KERNEL_REACH_PX = KERNEL_REACH * KERNEL_SIGMA_PX
# Variance of the blur that an edge is taken to have, px^2: optics and pixel. With it the response is a Gaussian.
EDGE_VARIANCE = 1.0 + 1.0 / 12.0


@compiled
def edge_kernel(step: float, sigma: float) -> Singles:
    """Outer half of an odd kernel, the derivative of a Gaussian, whose response to a step is the step's height."""
    reach = round(KERNEL_REACH * sigma / step)
    kernel, total = np.empty(reach, np.float32), 0.0
    for n in range(reach):
        s = (n + 1) * step
        kernel[n] = s * math.exp(-0.5 * (s / sigma) ** 2)
        total += kernel[n]
    return kernel / np.float32(total)


@compiled
def rounder_than_parabola(step: float, sigma: float) -> float:
    """By what the parabola through three samples ``step`` px apart of a filter's response falls short, relatively."""
    return 0.25 * step**2 / (sigma**2 + EDGE_VARIANCE)


@compiled
def peak_between(before: float, here: float, after: float, rounder: float) -> float:
    """Where a Gaussian response peaks beside the highest of three samples, in steps (see `rounder_than_parabola`)."""
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return shift + rounder * shift * (1.0 - 4.0 * shift * shift)


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
def respond(profiles: Singles, kernel: Singles, places: int) -> Singles:
    """What the odd ``kernel``, of which the outer half is told, says of the profiles of all rays (places, rays)."""
    number, reach = profiles.shape[1], kernel.size
    response = np.zeros((places, number), np.float32)
    for n in range(places):
        for m in range(reach):
            tap, before, after = kernel[m], n + reach - 1 - m, n + reach + 1 + m
            for k in range(number):
                response[n, k] += tap * (profiles[after, k] - profiles[before, k])
    return response


@compiled
def sample_noise(profiles: Singles, ends: Ints, least: int) -> float:
    """Noise of one sample, from the bends of the profiles; of rays that are seen beyond ``least`` places."""
    places, number = profiles.shape
    bends, noises, kept = np.zeros(number, np.float32), np.empty(number), 0
    for n in range(2, places, 2):
        for k in range(number):
            bends[k] += abs(profiles[n, k] - np.float32(2.0) * profiles[n - 1, k] + profiles[n - 2, k])
    for k in range(number):
        length = ends[k, 1] - ends[k, 0]
        if length >= least:
            noises[kept] = bends[k] / max(1, length // 2)
            kept += 1
    return 0.5 * median_of(noises, kept)


@compiled
def edge_candidates(
    values: Singles, rays: Floats, half: float, step: float, lines: int, sigma: float = KERNEL_SIGMA_PX
) -> tuple[Floats, Floats, float]:
    """Dark-to-bright edges along rays (x, y, nx, ny in pixels of ``values``; further columns are ignored).

    They are looked for up to ``half`` px away, at places ``step`` px apart, averaged over parallel ``lines``, with the
    derivative of a Gaussian of ``sigma`` px.
    Returns positions along the rays (n, CANDIDATES), NaN where there is none, their heights, strongest first, and a
    robust estimate of the noise of one profile sample.
    """
    kernel = edge_kernel(step, sigma)
    rounder = rounder_than_parabola(step, sigma)
    margin = kernel.size
    span = math.ceil(2.0 * half / step) + 1
    profiles, ends = sample_rays(values, rays, half + margin * step, step, lines, span + 2 * margin)
    response = respond(profiles, kernel, span)
    at = np.full((rays.shape[0], CANDIDATES), math.nan)
    height = np.zeros((rays.shape[0], CANDIDATES))
    for k in range(rays.shape[0]):
        if ends[k, 1] - ends[k, 0] < margin:
            continue
        least = 0.0
        for n in range(max(1, ends[k, 0] - margin), min(span - 1, ends[k, 1] - margin + 2)):
            here = response[n, k]
            # bit by bit: one branch in place of three that nobody can predict
            if not ((here > least) & (here >= response[n - 1, k]) & (here > response[n + 1, k])):
                continue
            shift = peak_between(float(response[n - 1, k]), here, float(response[n + 1, k]), rounder)
            keep_candidate(at[k], height[k], (n + shift) * step - half, here)
            least = height[k, CANDIDATES - 1]
    return at, height, sample_noise(profiles, ends, margin)
