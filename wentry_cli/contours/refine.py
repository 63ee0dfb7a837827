"""Level "accurate": Gauss-Newton on the pixels of a narrow band, with gated sectors and free nuisances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, farthest
from wentry_cli.contours.band_solution import Band, first_belief, gather_band, half_width, solve_band
from wentry_cli.contours.discrepancy import (
    add_common_shift,
    add_discrepancy,
    excess_variance,
    pull_of_sectors,
    residual_statistics,
)
from wentry_cli.contours.likelihood import COUNT, first_levels
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.contours.nuisances import Belief
from wentry_cli.contours.reconsider import other_ellipse
from wentry_cli.contours.sectors import LEAST_PIXELS, LEVEL_IN, LEVEL_OUT, LN_S, WEIGHT
from wentry_cli.contours.turning import no_turn, pixel_turn, wants_tilt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RECOLLECT_PX = 0.25
# Where the ground is clipped nobody knows how bright it is, nor where half of it lies: uncertainty of the edge.
CLIPPED_SHARE, CLIPPED_PX = 0.995, 0.2
# With more of the outline left out, another ellipse is tried, if it lies farther away than this.
DOUBTFUL, OTHER_PX = 0.5, 0.03
COLLECTIONS = 4
# Entries of the report of `refine_shape`.
STATUS, BLUR, ARC, GATED, RESIDUAL, IN, OUT, WAVES, REPORT = 0, 1, 2, 3, 4, 5, 6, 7, 8
SINGULAR, LOST = 1.0, 2.0


@compiled
def arc_shares(rows: Floats, sums: Floats, verdict: Floats) -> tuple[float, float]:
    """Share of the perimeter that has pixels, and the share of that which was left out."""
    total, seen, kept = 0.0, 0.0, 0.0
    for k in range(rows.shape[0]):
        total += rows[k, LENGTH]
        if sums[k, COUNT] >= LEAST_PIXELS:
            seen += rows[k, LENGTH]
            kept += rows[k, LENGTH] * verdict[k, WEIGHT]
    return seen / total, 1.0 - kept / max(seen, 1e-9)


class Solution(NamedTuple):
    """The last band and what came out of it: beliefs, step (5), Cholesky factor, sums and verdict of the sectors."""

    band: Band
    belief: Belief
    moved: Floats
    factor: Floats
    sums: Floats
    verdict: Floats


@compiled
def settle(
    values: NDArray[np.float32], shape: Floats, free: Ints, band: Band, belief: Belief, masked: float, report: Floats
) -> Solution:
    """Solve, and collect again where the outline has moved; ``shape`` and ``report`` are changed in place."""
    settings = band.settings
    moved, factor, sums, verdict = solve_band(band, belief, free, 0)
    for _ in range(COLLECTIONS):
        report[ARC], report[GATED] = arc_shares(band.rows, sums, verdict)
        if factor.size == 0:
            report[STATUS] = SINGULAR
            break
        far = farthest(band.rows, moved)
        shape[:5] += moved
        if far > 4.0 or not (0.3 < shape[3] < 4.0 and shape[2] > 2.0):
            report[STATUS] = LOST
            break
        report[STATUS] = 0.0
        if far < RECOLLECT_PX:
            break
        band = gather_band(values, shape, settings, masked)
        moved, factor, sums, verdict = solve_band(band, belief, free, 0)
    return Solution(band, belief, moved, factor, sums, verdict)


@compiled
def reconsider(
    values: NDArray[np.float32], shape: Floats, free: Ints, first: Solution, masked: float, report: Floats
) -> Solution:
    """Try the ellipse that most edge-like sectors agree on; it is kept where less of the outline speaks against it."""
    step = other_ellipse(first.verdict, first.band.rows, free)
    if farthest(first.band.rows, step) < OTHER_PX:
        return first
    other, told = shape.copy(), report.copy()
    other[:5] += step
    band = gather_band(values, other, first.band.settings, masked)
    second = settle(values, other, free, band, first_belief(band), masked, told)
    if told[STATUS] == 0.0 and told[GATED] < report[GATED]:
        shape[:] = other
        report[:] = told
        return second
    return first


@compiled
def refine_shape(
    values: NDArray[np.float32], shape: Floats, free: Ints, settings: Floats
) -> tuple[Floats, Floats, Floats]:
    """Maximise the likelihood from a start that is right to a fraction of a pixel; ``shape`` is moved in place.

    ``settings`` as in `Band`. Returns the covariance of the free parameters, the report (status, blur, arc, gated,
    residual, levels inside and outside, variance of the departure from an ellipse), and the turn (see `turning`).
    """
    report = np.zeros(REPORT)
    report[STATUS] = LOST
    nothing = np.zeros((free.size, free.size))
    masked = math.nan
    band = gather_band(values, shape, settings, masked)
    if math.isnan(first_levels(band.pixels, band.sectors, band.rows.shape[0], half_width(band.settings))[1]):
        # no light was left outside of the edge: it was clipped and masked, so it is at least the ground's 1
        masked = 1.0
        band = gather_band(values, shape, settings, masked)
    belief = first_belief(band)
    if math.isnan(belief.nuisance[LEVEL_IN]):
        return nothing, report, no_turn()
    solution = settle(values, shape, free, band, belief, masked, report)
    if report[STATUS] == 0.0 and report[GATED] > DOUBTFUL:
        solution = reconsider(values, shape, free, solution, masked, report)
    if report[STATUS] != 0.0:
        return nothing, report, no_turn()
    band, belief, moved, factor, sums, verdict = solution
    report[RESIDUAL], chi2 = residual_statistics(verdict, free.size)
    if math.isnan(chi2):
        report[STATUS] = LOST
        return nothing, report, no_turn()
    report[BLUR] = math.exp(belief.nuisance[LN_S])
    report[IN], report[OUT] = belief.nuisance[LEVEL_IN], belief.nuisance[LEVEL_OUT]
    covariance = invert_block(factor, free.size, max(1.0, chi2))
    pull = pull_of_sectors(sums, verdict, band.rows, free, band.scene, belief.spread, factor.shape[0])
    excess = excess_variance(verdict, free.size)
    weight = verdict[:, WEIGHT].copy()
    report[WAVES] = add_discrepancy(covariance, factor, pull, band.rows, weight, free, excess)
    if masked == 1.0 or report[OUT] >= CLIPPED_SHARE * band.settings[3]:
        add_common_shift(covariance, factor, pull, CLIPPED_PX)
    turn = no_turn()
    if wants_tilt(free):
        turn = pixel_turn(sums, verdict, band.rows, band.scene, free, moved, belief)
    return covariance, report, turn
