"""Level "accurate": Gauss-Newton on the pixels of a narrow band, with gated sectors and free nuisances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, arc_geometry, farthest, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.band import collect_band
from wentry_cli.contours.discrepancy import add_discrepancy, excess_variance, pull_of_sectors, residual_statistics
from wentry_cli.contours.likelihood import (
    COUNT,
    STATE,
    SUMS,
    accumulate,
    expect,
    first_levels,
)
from wentry_cli.contours.normal_equations import factorise, invert_block, substitute
from wentry_cli.contours.nuisances import PRIOR_LN_S, Belief, add_priors, first_noise, noise_levels, priors, weigh_noise
from wentry_cli.contours.plateau import PLATEAU_PX, add_plateaus, sum_plateaus
from wentry_cli.contours.sectors import (
    LEAST_PIXELS,
    LEVEL_IN,
    LEVEL_OUT,
    LN_S,
    NUISANCES,
    TOLERANCE_OF_R,
    TOLERANCE_PX,
    VERDICT,
    WEIGHT,
    assemble,
    judge,
    level_spread,
    set_state,
)
from wentry_cli.contours.spoilt import without_spoilt
from wentry_cli.contours.turning import no_turn, pixel_turn, wants_tilt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Sectors of an outline that is hidden in part are smaller: what hides them costs less.
SECTOR_PX, SMALL_SECTOR_PX = 4.0, 3.0
SECTOR_ANGLE = math.radians(40.0)
# The band of the edge ends where its blur does, so many standard deviations away.
REACH_SIGMA, LEAST_BLUR, WIDER = 4.2, 1.0, 1.25
SETTLED_PX = 0.004
RECOLLECT_PX = 0.25
ROUNDS = 6
# Share of the outline left out from which it is worth looking at single pixels.
HIDDEN_SHARE = 0.02
COLLECTIONS = 4
# How often single pixels are looked at, as long as that moves the outline.
REGAINS = 4
# Entries of the report of `refine_shape`.
STATUS, BLUR, ARC, GATED, RESIDUAL, PLAIN, REPORT = 0, 1, 2, 3, 4, 5, 6
SINGULAR, LOST = 1.0, 2.0


class Band(NamedTuple):
    """Pixels about the outline ``shape``, sector by sector, where each sector starts, and what the scene is like.

    ``places`` says where in the patch, read line by line, a pixel is. ``plateaus`` are the moments of what lies beyond
    them (see `plateau`), ``width`` is that of the band, px. ``scene`` holds centre (x, y), radius and motion (x, y);
    ``settings`` the top row, the motion (x, y), the ceiling, 1 where outliers lie outside only, and 1 where much of the
    outline is hidden.
    """

    shape: Floats
    pixels: Floats
    starts: Ints
    places: Ints
    plateaus: Floats
    rows: Floats
    scene: Floats
    settings: Floats
    width: float


@compiled
def update(
    normal: Floats, right: Floats, free: Ints, rows: Floats, moved: Floats, nuisance: Floats
) -> tuple[bool, float]:
    """Solve for one step in place; False where singular, and the greatest change of an edge (px) or of ln s / 10."""
    if not factorise(normal):
        return False, math.nan
    substitute(normal, right)
    size, step = free.size, np.zeros(5)
    for i in range(size):
        step[free[i]] = right[i]
    moved += step
    for i in range(NUISANCES - 1):
        nuisance[i] += right[size + i]
    blur_step = min(0.35, max(-0.35, right[size + LN_S]))
    nuisance[LN_S] = min(1.8, max(-1.2, nuisance[LN_S] + blur_step))
    return True, max(0.1 * abs(blur_step), farthest(rows, step))


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


@compiled
def reach_of(ln_blur: float) -> float:
    """Half-width of the band that an edge of this blur fills, px."""
    return REACH_SIGMA * max(LEAST_BLUR, math.exp(ln_blur))


@compiled
def gather_band(values: NDArray[np.float32], shape: Floats, settings: Floats, reach: float, masked: float) -> Band:
    """Cut the outline of ``shape`` into sectors and collect the pixels within ``reach`` (px) of it.

    ``masked`` is the level that masked pixels outside of the edge are taken to have; NaN leaves them out.
    """
    a, b = semi_axes(shape)
    count, table = quadrant_table(a, b, SMALL_SECTOR_PX if settings[5] > 0.0 else SECTOR_PX, SECTOR_ANGLE)
    rows = arc_geometry(shape, sector_angles(count, table))
    motion = 0.5 * math.hypot(settings[1], settings[2])
    limits = np.array([min(reach + motion, 0.5 * min(a, b)), reach + motion, settings[0], masked])
    pixels, starts, places = collect_band(values, shape, count, table, limits)
    # outside of a sphere seen from above stands the splash ring; levels do not tell where the edge of clipped light is
    clipped = settings[3] < math.inf
    far = 0.0 if settings[4] > 0.0 or clipped else limits[1] + PLATEAU_PX
    deep = 0.0 if clipped else min(limits[0] + PLATEAU_PX, 0.5 * min(a, b))
    plateaus = sum_plateaus(values, rows, starts, (limits[0], deep), (limits[1], far), settings[0])
    scene = np.array([shape[0], shape[1], shape[2], settings[1], settings[2]])
    return Band(shape.copy(), pixels, starts, places, plateaus, rows, scene, settings, limits[0] + limits[1])


@compiled
def first_belief(band: Band, low: float, high: float) -> Belief:
    """What is believed at first, with the levels ``low`` inside and ``high`` outside (NaN: that of the ground)."""
    nuisance = np.zeros(NUISANCES)
    nuisance[LEVEL_IN], nuisance[LEVEL_OUT] = low, 1.0 if math.isnan(high) else high
    nuisance[LN_S] = PRIOR_LN_S
    prior = priors(nuisance, band.scene[2], band.settings[3])
    return Belief(nuisance, prior, first_noise(band.plateaus), np.full(2, 1e-6), np.zeros(5))


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
        accumulate(band.pixels, band.starts, state, belief.noise, band.settings[3], sums)
        if fresh:
            weigh_noise(sums, verdict, belief.noise)
        else:
            add_plateaus(band.plateaus, state, belief.noise, sums)
        level_spread(sums, belief.spread)
        judge(sums, belief.spread, band.scene[2], band.settings[4] > 0.0, turn < patience, verdict)
        normal, right = assemble(verdict, band.rows, free, band.scene)
        add_priors(normal, right, free, moved, belief)
        good, change = update(normal, right, free, band.rows, moved, belief.nuisance)
        if not good:
            return moved, np.zeros((0, 0)), sums, verdict
        noise_levels(sums, verdict, belief.noise)
        if (turn > 0 and turn >= patience and change < SETTLED_PX) or change > 2.0:
            break
    return moved, normal, sums, verdict


@compiled
def cleaned_of(values: NDArray[np.float32], band: Band, moved: Floats, belief: Belief) -> NDArray[np.float32]:
    """The patch without the pixels of the band that do not fit what is believed (see `spoilt`)."""
    state = np.zeros((band.rows.shape[0], STATE))
    set_state(state, band.rows, moved, belief.nuisance, band.scene)
    tolerance = max(TOLERANCE_PX, TOLERANCE_OF_R * band.scene[2])
    room = expect(band.pixels, band.starts, state, belief.noise, band.settings[3])
    return without_spoilt(values, room, band.starts, band.places, state, (belief.spread, tolerance**2))


@compiled
def copied(belief: Belief) -> Belief:
    """A belief to try something with."""
    nuisance, noise, spread = belief.nuisance.copy(), belief.noise.copy(), belief.spread.copy()
    return Belief(nuisance, belief.prior, noise, spread, belief.precision)


@compiled
def regain(
    values: NDArray[np.float32], shape: Floats, reach: float, band: Band, moved: Floats, belief: Belief, free: Ints
) -> tuple[Band, Floats, Floats, Floats]:
    """Solve again with the sectors that are only hidden in part, without the pixels that are.

    That is done again while it moves the outline: the better it is known, the better is seen what hides it. ``moved``
    is the step that led from ``band`` to ``shape``. ``shape`` and ``belief`` are changed in place. Returns the last
    band and, of it, step, factor and verdict; the factor is empty where the first time leads astray.
    """
    nothing = np.zeros((0, 0))
    last, to_shape, factor, verdict = band, moved, nothing, nothing
    for _ in range(REGAINS):
        cleaned = cleaned_of(values, band, moved, belief)
        other, trial = gather_band(cleaned, shape, band.settings, reach, math.nan), copied(belief)
        step, better, _, judged = solve_band(other, trial, free, 0)
        far = farthest(other.rows, step)
        if better.size == 0 or far > RECOLLECT_PX:
            break
        last, to_shape, factor, verdict = other, step, better, judged
        shape[:5] += step
        belief.nuisance[:], belief.noise[:], belief.spread[:] = trial.nuisance, trial.noise, trial.spread
        if far < SETTLED_PX:
            break
        band, moved = gather_band(values, shape, band.settings, reach, math.nan), np.zeros(5)
    return last, to_shape, factor, verdict


@compiled
def refine_shape(
    values: NDArray[np.float32], shape: Floats, free: Ints, settings: Floats
) -> tuple[Floats, Floats, Floats, Band, Belief]:
    """Maximise the likelihood from a start that is right to a fraction of a pixel; ``shape`` is moved in place.

    ``settings`` as in `Band`. Returns the covariance of the free parameters, the report (status, blur, arc, gated,
    residual, and 1 where the band holds all pixels and no masked ones), the turn (see `turning`), and the last band
    with what is believed of it.
    """
    report = np.zeros(REPORT)
    report[STATUS] = LOST
    nothing = np.zeros((free.size, free.size))
    masked, reach = math.nan, reach_of(PRIOR_LN_S)
    band = gather_band(values, shape, settings, reach, masked)
    low, high = first_levels(band.pixels, band.starts)
    if math.isnan(high):
        # no light was left outside of the edge: it was clipped and masked, so it is at least the ground's 1
        masked = 1.0
        band = gather_band(values, shape, settings, reach, masked)
        low, high = first_levels(band.pixels, band.starts)
    belief = first_belief(band, low, high)
    if math.isnan(low):
        return nothing, report, no_turn(), band, belief
    moved, factor, sums, verdict = solve_band(band, belief, free, 0)
    for _ in range(COLLECTIONS):
        report[ARC], report[GATED] = arc_shares(band.rows, sums, verdict)
        if factor.size == 0:
            report[STATUS] = SINGULAR
            return nothing, report, no_turn(), band, belief
        far = farthest(band.rows, moved)
        shape[:5] += moved
        if far > 4.0 or not (0.3 < shape[3] < 4.0 and shape[2] > 2.0):
            return nothing, report, no_turn(), band, belief
        wanted = reach_of(belief.nuisance[LN_S])
        if far < RECOLLECT_PX and wanted < WIDER * reach:
            break
        reach = wanted
        band = gather_band(values, shape, settings, reach, masked)
        moved, factor, sums, verdict = solve_band(band, belief, free, 0)
    report[PLAIN] = 1.0 if math.isnan(masked) else 0.0
    if report[GATED] > HIDDEN_SHARE and math.isnan(masked) and settings[4] == 0.0:
        other, step, better, judged = regain(values, shape, reach, band, moved, belief, free)
        if better.size > 0:
            band, moved, factor, verdict = other, step, better, judged
            report[PLAIN] = 0.0
    report[RESIDUAL], chi2 = residual_statistics(verdict, free.size)
    if math.isnan(chi2):
        return nothing, report, no_turn(), band, belief
    report[STATUS], report[BLUR] = 0.0, math.exp(belief.nuisance[LN_S])
    covariance = invert_block(factor, free.size, max(1.0, chi2))
    excess = excess_variance(verdict, free.size)
    if excess > 0.0:
        pull = pull_of_sectors(verdict, band.rows, free, band.scene, factor.shape[0])
        weight = verdict[:, WEIGHT].copy()
        add_discrepancy(covariance, factor, pull, band.rows, weight, free, excess)
    turn = no_turn()
    if wants_tilt(free):
        turn = pixel_turn(verdict, band.rows, band.scene, free, moved, belief)
    return covariance, report, turn, band, belief
