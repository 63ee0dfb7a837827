"""What each sector says by itself, and how far it is believed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import DEPARTURE, KAPPA, NX, NY, X, Y, displacement_of
from wentry_cli.contours.likelihood import (
    CHI2,
    COUNT,
    DD,
    DI,
    DO,
    GD,
    GI,
    GO,
    GRADIENT,
    II,
    INSIDE,
    INV_S,
    IO,
    IS,
    KAPPA_S,
    OFFSET,
    OO,
    OS,
    OUTSIDE,
    RATIO,
    SMEAR,
)
from wentry_cli.imaging.order_statistics import median_of, quantile_of

Floats = NDArray[np.float64]

# Columns of the verdict on a sector: its own displacement of the edge and variance (px, px^2), its reduced chi
# square, its weight, its number of pixels (0 where they are too few), and from LOCAL on its normal equations without
# its own levels (see `marginalise`).
MOVED, VARIANCE, QUALITY, WEIGHT, NUMBER, LOCAL, VERDICT = 0, 1, 2, 3, 4, 5, 19
# Order of the nuisance parameters behind the free ones: levels, slope of the ground over a radius, ln s.
LEVEL_IN, LEVEL_OUT, SLOPE_X, SLOPE_Y, LN_S, NUISANCES = 0, 1, 2, 3, 4, 5

# What a real sphere may depart from the model before a sector is left out, the greater of the two.
TOLERANCE_PX = 0.15
TOLERANCE_OF_R = 0.0025
HARD_GATE = 3.0
# Variance of the sectors' own levels that is always allowed for.
LEAST_SPREAD = 1e-6
# Pixels that a sector must have, and where those that something hides were taken out of it.
LEAST_PIXELS, LEAST_LEFT = 12.0, 6.0
# Motion across the edge with less variance than this counts as blur.
LEAST_SMEAR_PX2 = 0.1
# Displacements over (uncertainty x scale), and standard deviations that the chi square of a sector lies above the usual
# one, between which weight is lost.
SOFT_START, SOFT_END = 3.0, 5.0
QUALITY_START, QUALITY_END = 3.0, 5.0
# What hides more than this share of an outline is dark before bright: in a sector that it only touches the edge seems
# to lie farther outside, and an edge that does is doubted so many times as much.
HIDDEN, DARKER_OUTSIDE = 0.15, 1.5
# Reduced chi squares over the usual one below which a sector tells how far sectors lie off.
CLEAN = 1.7


@compiled
def set_state(state: Floats, rows: Floats, moved: Floats, nuisance: Floats, scene: Floats) -> None:
    """Expected edge of every sector from the global parameters.

    ``moved`` is the parameter step since the band was collected; ``scene`` holds the centre (x, y), the radius and
    the motion during the exposure (x, y), px.
    """
    s2 = math.exp(2.0 * nuisance[LN_S])
    for k in range(rows.shape[0]):
        across = (scene[3] * rows[k, NX] + scene[4] * rows[k, NY]) ** 2 / 12.0
        along = (scene[3] * rows[k, NY] - scene[4] * rows[k, NX]) ** 2 / 12.0
        kappa = min(rows[k, KAPPA], 1.0)
        tangential = s2 + along
        normal = s2 + 0.5 * (kappa * tangential) ** 2
        smeared = across > LEAST_SMEAR_PX2
        if not smeared:
            normal += across
        displacement = rows[k, DEPARTURE] + displacement_of(rows[k], moved)
        state[k, OFFSET] = 0.5 * kappa * tangential - displacement
        state[k, INV_S] = 1.0 / math.sqrt(normal)
        # the changes of the shift and of ln(normal s) with ln s
        state[k, KAPPA_S] = kappa * s2 * state[k, INV_S]
        state[k, RATIO] = s2 / normal
        # half the path, whose square is three times the variance
        state[k, SMEAR] = math.sqrt(3.0 * across) * state[k, INV_S] if smeared else 0.0
        state[k, INSIDE] = nuisance[LEVEL_IN]
        x, y = (rows[k, X] - scene[0]) / scene[2], (rows[k, Y] - scene[1]) / scene[2]
        state[k, OUTSIDE] = nuisance[LEVEL_OUT] + nuisance[SLOPE_X] * x + nuisance[SLOPE_Y] * y
        slope = nuisance[SLOPE_X] * rows[k, NX] + nuisance[SLOPE_Y] * rows[k, NY]
        state[k, GRADIENT] = slope / scene[2]


@compiled
def level_spread(sums: Floats, spread: Floats, most: float, fewest: float) -> None:
    """Robust variance of the sectors' own grey levels (inside, outside) beyond their noise, into ``spread``.

    Outside it is at most ``most``: what stands before half of the ground does not make the rest of it uneven.
    """
    inside, outside = np.empty(sums.shape[0]), np.empty(sums.shape[0])
    expected_in, expected_out = np.empty(sums.shape[0]), np.empty(sums.shape[0])
    number = 0
    for k in range(sums.shape[0]):
        row = sums[k]
        if row[COUNT] < fewest or row[DD] <= 0.0:
            continue
        ii, oo = row[II] - row[DI] ** 2 / row[DD], row[OO] - row[DO] ** 2 / row[DD]
        io = row[IO] - row[DI] * row[DO] / row[DD]
        gi, go = row[GI] - row[DI] * row[GD] / row[DD], row[GO] - row[DO] * row[GD] / row[DD]
        determinant = ii * oo - io * io
        if determinant <= 1e-9 * row[II] * row[OO]:
            continue
        inside[number] = abs(oo * gi - io * go) / determinant
        outside[number] = abs(ii * go - io * gi) / determinant
        expected_in[number], expected_out[number] = oo / determinant, ii / determinant
        number += 1
    if number < 5:
        return
    for side in range(2):
        found = median_of(inside if side == 0 else outside, number) * 1.4826
        expected = median_of(expected_in if side == 0 else expected_out, number)
        spread[side] = max(LEAST_SPREAD, found * found - 1.6 * expected)
    spread[1] = max(LEAST_SPREAD, min(most, spread[1]))


@compiled
def marginalise(row: Floats, spread: Floats, local: Floats) -> float:
    """Normal equations of a sector without its own levels, whose priors have the variances ``spread``.

    ``local`` receives (DD, DI, II, DO, IO, OO, DS, IS, OS, SS, GD, GI, GO, GS) and the gain in chi square is
    returned.
    """
    ii, oo, io = row[II] + 1.0 / spread[0], row[OO] + 1.0 / spread[1], row[IO]
    determinant = ii * oo - io * io
    a, b, c = oo / determinant, ii / determinant, -io / determinant
    left = (row[DI], row[II], row[IO], row[IS], row[GI])
    right = (row[DO], row[IO], row[OO], row[OS], row[GO])
    index = 0
    for i in range(4):
        for j in range(i + 1):
            product = a * left[i] * left[j] + b * right[i] * right[j]
            product += c * (left[i] * right[j] + left[j] * right[i])
            local[index] = row[index] - product
            index += 1
    for i in range(4):
        product = a * left[i] * left[4] + b * right[i] * right[4]
        product += c * (left[i] * right[4] + left[4] * right[i])
        local[GD + i] = row[GD + i] - product
    return float(a * left[4] * left[4] + b * right[4] * right[4] + 2.0 * c * left[4] * right[4])


@compiled
def shun_neighbours(verdict: Floats) -> None:
    """Halve the weight of a sector beside one that was left out: what hides one reaches into the next."""
    count = verdict.shape[0]
    out = np.zeros(count, dtype=np.bool_)
    for k in range(count):
        out[k] = verdict[k, WEIGHT] == 0.0 and not math.isnan(verdict[k, MOVED])
    for k in range(count):
        if out[k - 1] or out[(k + 1) % count]:
            verdict[k, WEIGHT] *= 0.5


@compiled
def hear_sectors(sums: Floats, spread: Floats, verdict: Floats, fewest: float) -> None:
    """Fill ``verdict`` with what each sector says by itself, its weight 0; NaN is its displacement where nothing."""
    for k in range(sums.shape[0]):
        verdict[k] = 0.0
        verdict[k, MOVED] = math.nan
        local = verdict[k, LOCAL:]
        if sums[k, COUNT] < fewest:
            continue
        verdict[k, NUMBER] = sums[k, COUNT]
        gain = marginalise(sums[k], spread, local)
        if local[DD] <= 1.0:
            continue
        verdict[k, MOVED] = local[GD] / local[DD]
        verdict[k, VARIANCE] = 1.0 / local[DD]
        chi2 = sums[k, CHI2] - gain - local[GD] ** 2 / local[DD]
        verdict[k, QUALITY] = chi2 / (sums[k, COUNT] - 3.0)


@compiled
def weigh_sectors(verdict: Floats, radius: float, one_sided: bool, patient: bool, loose: Floats) -> float:
    """Fill in the weights and return the robust scale of the sectors' displacements over their own uncertainties.

    A sector is left out where z^2 = d^2 / (variance + tolerance^2) exceeds the gate, and loses weight where its own
    pixels do not look like an edge or, unless ``patient``, where it stands out from those that do. ``loose`` is the
    variance (px^2) of the outline at each sector: far from those that were kept it is hardly known where an edge is to
    be expected.
    """
    number = 0
    ratios, qualities = np.empty(verdict.shape[0]), np.empty(verdict.shape[0])
    for k in range(verdict.shape[0]):
        verdict[k, WEIGHT] = 0.0
        if not math.isnan(verdict[k, MOVED]):
            ratios[number] = abs(verdict[k, MOVED]) / math.sqrt(verdict[k, VARIANCE])
            qualities[number] = verdict[k, QUALITY]
            number += 1
    if number == 0:
        return math.nan
    usual = quantile_of(qualities, number, 0.25) / 0.85
    clean = 0
    for index in range(number):
        if qualities[index] < CLEAN * usual:
            ratios[clean] = ratios[index]
            clean += 1
    scale = max(1.0, 1.4826 * median_of(ratios, clean))
    tolerance = max(TOLERANCE_PX, TOLERANCE_OF_R * radius)
    doubt = DARKER_OUTSIDE if clean < (1.0 - HIDDEN) * number else 1.0
    for k in range(verdict.shape[0]):
        moved = verdict[k, MOVED]
        if math.isnan(moved):
            continue
        z = abs(moved) / math.sqrt(verdict[k, VARIANCE] + tolerance * tolerance)
        gate = HARD_GATE if not one_sided else (0.67 * HARD_GATE if moved > 0.0 else 1.33 * HARD_GATE)
        stands_out = 0.0 if patient else abs(moved) / math.sqrt(verdict[k, VARIANCE] * scale * scale + loose[k])
        if moved > 0.0:
            stands_out *= doubt
        excess = (verdict[k, QUALITY] / max(usual, 1e-12) - 1.0) * math.sqrt(0.5 * (verdict[k, NUMBER] - 3.0))
        if z > gate or stands_out > SOFT_END or excess > QUALITY_END:
            continue
        weight = min(1.0, (SOFT_END - stands_out) / (SOFT_END - SOFT_START))
        weight *= min(1.0, (QUALITY_END - excess) / (QUALITY_END - QUALITY_START))
        verdict[k, WEIGHT] = weight
    shun_neighbours(verdict)
    return scale
