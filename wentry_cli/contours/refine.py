"""Level "accurate": Gauss-Newton on the pixels of a narrow band, with gated sectors and free nuisances."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, J, Y, arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.band import collect_band
from wentry_cli.contours.likelihood import (
    COUNT,
    COUNT_IN,
    COUNT_OUT,
    SQUARE_IN,
    SQUARE_OUT,
    STATE,
    SUMS,
    accumulate,
    first_levels,
)
from wentry_cli.contours.normal_equations import factorise, median_of, substitute
from wentry_cli.contours.sectors import (
    LEAST_PIXELS,
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    MOVED,
    NUISANCES,
    SLOPE_X,
    SLOPE_Y,
    VERDICT,
    WEIGHT,
    assemble,
    judge,
    level_spread,
    set_state,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SECTOR_PX = 6.0
SECTOR_ANGLE = math.radians(12.0)
INNER_PX, OUTER_PX = 5.0, 5.0
PRIOR_LN_S = math.log(1.08)
PRIOR_LN_S_UNC = 0.35
PRIOR_LEVEL_UNC = 0.1
PRIOR_SLOPE_PER_PX = 2e-4
ROUNDS = 6
# Entries of the report of `refine_shape`.
STATUS, BLUR, ARC, GATED, RESIDUAL, IN, OUT, REPORT = 0, 1, 2, 3, 4, 5, 6, 7
SINGULAR, LOST = 1.0, 2.0


@compiled
def noise_levels(sums: Floats, verdict: Floats, noise: Floats) -> None:
    """Robust variance of a pixel on the dark and on the bright side of the edge, into ``noise``."""
    for side in range(2):
        count, square = (COUNT_IN, SQUARE_IN) if side == 0 else (COUNT_OUT, SQUARE_OUT)
        means = np.empty(sums.shape[0])
        number = 0
        for k in range(sums.shape[0]):
            if sums[k, count] >= 0.4 * LEAST_PIXELS and verdict[k, WEIGHT] > 0.0:
                means[number] = sums[k, square] / sums[k, count]
                number += 1
        if number >= 4:
            noise[side] = max(1e-8, median_of(means, number))
    # the median of a mean of few squares lies low, and the two sides may not differ without bounds
    noise[0] = max(noise[0], 0.02 * noise[1])
    noise[1] = max(noise[1], 0.02 * noise[0])


@compiled
def add_priors(normal: Floats, right: Floats, nuisance: Floats, prior: Floats, first: int) -> None:
    """Gaussian priors on the nuisances: ``prior`` holds their means and variances as two rows."""
    for i in range(NUISANCES):
        normal[first + i, first + i] += 1.0 / prior[1, i]
        right[first + i] -= (nuisance[i] - prior[0, i]) / prior[1, i]


@compiled
def priors(nuisance: Floats, radius: float, ceiling: float) -> Floats:
    """Means and variances of the nuisances, given first guesses of the levels."""
    prior = np.zeros((2, NUISANCES))
    contrast = abs(nuisance[LEVEL_OUT] - nuisance[LEVEL_IN])
    prior[0, LEVEL_IN], prior[0, LEVEL_OUT] = nuisance[LEVEL_IN], nuisance[LEVEL_OUT]
    prior[1, LEVEL_IN] = prior[1, LEVEL_OUT] = (PRIOR_LEVEL_UNC * contrast) ** 2
    prior[1, SLOPE_X] = prior[1, SLOPE_Y] = (PRIOR_SLOPE_PER_PX * radius * nuisance[LEVEL_OUT]) ** 2
    prior[0, LN_S], prior[1, LN_S] = PRIOR_LN_S, PRIOR_LN_S_UNC**2
    if nuisance[LEVEL_OUT] >= ceiling:
        prior[0, LEVEL_OUT] = max(1.0, 1.02 * ceiling)
        prior[1, LEVEL_OUT] = 0.02**2
    return prior


@compiled
def update(
    normal: Floats, right: Floats, free: Ints, rows: Floats, moved: Floats, nuisance: Floats
) -> tuple[bool, float]:
    """Solve for one step in place; False where singular, and the greatest change of an edge (px) or of ln s / 10."""
    if not factorise(normal):
        return False, math.nan
    substitute(normal, right)
    size = free.size
    for i in range(size):
        moved[free[i]] += right[i]
    for i in range(NUISANCES - 1):
        nuisance[i] += right[size + i]
    blur_step = min(0.35, max(-0.35, right[size + LN_S]))
    nuisance[LN_S] = min(1.8, max(-1.2, nuisance[LN_S] + blur_step))
    largest = 0.1 * abs(blur_step)
    for k in range(rows.shape[0]):
        change = 0.0
        for i in range(size):
            change += rows[k, J + free[i]] * right[i]
        largest = max(largest, abs(change))
    return True, largest


@compiled
def arc_shares(rows: Floats, sums: Floats, verdict: Floats, top_y: float) -> tuple[float, float, float]:
    """Share of the perimeter looked at, share of that left out, and share of the perimeter below ``top_y``."""
    total, seen, kept, below = 0.0, 0.0, 0.0, 0.0
    for k in range(rows.shape[0]):
        total += rows[k, LENGTH]
        if rows[k, Y] >= top_y:
            below += rows[k, LENGTH]
        if sums[k, COUNT] >= LEAST_PIXELS:
            seen += rows[k, LENGTH]
            kept += rows[k, LENGTH] * verdict[k, WEIGHT]
    return seen / total, 1.0 - kept / max(seen, 1e-9), below / total


@compiled
def residual_statistics(sums: Floats, verdict: Floats, size: int) -> tuple[float, float]:
    """Root mean square of the kept sectors' displacements (px) and their reduced chi square."""
    weights, squares, chi2, number = 0.0, 0.0, 0.0, 0
    for k in range(sums.shape[0]):
        weight = verdict[k, WEIGHT]
        if weight > 0.0:
            number += 1
            weights += weight
            squares += weight * verdict[k, MOVED] ** 2
            chi2 += weight * verdict[k, MOVED] ** 2 / verdict[k, 1]
    if number <= size:
        return math.nan, math.nan
    return math.sqrt(squares / weights), chi2 / max(1.0, weights - size)


