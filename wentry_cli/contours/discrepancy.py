"""What the covariance of a perfect ellipse leaves out: outlines that are smooth but no ellipse.

Where the kept sectors disagree by more than their noise, the outline is taken to depart from the ellipse by smooth
waves that an ellipse cannot follow (three to five periods round the sphere, equal variance each). The part of them that
shows in the residual gives their variance; the part that the parameters swallow gives the uncertainty.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import NX, NY, J, X, Y
from wentry_cli.contours.normal_equations import invert_block, substitute
from wentry_cli.contours.sectors import LEVEL_IN, LEVEL_OUT, LN_S, LOCAL, MOVED, SLOPE_X, SLOPE_Y, VARIANCE, WEIGHT

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WAVES = (3, 4, 5)  # one after the other
# Order of the cross terms of a sector's displacement in the marginalised sums.
CROSS = (0, 1, 3, 6)


@compiled
def residual_statistics(verdict: Floats, size: int) -> tuple[float, float]:
    """Root mean square of the kept sectors' displacements (px) and their reduced chi square."""
    weights, squares, chi2, number = 0.0, 0.0, 0.0, 0
    for k in range(verdict.shape[0]):
        weight = verdict[k, WEIGHT]
        if weight > 0.0:
            number += 1
            weights += weight
            squares += weight * verdict[k, MOVED] ** 2
            chi2 += weight * verdict[k, MOVED] ** 2 / verdict[k, VARIANCE]
    if number <= size:
        return math.nan, math.nan
    return math.sqrt(squares / weights), chi2 / max(1.0, weights - size)


@compiled
def excess_variance(verdict: Floats, size: int) -> float:
    """Variance of the kept displacements beyond their noise (px^2); 0 where it is not significant (3 sigma)."""
    weights, squares, noise, chi2 = 0.0, 0.0, 0.0, 0.0
    for k in range(verdict.shape[0]):
        weight = verdict[k, WEIGHT]
        if weight > 0.0:
            weights += weight
            squares += weight * verdict[k, MOVED] ** 2
            noise += weight * verdict[k, VARIANCE]
            chi2 += weight * verdict[k, MOVED] ** 2 / verdict[k, VARIANCE]
    freedom = max(1.0, weights - size)
    if chi2 < freedom + 3.0 * math.sqrt(2.0 * freedom):
        return 0.0
    return max(0.0, (squares - noise) / weights)


@compiled
def pull_of_sectors(verdict: Floats, rows: Floats, free: Ints, scene: Floats, total: int) -> Floats:
    """Right-hand side of the global equations per pixel of displacement of each sector (sectors, total)."""
    size = free.size
    pull = np.zeros((rows.shape[0], total))
    for k in range(rows.shape[0]):
        weight, local = verdict[k, WEIGHT], verdict[k, LOCAL:]
        if weight <= 0.0:
            continue
        for j in range(size):
            pull[k, j] = weight * local[CROSS[0]] * rows[k, J + free[j]]
        outside = weight * local[CROSS[2]]
        pull[k, size + LEVEL_IN] = weight * local[CROSS[1]]
        pull[k, size + LEVEL_OUT] = outside
        pull[k, size + SLOPE_X] = outside * (rows[k, X] - scene[0]) / scene[2]
        pull[k, size + SLOPE_Y] = outside * (rows[k, Y] - scene[1]) / scene[2]
        pull[k, size + LN_S] = weight * local[CROSS[3]]
    return pull


@compiled
def waves_at(rows: Floats) -> Floats:
    """Cosine and sine of each of WAVES at each sector (2 * waves, sectors), their phase 0 at the bottom.

    Powers of the unit number that the normal is, whose argument is the angle from the bottom.
    """
    shapes = np.empty((2 * len(WAVES), rows.shape[0]))
    for k in range(rows.shape[0]):
        real, imaginary = rows[k, NY], rows[k, NX]
        for _ in range(WAVES[0] - 1):
            real, imaginary = real * rows[k, NY] - imaginary * rows[k, NX], real * rows[k, NX] + imaginary * rows[k, NY]
        for index in range(len(WAVES)):
            shapes[2 * index, k], shapes[2 * index + 1, k] = real, imaginary
            real, imaginary = real * rows[k, NY] - imaginary * rows[k, NX], real * rows[k, NX] + imaginary * rows[k, NY]
    return shapes


@compiled
def add_discrepancy(
    covariance: Floats, factor: Floats, pull: Floats, rows: Floats, weight: Floats, free: Ints, excess: float
) -> None:
    """Widen ``covariance`` of the free parameters in place.

    ``factor`` is the Cholesky factor of the normal matrix, ``pull`` the right-hand side per pixel of displacement of
    each sector, ``weight`` what each counts, and ``excess`` the variance that is not noise (px^2).
    """
    size = free.size
    shapes = waves_at(rows)
    steps = np.zeros((shapes.shape[0], factor.shape[0]))
    remaining = 0.0
    for index in range(shapes.shape[0]):
        for k in range(rows.shape[0]):
            if weight[k] > 0.0:
                for j in range(factor.shape[0]):
                    steps[index, j] += pull[k, j] * shapes[index, k]
        substitute(factor, steps[index])
        squares, weights = 0.0, 0.0
        for k in range(rows.shape[0]):
            if weight[k] > 0.0:
                rest = shapes[index, k]
                for j in range(size):
                    rest -= rows[k, J + free[j]] * steps[index, j]
                squares += weight[k] * rest * rest
                weights += weight[k]
        remaining += squares / weights
    variance = excess / max(remaining, 1e-3)
    for index in range(shapes.shape[0]):
        for i in range(size):
            for j in range(size):
                covariance[i, j] += variance * steps[index, i] * steps[index, j]


@compiled
def concluded(verdict: Floats, factor: Floats, rows: Floats, free: Ints, scene: Floats) -> tuple[Floats, float]:
    """Covariance of the free parameters, and the root mean square of what the sectors are still off by (px).

    ``factor`` is the Cholesky factor of the normal matrix, ``verdict`` what the sectors say after the last step. The
    residual is NaN where too few sectors are left.
    """
    size = free.size
    residual, chi2 = residual_statistics(verdict, size)
    if math.isnan(chi2):
        return np.zeros((size, size)), math.nan
    covariance = invert_block(factor, size, max(1.0, chi2))
    excess = excess_variance(verdict, size)
    if excess > 0.0:
        pull = pull_of_sectors(verdict, rows, free, scene, factor.shape[0])
        add_discrepancy(covariance, factor, pull, rows, verdict[:, WEIGHT].copy(), free, excess)
    return covariance, residual
