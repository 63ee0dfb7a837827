"""The global normal equations of all sectors, and what one step from them leaves.

A pixel's level is linear in the grey levels and nearly so in small displacements. So what the sectors say after a step
follows from what they said before it, and the same equations answer for any set of free parameters.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import KAPPA, J, X, Y, displacement_of
from wentry_cli.contours.likelihood import DD, GD
from wentry_cli.contours.normal_equations import factorise, invert_block, substitute
from wentry_cli.contours.nuisances import Belief, add_priors
from wentry_cli.contours.sectors import (
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    LOCAL,
    MOVED,
    NUISANCES,
    SLOPE_X,
    SLOPE_Y,
    VARIANCE,
    WEIGHT,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# What a step leaves may be such a share of the standard uncertainty of a displacement of the whole outline.
REMAINS = 0.1


@compiled
def assemble(verdict: Floats, rows: Floats, free: Ints, scene: Floats) -> tuple[Floats, Floats]:
    """Weighted normal matrix and right-hand side over the free parameters and the nuisances."""
    size = free.size
    total = size + NUISANCES
    normal, right = np.zeros((total, total)), np.zeros(total)
    matrix = np.empty((4, 4))
    # each parameter moves one of what the sums are over (displacement, inside, outside, ln s), by so much
    moves, slope = np.zeros(total, dtype=np.int64), np.ones(total)
    moves[size + LEVEL_IN] = 1
    moves[size + LEVEL_OUT] = moves[size + SLOPE_X] = moves[size + SLOPE_Y] = 2
    moves[size + LN_S] = 3
    for k in range(rows.shape[0]):
        weight, local = verdict[k, WEIGHT], verdict[k, LOCAL:]
        if weight <= 0.0:
            continue
        index = 0
        for i in range(4):
            for j in range(i + 1):
                matrix[i, j] = matrix[j, i] = local[index]
                index += 1
        for j in range(size):
            slope[j] = rows[k, J + free[j]]
        slope[size + SLOPE_X] = (rows[k, X] - scene[0]) / scene[2]
        slope[size + SLOPE_Y] = (rows[k, Y] - scene[1]) / scene[2]
        for j in range(total):
            scaled = weight * slope[j]
            right[j] += scaled * local[GD + moves[j]]
            by_displacement = scaled * matrix[moves[j], 0]
            for i in range(min(j + 1, size)):
                normal[j, i] += by_displacement * slope[i]
            for i in range(size, j + 1):
                normal[j, i] += scaled * matrix[moves[j], moves[i]] * slope[i]
    for i in range(total):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return normal, right


@compiled
def advance(verdict: Floats, rows: Floats, free: Ints, scene: Floats, step: Floats) -> None:
    """Move what the sectors say to where it will be after ``step`` of the free parameters and the nuisances."""
    size = free.size
    inside, blur = step[size + LEVEL_IN], step[size + LN_S]
    for k in range(rows.shape[0]):
        if math.isnan(verdict[k, MOVED]):
            continue
        displacement = 0.0
        for j in range(size):
            displacement += rows[k, J + free[j]] * step[j]
        outside = step[size + LEVEL_OUT]
        outside += step[size + SLOPE_X] * (rows[k, X] - scene[0]) / scene[2]
        outside += step[size + SLOPE_Y] * (rows[k, Y] - scene[1]) / scene[2]
        changes, local = (displacement, inside, outside, blur), verdict[k, LOCAL:]
        index = 0
        for i in range(4):
            for j in range(i + 1):
                local[GD + i] -= local[index] * changes[j]
                if i != j:
                    local[GD + j] -= local[index] * changes[i]
                index += 1
        verdict[k, MOVED] = local[GD] / local[DD]


@compiled
def step_from(
    verdict: Floats, rows: Floats, free: Ints, scene: Floats, moved: Floats, belief: Belief
) -> tuple[Floats, Floats]:
    """Step of the free parameters and the nuisances, and the Cholesky factor; that is empty where singular.

    ``moved`` (5) is how far the parameters were moved already, which their priors are about.
    """
    normal, right = assemble(verdict, rows, free, scene)
    add_priors(normal, right, free, moved, belief)
    if not factorise(normal):
        return right, np.zeros((0, 0))
    substitute(normal, right)
    return right, normal


@compiled
def outline_variance(factor: Floats, rows: Floats, free: Ints) -> Floats:
    """Variance (px^2) of where each sector's edge is expected, from the Cholesky factor of the normal matrix."""
    covariance, variance = invert_block(factor, free.size, 1.0), np.zeros(rows.shape[0])
    for k in range(rows.shape[0]):
        for i in range(free.size):
            for j in range(free.size):
                variance[k] += rows[k, J + free[i]] * covariance[i, j] * rows[k, J + free[j]]
    return variance


@compiled
def remains(rows: Floats, moved: Floats, blur: float) -> float:
    """Greatest displacement (px) that is left after a step which moved the outline by ``moved`` and ln s by ``blur``.

    Half of the product of the two, as an edge that is not as sharp as was thought is moved by another amount; half of
    the square over the radius of curvature; and a share of the third power, since the second changes the blur.
    """
    worst = 0.0
    for k in range(rows.shape[0]):
        far = abs(displacement_of(rows[k], moved))
        worst = max(worst, 0.5 * far * (abs(blur) + rows[k, KAPPA] * far) + far**3 / 6.0)
    return worst


@compiled
def is_negligible(left: float, verdict: Floats) -> bool:
    """Whether a displacement that is left (px) is small against the uncertainty of one of all sectors together."""
    precision = 0.0
    for k in range(verdict.shape[0]):
        if verdict[k, WEIGHT] > 0.0:
            precision += verdict[k, WEIGHT] / verdict[k, VARIANCE]
    return left * left * precision < REMAINS * REMAINS
