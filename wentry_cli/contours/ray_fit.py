"""Robust fits of a linear model to edges of which each ray has several: consensus and reweighted least squares."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J, displacement_of
from wentry_cli.contours.normal_equations import factorise, solve, substitute
from wentry_cli.contours.ray_scatter import TUKEY
from wentry_cli.imaging.edges import CANDIDATES
from wentry_cli.imaging.order_statistics import quantile_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HYPOTHESES = 300
LEAST_SCALE_PX = 0.008
# Reweighted until the rays move by less than this share of their scatter, root mean square, or so many times.
CONVERGED, MOST_ROUNDS = 0.005, 8


@compiled
def nearest(at: Floats, strong: float, height: Floats, target: float) -> float:
    """The candidate nearest to ``target`` among those of at least ``strong``; NaN where there is none."""
    best = math.nan
    for slot in range(CANDIDATES):
        if height[slot] < strong or math.isnan(at[slot]):
            continue
        if math.isnan(best) or abs(at[slot] - target) < abs(best - target):
            best = at[slot]
    return best


@compiled
def score(at: Floats, height: Floats, rays: Floats, step: Floats, settings: Floats) -> tuple[float, int]:
    """Truncated square distance of the nearest candidates from the moved ellipse, and the number of inliers."""
    strong, limit, outer_limit = settings[0], settings[1], settings[2]
    total, inliers = 0.0, 0
    for k in range(rays.shape[0]):
        target = displacement_of(rays[k], step)
        off = nearest(at[k], strong, height[k], target) - target
        bound = outer_limit if off > 0.0 else limit
        if abs(off) < bound:
            inliers += 1
            total += off * off
        else:
            total += limit * limit
    return total, inliers


@compiled
def minimal_step(
    at: Floats, height: Floats, rays: Floats, free: Ints, picks: Ints, strong: float, step: Floats
) -> bool:
    """Parameter step that takes the ellipse through one candidate on each of the picked rays."""
    size = free.size
    normal = np.zeros((size, size))
    right = np.zeros(size)
    for number in range(size):
        k, slot = picks[2 * number], picks[2 * number + 1]
        if height[k, slot] < strong or math.isnan(at[k, slot]):
            return False
        for i in range(size):
            right[i] += rays[k, J + free[i]] * at[k, slot]
            for j in range(size):
                normal[i, j] += rays[k, J + free[i]] * rays[k, J + free[j]]
    if not solve(normal, right):
        return False
    step[:] = 0.0
    for i in range(size):
        step[free[i]] = right[i]
    return True


@compiled
def consensus(at: Floats, height: Floats, rays: Floats, free: Ints, settings: Floats) -> Floats:
    """Parameter step with the smallest truncated distance over random minimal sets (RANSAC, fixed seed)."""
    best = np.zeros(5)
    best_score, inliers = score(at, height, rays, best, settings)
    step = np.zeros(5)
    picks = np.zeros(2 * free.size, dtype=np.int64)
    state = np.uint32(12345)
    for trial in range(HYPOTHESES):
        share = max(0.1, inliers / rays.shape[0])
        if inliers > 0.85 * rays.shape[0] and best_score < 0.25 * inliers:
            break
        if trial > 25.0 / share**free.size:
            break
        for number in range(free.size):
            state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
            picks[2 * number] = int(state >> np.uint32(8)) % rays.shape[0]
            state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
            roll = int(state >> np.uint32(8)) % 8
            picks[2 * number + 1] = 0 if roll < 6 else roll - 5
        if not minimal_step(at, height, rays, free, picks, settings[0], step):
            continue
        total, number_in = score(at, height, rays, step, settings)
        if total < best_score:
            best_score, inliers = total, number_in
            best[:] = step
    return best


@compiled
def rest_of(at: Floats, height: Floats, rays: Floats, step: Floats, least: float, off: Floats) -> None:
    """Fill in how far the nearest candidates that are strong enough lie outside of the moved model, px, or NaN."""
    for k in range(rays.shape[0]):
        target = displacement_of(rays[k], step)
        off[k] = nearest(at[k], least, height[k], target) - target


@compiled
def root_mean_square(factor: Floats, change: Floats, weights: float) -> float:
    """How far the rays move under a parameter step, px, from the Cholesky factor of the normal equations."""
    total = 0.0
    for j in range(change.size):
        row = 0.0
        for i in range(j, change.size):
            row += factor[i, j] * change[i]
        total += row * row
    return math.sqrt(total / weights)


@compiled
def tukey_fit(
    at: Floats, height: Floats, rays: Floats, free: Ints, start: Floats, settings: Floats, stiff: Floats, factor: Floats
) -> tuple[Floats, float, float]:
    """Parameter step by reweighted least squares (Tukey's biweight) from ``start``.

    ``settings`` holds the least height and the gates on the inner and outer side, px; ``stiff`` is the precision with
    which each free parameter is known to be zero, per px^-2 of a ray. ``factor`` receives the Cholesky factor of the
    weighted normal equations. Returns the step, the robust scale of the residual (px, NaN where the system is
    singular) and the share of rays with weight.
    """
    limit, outer_limit = settings[1], settings[2]
    size, number = free.size, rays.shape[0]
    step = start.copy()
    off, absolute, right = np.empty(number), np.empty(number), np.empty(size)
    scale, share = math.nan, 0.0
    for _ in range(MOST_ROUNDS):
        rest_of(at, height, rays, step, settings[0], off)
        found = 0
        for k in range(number):
            if abs(off[k]) < (outer_limit if off[k] > 0.0 else limit):
                absolute[found] = abs(off[k])
                found += 1
        if found < size + 2:
            return step, math.nan, 0.0
        scale = max(LEAST_SCALE_PX, quantile_of(absolute, found, 0.4) / 0.524)
        factor[:, :] = 0.0
        for i in range(size):
            factor[i, i] = scale**2 * stiff[i]
            right[i] = -factor[i, i] * step[free[i]]
        used, weights = 0, 0.0
        for k in range(number):
            z = off[k] / (TUKEY * scale)
            if not abs(z) < 1.0 or not abs(off[k]) < (outer_limit if off[k] > 0.0 else limit):
                continue
            used += 1
            weight = (1.0 - z * z) ** 2
            weights += weight
            for i in range(size):
                row = weight * rays[k, J + free[i]]
                right[i] += row * off[k]
                for j in range(i + 1):
                    factor[i, j] += row * rays[k, J + free[j]]
        if not factorise(factor):
            return step, math.nan, 0.0
        substitute(factor, right)
        for i in range(size):
            step[free[i]] += right[i]
        share = used / number
        if root_mean_square(factor, right, weights) < CONVERGED * scale:
            break
    return step, scale, share
