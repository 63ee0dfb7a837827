"""Level "accurate": Gauss-Newton on the pixels of a narrow band, with gated sectors and free nuisances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, farthest
from wentry_cli.contours.band import Band, gather_band, reach_of
from wentry_cli.contours.discrepancy import concluded
from wentry_cli.contours.global_step import advance, is_negligible, outline_variance, remains, step_from
from wentry_cli.contours.likelihood import STATE, SUMS, accumulate, first_levels
from wentry_cli.contours.nuisances import (
    Belief,
    first_noise,
    mean_levels,
    noise_levels,
    priors,
    tilt_ground,
    weigh_noise,
)
from wentry_cli.contours.plateau import LEVEL_RANGE, add_plateaus
from wentry_cli.contours.scan import LEAST_HEIGHT
from wentry_cli.contours.sectors import (
    LEAST_LEFT,
    LEAST_PIXELS,
    LEAST_SPREAD,
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    NUISANCES,
    NUMBER,
    VERDICT,
    WEIGHT,
    hear_sectors,
    level_spread,
    set_state,
    weigh_sectors,
)
from wentry_cli.contours.spoilt import cleaned_of
from wentry_cli.contours.turning import no_turn, pixel_turn, wants_tilt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WIDER = 1.25  # by how much an edge may be more blurred than the band is wide
SETTLED_PX = 0.004
RECOLLECT_PX = 0.25
# Share of an outline that may disagree where it was not scanned.
MOST_UNSCANNED = 0.15
ROUNDS = 6
# By how much noise and levels of the sectors may still change in the last round.
STEADY = 0.2
# Share of the outline left out from which it is worth looking at single pixels.
HIDDEN_SHARE = 0.02
COLLECTIONS = 4
# How often single pixels are looked at, as long as that moves the outline.
REGAINS = 4
# Entries of the report of `refine_shape`.
STATUS, BLUR, ARC, GATED, RESIDUAL, PLAIN, REPORT = 0, 1, 2, 3, 4, 5, 6
SINGULAR, LOST = 1.0, 2.0


class Refined(NamedTuple):
    """An outline whose likelihood is greatest.

    ``report`` holds status, blur, arc, gated, residual, and 1 where the band holds all pixels and no masked ones;
    ``covariance`` that of the free parameters; ``turn`` as in `turning`. ``band`` is the last one, ``belief`` what is
    believed of it, and ``verdict`` what its sectors say of the outline that was found.
    """

    report: Floats
    covariance: Floats
    turn: Floats
    band: Band
    belief: Belief
    verdict: Floats


@compiled
def take(step: Floats, free: Ints, moved: Floats, nuisance: Floats) -> float:
    """Add a step to the parameters ``moved`` (5) and the nuisances in place; returns the change of ln s."""
    size = free.size
    for i in range(size):
        moved[free[i]] += step[i]
    for i in range(NUISANCES - 1):
        nuisance[i] += step[size + i]
    blur = float(min(0.35, max(-0.35, step[size + LN_S])))
    nuisance[LN_S] = min(1.8, max(-1.2, nuisance[LN_S] + blur))
    return blur


@compiled
def arc_shares(rows: Floats, verdict: Floats) -> tuple[float, float]:
    """Share of the perimeter that has pixels, and the share of that which was left out."""
    total, seen, kept = 0.0, 0.0, 0.0
    for k in range(rows.shape[0]):
        total += rows[k, LENGTH]
        if verdict[k, NUMBER] > 0.0:
            seen += rows[k, LENGTH]
            kept += rows[k, LENGTH] * verdict[k, WEIGHT]
    return seen / total, 1.0 - kept / max(seen, 1e-9)


@compiled
def first_belief(band: Band, ln_blur: float, ground: float) -> Belief:
    """What is believed at first: levels and noise from beyond the band, else levels from its rims and no noise.

    Where nothing tells them the level inside is NaN and that outside ``ground``.
    """
    nuisance, noise = np.zeros(NUISANCES), first_noise(band.plateaus)
    if noise[1] > 0.0:
        nuisance[LEVEL_IN], nuisance[LEVEL_OUT] = mean_levels(band.plateaus)
    else:
        nuisance[LEVEL_IN], nuisance[LEVEL_OUT] = first_levels(band.pixels, band.starts)
        if math.isnan(nuisance[LEVEL_OUT]):
            nuisance[LEVEL_OUT] = ground
    nuisance[LN_S] = ln_blur
    prior = priors(nuisance, band.scene[2], band.settings[3])
    belief = Belief(nuisance, prior, noise, np.full(2, LEAST_SPREAD), np.zeros(5))
    if noise[1] > 0.0:
        tilt_ground(band.plateaus, band.rows, band.scene, belief)
    return belief


@compiled
def is_steady(before: Floats, after: Floats) -> bool:
    """Whether two variances are nearly what they were before."""
    return bool(max(abs(after[0] / before[0] - 1.0), abs(after[1] / before[1] - 1.0)) < STEADY)


@compiled
def solve_band(band: Band, belief: Belief, free: Ints, patience: int) -> tuple[Floats, Floats, Floats]:
    """Gauss-Newton steps of the free parameters over one band of pixels; ``belief`` is changed in place.

    For the first ``patience`` turns no sector is left out for standing out from the others.

    Returns the total step (5), the Cholesky factor of the last normal matrix (empty where it was singular), and what
    the sectors say after the last step.
    """
    count = band.rows.shape[0]
    sums, state = np.zeros((count, SUMS)), np.zeros((count, STATE))
    verdict = np.zeros((count, VERDICT))
    moved, loose, factor = np.zeros(5), np.zeros(count), np.zeros((0, 0))
    for turn in range(ROUNDS):
        before, noise, spread = moved.copy(), belief.noise.copy(), belief.spread.copy()
        set_state(state, band.rows, moved, belief.nuisance, band.scene)
        if noise[1] == 0.0:
            belief.noise[:] = 1.0
        accumulate(band.pixels, band.starts, state, belief.noise, band.settings[3], sums)
        if noise[1] == 0.0:
            weigh_noise(sums, verdict, belief.noise)
        else:
            add_plateaus(band.plateaus, state, belief.noise, sums)
        contrast = belief.nuisance[LEVEL_OUT] - belief.nuisance[LEVEL_IN]
        level_spread(sums, belief.spread, (LEVEL_RANGE * contrast) ** 2, band.fewest)
        hear_sectors(sums, belief.spread, verdict, band.fewest)
        if turn > 0:
            loose = outline_variance(factor, band.rows, free)
        weigh_sectors(verdict, band.scene[2], band.settings[4] > 0.0, turn < patience, loose)
        step, factor = step_from(verdict, band.rows, free, band.scene, moved, belief)
        if factor.size == 0:
            break
        blur = take(step, free, moved, belief.nuisance)
        noise_levels(sums, verdict, belief.noise)
        far = farthest(band.rows, moved - before)
        if far > 2.0:
            break
        # weights that a wrong blur or level has spoilt are found again
        if turn < patience or not (is_steady(noise, belief.noise) and is_steady(spread, belief.spread)):
            continue
        if turn > 0 and max(far, 0.1 * abs(blur)) < SETTLED_PX:
            break
        plain = turn > 0 or arc_shares(band.rows, verdict)[1] <= HIDDEN_SHARE
        if plain and is_negligible(remains(band.rows, moved - before, blur), verdict):
            break
    if factor.size > 0:
        advance(verdict, band.rows, free, band.scene, step)
    return moved, factor, verdict


@compiled
def copied(belief: Belief) -> Belief:
    """A belief to try something with."""
    nuisance, noise, spread = belief.nuisance.copy(), belief.noise.copy(), belief.spread.copy()
    return Belief(nuisance, belief.prior, noise, spread, belief.precision.copy())


@compiled
def regain(
    values: NDArray[np.float32],
    shape: Floats,
    reach: float,
    band: Band,
    moved: Floats,
    belief: Belief,
    solved: tuple[Floats, Floats, Ints],
) -> tuple[Band, Floats, Floats, Floats]:
    """Solve again with the sectors that are only hidden in part, without the pixels that are.

    That is done again while it moves the outline: the better it is known, the better is seen what hides it. ``moved``
    is the step that led from ``band`` to ``shape``, ``solved`` as in `cleaned_of`. ``shape`` and ``belief`` are changed
    in place. Returns the last band and, of it, step, factor and verdict; the factor is empty where the first time leads
    astray.
    """
    known, said, free = solved
    nothing = np.zeros((0, 0))
    last, to_shape, factor, verdict = band, moved, nothing, nothing
    for _ in range(REGAINS):
        cleaned = cleaned_of(values, band, moved, belief, (known, said, free))
        other, trial = gather_band(cleaned, shape, band.settings, reach, math.nan, LEAST_LEFT), copied(belief)
        step, better, judged = solve_band(other, trial, free, 0)
        far = farthest(other.rows, step)
        if better.size == 0 or far > RECOLLECT_PX:
            break
        last, to_shape, factor, verdict = other, step, better, judged
        known, said = better, judged
        shape[:5] += step
        belief.nuisance[:], belief.noise[:], belief.spread[:] = trial.nuisance, trial.noise, trial.spread
        if far < SETTLED_PX:
            break
        band, moved = gather_band(values, shape, band.settings, reach, math.nan, LEAST_PIXELS), np.zeros(5)
    return last, to_shape, factor, verdict


@compiled
def refine_shape(
    values: NDArray[np.float32], shape: Floats, free: Ints, settings: Floats, ln_blur: float, scanned: bool
) -> Refined:
    """Maximise the likelihood from a start that is right to a fraction of a pixel; ``shape`` is moved in place.

    ``settings`` as in `Band`; ``ln_blur`` is what the blur is at first. A start that was not ``scanned`` for is lost
    unless it is right to ``RECOLLECT_PX`` and nearly all of the outline agrees.
    """
    report = np.zeros(REPORT)
    report[STATUS] = LOST
    nothing = np.zeros((free.size, free.size))
    masked, reach = math.nan, reach_of(ln_blur)
    band = gather_band(values, shape, settings, reach, masked, LEAST_PIXELS)
    belief = first_belief(band, ln_blur, math.nan)
    if math.isnan(belief.nuisance[LEVEL_OUT]) and scanned:
        # no light was left outside of the edge: it was clipped and masked, so it is at least the ground's 1
        masked = 1.0
        band = gather_band(values, shape, settings, reach, masked, LEAST_PIXELS)
        belief = first_belief(band, ln_blur, masked)
    lost = Refined(report, nothing, no_turn(), band, belief, nothing)
    height = belief.nuisance[LEVEL_OUT] - belief.nuisance[LEVEL_IN]
    if math.isnan(height) or (not scanned and height < LEAST_HEIGHT):
        return lost
    moved, factor, verdict = solve_band(band, belief, free, 0)
    for _ in range(COLLECTIONS):
        report[ARC], report[GATED] = arc_shares(band.rows, verdict)
        if factor.size == 0:
            report[STATUS] = SINGULAR
            return lost
        far = farthest(band.rows, moved)
        if not scanned and (far > RECOLLECT_PX or report[GATED] > MOST_UNSCANNED):
            return lost
        shape[:5] += moved
        if far > 4.0 or not (0.3 < shape[3] < 4.0 and shape[2] > 2.0):
            return lost
        wanted = reach_of(belief.nuisance[LN_S])
        if far < RECOLLECT_PX and wanted < WIDER * reach:
            break
        reach = wanted
        band = gather_band(values, shape, settings, reach, masked, LEAST_PIXELS)
        moved, factor, verdict = solve_band(band, belief, free, 0)
    report[PLAIN] = 1.0 if math.isnan(masked) else 0.0
    if report[GATED] > HIDDEN_SHARE and math.isnan(masked) and settings[4] == 0.0:
        other, step, better, judged = regain(values, shape, reach, band, moved, belief, (factor, verdict, free))
        if better.size > 0:
            band, moved, factor, verdict = other, step, better, judged
            report[PLAIN] = 0.0
    covariance, report[RESIDUAL] = concluded(verdict, factor, band.rows, free, band.scene)
    if math.isnan(report[RESIDUAL]):
        return lost
    report[STATUS], report[BLUR] = 0.0, math.exp(belief.nuisance[LN_S])
    turn = pixel_turn(verdict, band.rows, band.scene, free, moved, belief) if wants_tilt(free) else no_turn()
    return Refined(report, covariance, turn, band, belief, verdict)
