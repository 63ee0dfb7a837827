"""Gauss-Newton on the pixels of one narrow band about an outline, with gated sectors and free nuisances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J, arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.band import collect_band
from wentry_cli.contours.likelihood import STATE, SUMS, accumulate, first_levels
from wentry_cli.contours.normal_equations import factorise, substitute
from wentry_cli.contours.nuisances import PRIOR_LN_S, Belief, add_priors, noise_levels, priors, weigh_noise
from wentry_cli.contours.sectors import (
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    NUISANCES,
    VERDICT,
    assemble,
    judge,
    level_spread,
    set_state,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SECTOR_PX = 2.5
SECTOR_ANGLE = math.radians(12.0)
HALF_PX = 6.0
SETTLED_PX = 0.004
ROUNDS = 6


class Band(NamedTuple):
    """Pixels about the outline, the sectors they fall into, and what the scene is like.

    ``scene`` holds centre (x, y), radius and motion (x, y); ``settings`` the top row, the motion (x, y), the ceiling
    and 1 where outliers lie outside only.
    """

    pixels: Floats
    sectors: Ints
    rows: Floats
    scene: Floats
    settings: Floats


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
def half_width(settings: Floats) -> float:
    """Half of the width of the band, px: the edge and enough of both levels beside it, wherever it moves."""
    return HALF_PX + 0.5 * math.hypot(settings[1], settings[2])


@compiled
def gather_band(values: NDArray[np.float32], shape: Floats, settings: Floats, masked: float) -> Band:
    """Cut the outline of ``shape`` into sectors and collect the pixels about it.

    ``masked`` is the level that masked pixels outside of the edge are taken to have; NaN leaves them out.
    """
    a, b = semi_axes(shape)
    count, table = quadrant_table(a, b, SECTOR_PX, SECTOR_ANGLE)
    rows = arc_geometry(shape, sector_angles(count, table))
    half = half_width(settings)
    limits = np.array([min(half, 0.5 * min(a, b)), half, settings[0], masked])
    pixels, sectors, _ = collect_band(values, shape, count, table, limits)
    scene = np.array([shape[0], shape[1], shape[2], settings[1], settings[2]])
    return Band(pixels, sectors, rows, scene, settings)


@compiled
def first_belief(band: Band) -> Belief:
    """Levels from the pixels away from the edge; the level inside is NaN where no sector has any."""
    nuisance = np.zeros(NUISANCES)
    low, high = first_levels(band.pixels, band.sectors, band.rows.shape[0], half_width(band.settings))
    nuisance[LEVEL_IN], nuisance[LEVEL_OUT] = low, 1.0 if math.isnan(high) else high
    nuisance[LN_S] = PRIOR_LN_S
    prior = priors(nuisance, band.scene[2], band.settings[3])
    return Belief(nuisance, prior, np.zeros(2), np.full(2, 1e-8), np.zeros(5))


@compiled
def solve_band(band: Band, belief: Belief, free: Ints, patience: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Gauss-Newton steps of the free parameters over one band of pixels; ``belief`` is changed in place.

    For the first ``patience`` turns no sector is left out for standing out from the others.

    Returns the total step (5), the Cholesky factor of the last normal matrix (empty where it was singular), the sums
    and the verdict of the sectors.
    """
    count = band.rows.shape[0]
    sums, state = np.zeros((count, SUMS)), np.zeros((count, STATE))
    verdict = np.zeros((count, VERDICT))
    moved = np.zeros(5)
    normal = np.zeros((0, 0))
    for turn in range(ROUNDS):
        set_state(state, band.rows, moved, belief.nuisance, band.scene)
        fresh = belief.noise[1] == 0.0
        if fresh:
            belief.noise[:] = 1.0
        accumulate(band.pixels, band.sectors, state, belief.noise, band.settings[3], sums)
        if fresh:
            weigh_noise(sums, verdict, belief.noise)
        level_spread(sums, belief.spread)
        judge(sums, belief.spread, band.scene[2], band.settings[4] > 0.0, turn < patience, verdict)
        normal, right = assemble(sums, verdict, band.rows, free, band.scene, belief.spread)
        add_priors(normal, right, free, moved, belief)
        good, change = update(normal, right, free, band.rows, moved, belief.nuisance)
        if not good:
            return moved, np.zeros((0, 0)), sums, verdict
        noise_levels(sums, verdict, belief.noise)
        if (turn > patience and change < SETTLED_PX) or change > 2.0:
            break
    return moved, normal, sums, verdict
