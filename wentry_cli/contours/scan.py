"""Level "fast": matched edges along the normals of the predicted ellipse and a robust fit of its parameters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import (
    DEPARTURE,
    KAPPA,
    LENGTH,
    NX,
    NY,
    J,
    X,
    Y,
    arc_geometry,
    farthest,
    quadrant_table,
    sector_angles,
    semi_axes,
)
from wentry_cli.contours.normal_equations import factorise, solve, substitute
from wentry_cli.contours.ray_scatter import TUKEY, scan_covariance
from wentry_cli.contours.turning import no_turn, ray_turn, wants_tilt
from wentry_cli.imaging.edges import CANDIDATES, edge_candidates
from wentry_cli.imaging.order_statistics import quantile_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HYPOTHESES = 300
LINE_VARIANCE = 2.0 / 3.0
LEAST_SCALE_PX = 0.008
# The second scan is left out where the first moved the outline by less, and nearly all rays agreed.
SETTLED_PX = 1.0
OCCLUDED_SHARE = 0.15
# Rays farther off than this count as outliers, by scan; the last never less than what a real sphere departs.
LIMITS_PX = (1.2, 0.7, 0.6)
SLACK_OF_R = 0.006


@compiled
def visible_rays(shape: Floats, top_y: float, wanted: int, size: tuple[int, int]) -> tuple[Floats, float, float]:
    """Sector rows below ``top_y`` whose points lie in the image, with two shares of the whole perimeter.

    The shares are of what lies below ``top_y`` and of the part of it that lies in the image.
    """
    a, b = semi_axes(shape)
    sine = min(1.0, max(-1.0, (top_y - shape[1]) / b))
    share = max(0.1, 0.5 - math.asin(sine) / math.pi)
    turns = wanted / share
    perimeter = 2.0 * math.pi * math.sqrt(0.5 * (a * a + b * b))
    count, table = quadrant_table(a, b, 1.3 * perimeter / turns, 1.3 * 2.0 * math.pi / (0.3 * turns))
    rows = arc_geometry(shape, sector_angles(count, table))
    kept = np.empty_like(rows)
    number, length, below, total = 0, 0.0, 0.0, 0.0
    for k in range(rows.shape[0]):
        total += rows[k, LENGTH]
        if rows[k, Y] < top_y:
            continue
        below += rows[k, LENGTH]
        if not (1.0 <= rows[k, X] < size[1] - 2.0 and 1.0 <= rows[k, Y] < size[0] - 2.0):
            continue
        kept[number] = rows[k]
        number += 1
        length += rows[k, LENGTH]
    return kept[:number], below / total, length / total


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
        target = 0.0
        for i in range(5):
            target += rays[k, J + i] * step[i]
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
def tukey_fit(
    at: Floats, height: Floats, rays: Floats, free: Ints, start: Floats, settings: Floats, factor: Floats
) -> tuple[Floats, float, float]:
    """Parameter step by reweighted least squares (Tukey's biweight) from ``start``.

    ``settings`` holds the least height and the gates on the inner and outer side, px. ``factor`` receives the
    Cholesky factor of the weighted normal equations. Returns the step, the robust scale of the residual (px, NaN
    where the system is singular) and the share of rays with weight.
    """
    strong, limit, outer_limit = settings[0], settings[1], settings[2]
    size, number = free.size, rays.shape[0]
    step = start.copy()
    off = np.empty(number)
    absolute = np.empty(number)
    right = np.empty(size)
    scale, share = math.nan, 0.0
    for _ in range(8):
        found = 0
        for k in range(number):
            target = 0.0
            for i in range(5):
                target += rays[k, J + i] * step[i]
            off[k] = nearest(at[k], strong, height[k], target) - target
            if abs(off[k]) < (outer_limit if off[k] > 0.0 else limit):
                absolute[found] = abs(off[k])
                found += 1
        if found < size + 2:
            return step, math.nan, 0.0
        scale = max(LEAST_SCALE_PX, quantile_of(absolute, found, 0.4) / 0.524)
        factor[:, :] = 0.0
        right[:] = 0.0
        used = 0
        for k in range(number):
            z = off[k] / (TUKEY * scale)
            if not abs(z) < 1.0 or not abs(off[k]) < (outer_limit if off[k] > 0.0 else limit):
                continue
            used += 1
            weight = (1.0 - z * z) ** 2
            for i in range(size):
                row = weight * rays[k, J + free[i]]
                right[i] += row * off[k]
                for j in range(i + 1):
                    factor[i, j] += row * rays[k, J + free[j]]
        if not factorise(factor):
            return step, math.nan, 0.0
        substitute(factor, right)
        change = 0.0
        for i in range(size):
            step[free[i]] += right[i]
            change = max(change, abs(right[i]) * (1.0 if free[i] < 3 else 60.0))
        share = used / number
        if change < 1e-3:
            break
    return step, scale, share


@compiled
def correct_edges(at: Floats, rays: Floats, variance: float, motion: Floats) -> None:
    """Undo what moves the edge off the ellipse.

    A blurred convex edge lies further inside by half the curvature times the variance along the edge; the known
    departure is taken off.
    """
    for k in range(rays.shape[0]):
        along = (motion[0] * rays[k, NY] - motion[1] * rays[k, NX]) ** 2 / 12.0
        for slot in range(CANDIDATES):
            at[k, slot] += 0.5 * rays[k, KAPPA] * (variance + along) - rays[k, DEPARTURE]


@compiled
def clamp_step(shape: Floats, step: Floats) -> None:
    """Move the shape, at most by a third of its radius and a fifth of its stretch at a time."""
    bound = 0.34 * shape[2]
    for i in range(3):
        shape[i] += min(bound, max(-bound, step[i]))
    shape[3] *= math.exp(min(0.2, max(-0.2, step[3] / shape[3])))
    shape[4] += min(0.3, max(-0.3, step[4]))


@compiled
def scan_shape(
    values: NDArray[np.float32], shape: Floats, free: Ints, top_y: float, search: Floats, noise: float
) -> tuple[Floats, Floats, Floats]:
    """Find the ellipse from a guess, which is moved in place (patch pixels, tilt in radians, departure).

    ``search`` holds the half-length of the first scan (px), 1 where outliers lie outside only, the number of rays of
    the last scan, the variance of the blur along the edge (px^2), the number of scans (3, or 2 where the third and
    fine one is only for outlines that are partly hidden) and the motion (x, y), px. Returns the covariance of the
    free parameters, (status, share of the perimeter that is visible, share of rays left out, scale of the residual
    in px, contrast, share below the top row); status 0 is good, 1 no edge, 2 no consensus; and, of three scans, the
    turn (see `turning`).
    """
    report = np.zeros(6)
    size = free.size
    factor = np.zeros((size, size))
    covariance = np.zeros((size, size))
    settings = np.empty(3)
    halves = (search[0], 6.0, 4.0)
    report[0] = 1.0
    settled = False
    for turn in range(3):
        if turn == 1 and settled:
            continue
        if turn == 2 and search[4] < 3.0 and report[2] < OCCLUDED_SHARE:
            break
        fine = turn == 2
        wanted = int(search[2]) if fine else 48
        rays, report[5], report[1] = visible_rays(shape, top_y, wanted, values.shape)
        if rays.shape[0] < size + 4:
            return covariance, report, no_turn()
        half = min(halves[turn], 0.8 * rays.shape[0] + 4.0)
        at, height, sample_noise = edge_candidates(values, rays, half, 0.5 if fine else 1.0, 3 if fine else 1)
        heights = height[:, 0].copy()
        report[4] = quantile_of(heights, heights.size, 0.5)
        strongest = quantile_of(heights, heights.size, 0.75)
        used_noise = max(noise, 0.0) if noise > 0.0 else sample_noise
        settings[0] = max(0.3 * strongest, 0.02, 2.0 * used_noise if not fine else 1.0 * used_noise)
        settings[1] = max(LIMITS_PX[turn], SLACK_OF_R * shape[2])
        settings[2] = 0.6 * settings[1] if search[1] > 0.0 else settings[1]
        if quantile_of(heights, heights.size, 1.0 - max((size + 3.0) / heights.size, 0.15)) < settings[0]:
            report[0] = 1.0
            return covariance, report, no_turn()
        correct_edges(at, rays, search[3] + (LINE_VARIANCE if fine else 0.0), search[5:])
        start = consensus(at, height, rays, free, settings) if turn < 2 else np.zeros(5)
        step, scale, share = tukey_fit(at, height, rays, free, start, settings, factor)
        report[2], report[3] = 1.0 - share, scale
        if math.isnan(scale) or share < 0.2:
            report[0] = 2.0
            return covariance, report, no_turn()
        clamp_step(shape, step)
        settled = turn == 0 and share > 0.9 and farthest(rays, step) < SETTLED_PX
    report[0] = 0.0
    for k in range(rays.shape[0]):
        target = 0.0
        for i in range(5):
            target += rays[k, J + i] * step[i]
        at[k, 0] = nearest(at[k], settings[0], height[k], target) - target
    found = scan_covariance(at, rays, free, factor, report[3])
    if search[4] < 3.0 or not wants_tilt(free):
        return found, report, no_turn()
    return found, report, ray_turn(at, rays, free, report[3])