@compiled
def invert_block(factor: Floats, size: int, inflation: float) -> Floats:
    """First ``size`` rows and columns of the inverse, from the Cholesky factor, times ``inflation``."""
    covariance = np.empty((size, size))
    unit = np.empty(factor.shape[0])
    for j in range(size):
        unit[:] = 0.0
        unit[j] = 1.0
        substitute(factor, unit)
        for i in range(size):
            covariance[i, j] = inflation * unit[i]
    return covariance


@compiled
def refine_shape(values: NDArray[np.float32], shape: Floats, free: Ints, settings: Floats) -> tuple[Floats, Floats]:
    """Maximise the likelihood from a start that is right to a fraction of a pixel; ``shape`` is moved in place.

    ``settings`` holds the top row, the motion (x, y), the ceiling and 1 where outliers lie outside only. Returns the
    covariance of the free parameters and the report (status, blur, arc, gated, residual, levels inside and outside).
    """
    report = np.zeros(REPORT)
    size = free.size
    noise = np.ones(2)
    nuisance = np.zeros(NUISANCES)
    nuisance[LN_S] = PRIOR_LN_S
    spread = np.full(2, 1e-6)
    covariance = np.zeros((size, size))
    prior = np.zeros((2, NUISANCES))
    scene = np.array([0.0, 0.0, 0.0, settings[1], settings[2]])
    for collection in range(4):
        a, b = semi_axes(shape)
        count, table = quadrant_table(a, b, SECTOR_PX, SECTOR_ANGLE)
        rows = arc_geometry(shape, sector_angles(count, table))
        limits = np.array([min(INNER_PX, 0.5 * min(a, b)), OUTER_PX, settings[0]])
        pixels, sectors, _ = collect_band(values, shape, count, table, limits)
        sums, state = np.zeros((4 * count, SUMS)), np.zeros((4 * count, STATE))
        verdict = np.zeros((4 * count, VERDICT))
        verdict[:, WEIGHT] = 1.0
        scene[:3] = shape[:3]
        if collection == 0:
            nuisance[LEVEL_IN], nuisance[LEVEL_OUT] = first_levels(pixels, sectors, 4 * count)
            if math.isnan(nuisance[LEVEL_IN]):
                report[STATUS] = LOST
                return covariance, report
            if math.isnan(nuisance[LEVEL_OUT]):
                nuisance[LEVEL_OUT] = 1.0
            prior = priors(nuisance, shape[2], settings[3])
            noise[:] = 1e-4
        moved = np.zeros(5)
        for turn in range(ROUNDS):
            set_state(state, rows, moved, nuisance, scene)
            accumulate(pixels, sectors, state, noise, settings[3], sums)
            if collection == 0 and turn == 0:
                before = 0.5 * (noise[0] + noise[1])
                noise_levels(sums, verdict, noise)
                sums[:, :COUNT] *= before / (0.5 * (noise[0] + noise[1]))
                sums[:, COUNT + 1] *= before / (0.5 * (noise[0] + noise[1]))
            level_spread(sums, spread)
            judge(sums, spread, settings[4] > 0.0, verdict)
            normal, right = assemble(sums, verdict, rows, free, scene, spread)
            add_priors(normal, right, nuisance, prior, size)
            good, change = update(normal, right, free, rows, moved, nuisance)
            report[ARC], report[GATED], _ = arc_shares(rows, sums, verdict, settings[0])
            if not good:
                report[STATUS] = SINGULAR
                return covariance, report
            noise_levels(sums, verdict, noise)
            if (turn > 0 and change < 0.004) or change > 2.0:
                break
        far = 0.0
        for k in range(rows.shape[0]):
            displacement = 0.0
            for i in range(5):
                displacement += rows[k, J + i] * moved[i]
            far = max(far, abs(displacement))
        shape += moved
        if far > 4.0 or not (0.3 < shape[3] < 4.0 and shape[2] > 2.0):
            report[STATUS] = LOST
            return covariance, report
        if far < 0.25:
            break
    report[RESIDUAL], chi2 = residual_statistics(sums, verdict, size)
    if math.isnan(chi2):
        report[STATUS] = LOST
        return covariance, report
    report[BLUR] = math.exp(nuisance[LN_S])
    report[IN], report[OUT] = nuisance[LEVEL_IN], nuisance[LEVEL_OUT]
    return invert_block(normal, size, max(1.0, chi2)), report
