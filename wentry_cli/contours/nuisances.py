"""What is not asked for but must be known: grey levels, slope of the ground, blur and noise, with their priors."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import NX, NY, X, Y
from wentry_cli.contours.likelihood import (
    CHI2,
    COUNT,
    COUNT_IN,
    COUNT_OUT,
    REST_IN,
    REST_OUT,
    SQUARE_IN,
    SQUARE_OUT,
)
from wentry_cli.contours.normal_equations import solve
from wentry_cli.contours.plateau import FEWEST_SECTORS, LL, OUTER, D, L, N
from wentry_cli.contours.sectors import (
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    NUISANCES,
    SLOPE_X,
    SLOPE_Y,
    WEIGHT,
)
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PRIOR_LN_S = math.log(1.08)
PRIOR_LN_S_UNC = 0.35
PRIOR_LEVEL_UNC = 0.1
# A clipped ground is taken to be as bright as the sensor says; how much brighter it is nobody knows.
PRIOR_CLIPPED_UNC = 0.003
PRIOR_SLOPE_PER_PX = 2e-4
LEAST_NOISE = 1e-8
# Pixels on one side of a sector that tell a scatter.
LEAST_SCATTERED = 4.0


class Belief(NamedTuple):
    """What is known beside the shape, changed in place: nuisances, their priors (means, variances), noise, spread.

    ``noise`` are variances of a pixel inside and outside, ``spread`` those of the sectors' own levels.
    ``precision`` are inverse variances of Gaussian priors about 0 on the steps of the five parameters.
    """

    nuisance: Floats
    prior: Floats
    noise: Floats
    spread: Floats
    precision: Floats


@compiled
def noise_levels(sums: Floats, verdict: Floats, noise: Floats) -> None:
    """Robust variance of a pixel on the dark and on the bright side of the edge, into ``noise``."""
    for side in range(2):
        count, rest, square = (COUNT_IN, REST_IN, SQUARE_IN) if side == 0 else (COUNT_OUT, REST_OUT, SQUARE_OUT)
        means = np.empty(sums.shape[0])
        number = 0
        for k in range(sums.shape[0]):
            if sums[k, count] >= LEAST_SCATTERED and verdict[k, WEIGHT] > 0.0:
                # about the sector's own level: that of the model may not be right yet
                means[number] = (sums[k, square] - sums[k, rest] ** 2 / sums[k, count]) / (sums[k, count] - 1.0)
                number += 1
        if number >= 4:
            noise[side] = max(LEAST_NOISE, median_of(means, number))
    bound_noise(noise)


@compiled
def bound_noise(noise: Floats) -> None:
    """Light brings its own noise: what looks quieter on the bright side is clipped, or a sum over few pixels."""
    noise[1] = max(noise[1], noise[0])
    noise[0] = max(noise[0], 0.02 * noise[1])


@compiled
def first_noise(plateaus: Floats) -> Floats:
    """Variance of a pixel inside and outside from beyond the band of the edge; 0 where that is not seen on both sides.

    ``plateaus`` are the moments of `plateau`.
    """
    noise, scatter = np.zeros(2), np.empty(plateaus.shape[0])
    for side in range(2):
        number = 0
        for k in range(plateaus.shape[0]):
            one = plateaus[k, side]
            if one[N] > 0.0:
                scatter[number] = (one[LL] - one[L] ** 2 / one[N]) / (one[N] - 1.0)
                number += 1
        if number < FEWEST_SECTORS:
            return np.zeros(2)
        noise[side] = max(LEAST_NOISE, median_of(scatter, number))
    bound_noise(noise)
    return noise


@compiled
def mean_levels(plateaus: Floats) -> tuple[float, float]:
    """Mean levels inside and outside, beyond the band."""
    number, level = np.zeros(2), np.zeros(2)
    for k in range(plateaus.shape[0]):
        for side in range(2):
            number[side] += plateaus[k, side, N]
            level[side] += plateaus[k, side, L]
    return level[0] / number[0], level[1] / number[1]


@compiled
def tilt_ground(plateaus: Floats, rows: Floats, scene: Floats, belief: Belief) -> None:
    """Put into ``belief`` what level and slope of the ground are beyond the band, as far as its priors let them."""
    normal, right, place = np.zeros((3, 3)), np.zeros(3), np.ones(3)
    for i in range(3):
        normal[i, i] = belief.noise[1] / belief.prior[1, LEVEL_OUT + i]
    for k in range(plateaus.shape[0]):
        one = plateaus[k, OUTER]
        if one[N] == 0.0:
            continue
        away = one[D] / one[N]
        place[1] = (rows[k, X] + away * rows[k, NX] - scene[0]) / scene[2]
        place[2] = (rows[k, Y] + away * rows[k, NY] - scene[1]) / scene[2]
        rest = one[L] - one[N] * belief.nuisance[LEVEL_OUT]
        for i in range(3):
            right[i] += rest * place[i]
            for j in range(i + 1):
                normal[i, j] += one[N] * place[i] * place[j]
    if solve(normal, right):
        for i in range(3):
            belief.nuisance[LEVEL_OUT + i] += right[i]


@compiled
def add_priors(normal: Floats, right: Floats, free: Ints, moved: Floats, belief: Belief) -> None:
    """Gaussian priors on the steps of the free parameters and on the nuisances."""
    size = free.size
    for i in range(size):
        normal[i, i] += belief.precision[free[i]]
        right[i] -= moved[free[i]] * belief.precision[free[i]]
    for i in range(NUISANCES):
        variance = belief.prior[1, i]
        normal[size + i, size + i] += 1.0 / variance
        right[size + i] -= (belief.nuisance[i] - belief.prior[0, i]) / variance


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
        prior[1, LEVEL_OUT] = (PRIOR_CLIPPED_UNC * contrast) ** 2
    return prior


@compiled
def weigh_noise(sums: Floats, verdict: Floats, noise: Floats) -> None:
    """First estimate of the noise from sums that were taken with unit variance, which are rescaled."""
    verdict[:, WEIGHT] = 1.0
    noise_levels(sums, verdict, noise)
    mean = 0.5 * (noise[0] + noise[1])
    for k in range(sums.shape[0]):
        for i in range(COUNT):
            sums[k, i] /= mean
        sums[k, CHI2] /= mean
