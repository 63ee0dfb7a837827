"""From a patch and a guess to an ellipse in one compiled call: the scan and, from what it found, the likelihood."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.bottom_cap import ELSEWHERE, bottom_within, not_found
from wentry_cli.contours.discrepancy import concluded
from wentry_cli.contours.global_step import advance, is_negligible, remains, step_from
from wentry_cli.contours.nuisances import PRIOR_LN_S
from wentry_cli.contours.refine import ARC, BLUR, GATED, PLAIN, RESIDUAL, STATUS, Refined, copied, refine_shape, take
from wentry_cli.contours.scan import LEFT_OUT, OCCLUDED_SHARE, scan_shape
from wentry_cli.contours.sectors import LN_S
from wentry_cli.contours.turning import ANSWER, STEP, UNC, no_turn, pixel_turn, wants_tilt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEARCH_PX = 12.0
RAYS = 96
# Blur along the edge that the scan assumes, px^2: an optical sigma of 1, the pixel (1/12), bilinear sampling (1/6).
SCAN_VARIANCE = 1.25
# Beside the least arc, which outlines that are not scanned must reach.
CLEARLY = 0.02
# Where `fit_outline` puts its verdict, blur, arc, gated share and residual, the turn and the `spreads`.
VERDICT, QUALITY, KNOWN, FOUND = 0, 1, 5, 13
VERDICTS, POOR = ("", "short_arc", "out_of_frame", "no_edge", "occluded", "poor_fit"), 5.0


class OutlineRequest(NamedTuple):
    """How an outline is to be fitted: one that compiled code can read.

    ``settings`` are those of `refine.Band` but the last, which the scan tells; ``refines`` is False for the scan alone;
    ``noise`` is the least one of the patch, ``least_arc`` the share of the perimeter that must be seen, ``tilt_unc``
    (rad) how well a tilt that is held is known; ``bottom`` asks for the lowest point from the cap alone, too, and
    ``followed`` says that the guess comes from frames just before, of which a scan makes use. ``blur`` is theirs, px,
    where the guess is as good as a scan, otherwise NaN. ``also`` are the parameters of a second fit, none where there
    is none, and ``least_arc_also`` what that must see.
    """

    settings: Floats
    refines: bool
    noise: float
    least_arc: float
    tilt_unc: float
    bottom: bool
    followed: bool
    blur: float
    also: Ints
    least_arc_also: float


class Told(NamedTuple):
    """A fit: the ``vector`` of its shape (patch pixels, tilt in radians), its ``numbers`` from ``VERDICT`` on, and the
    ``covariance`` of all five parameters. Where there is none, all are empty.
    """

    vector: Floats
    numbers: Floats
    covariance: Floats


class Outline(NamedTuple):
    """What the pixels about an outline tell.

    ``cap`` are the entries of `bottom_cap` for its lowest point, where that was asked for and the same pixels tell it,
    ``second`` is the fit of other parameters, where that was asked for and one linear step leads there.
    """

    fit: Told
    cap: Floats
    second: Told


@compiled
def bottom_gradient(radius: float, stretch: float, tilt: float) -> Floats:
    """Derivative of the lowest row with respect to ``PARAMETERS`` (tilt in radians), (5,)."""
    across, along = (radius * stretch) ** 2, (radius / stretch**2) ** 2
    sine, cosine = math.sin(tilt), math.cos(tilt)
    depth = math.sqrt(across * sine**2 + along * cosine**2)
    return np.array([
        0.0,
        1.0,
        depth / radius,
        (across * sine**2 - 2.0 * along * cosine**2) / (stretch * depth),
        (across - along) * sine * cosine / depth,
    ])  # fmt: skip


@compiled
def bottom_spread(radius: float, stretch: float, tilt: float, covariance: Floats) -> float:
    """``bottom_unc`` of a tilt in radians."""
    gradient = bottom_gradient(radius, stretch, tilt)
    variance = 0.0
    for i in range(1, 5):
        for j in range(1, 5):
            variance += gradient[i] * covariance[i, j] * gradient[j]
    return math.sqrt(variance) if variance > 0.0 else variance * 0.0


@compiled
def spreads(radius: float, stretch: float, tilt: float, covariance: Floats) -> Floats:
    """Standard uncertainties of the five parameters, NaN of those that were held, and that of the lowest row (6,)."""
    found = np.empty(6)
    for i in range(5):
        found[i] = math.sqrt(covariance[i, i]) if covariance[i, i] > 0.0 else math.nan
    found[5] = bottom_spread(radius, stretch, tilt, covariance)
    return found


@compiled
def whole_covariance(found: Floats, free: Ints, turn: Floats, tilt_unc: float) -> Floats:
    """Covariance of all five parameters, from that of the free ones and what a tilt known to ``tilt_unc`` (rad) does.

    ``turn`` as in `turning`.
    """
    covariance = np.zeros((5, 5))
    for i in range(free.size):
        for j in range(free.size):
            covariance[free[i], free[j]] = found[i, j]
    for i in range(5):
        for j in range(5):
            covariance[i, j] += turn[ANSWER + i] * turn[ANSWER + j] * tilt_unc**2
    return covariance


@compiled
def scan_verdict(report: Floats, least: float) -> float:
    """Which of ``VERDICTS`` a scan deserves; ``least`` is the share of the perimeter that it must see."""
    if report[1] < least:
        return 1.0 if report[5] < least else 2.0
    return 2.0 + report[0] if report[0] > 0.0 else 0.0


@compiled
def fit_outline(values: NDArray[np.float32], vector: Floats, free: Ints, request: OutlineRequest) -> Outline:
    """Scan and, at the level "accurate", refine a shape, which is moved in place (patch pixels, tilt in radians).

    Where the guess is as good as a scan, there is none.
    """
    found = np.full(FOUND, math.nan)
    if request.refines and request.blur > 0.0:
        near, settings = vector.copy(), np.append(request.settings, 0.0)
        refined = refine_shape(values, near, free, settings, math.log(request.blur), False)
        if refined.report[STATUS] == 0.0 and refined.report[ARC] >= request.least_arc + CLEARLY:
            vector[:] = near
            return fitted(found, refined, vector, free, request)
    top_y, across, down, _, one_sided = request.settings
    scans = 2.0 if request.refines else 3.0
    search = np.array([SEARCH_PX, one_sided, RAYS, SCAN_VARIANCE, scans, across, down, request.noise])
    covariance, scan, turn = scan_shape(values, vector, free, top_y, search, request.followed and not request.refines)
    found[QUALITY + 1 : KNOWN] = scan[1:4]
    found[VERDICT] = scan_verdict(scan, request.least_arc)
    if found[VERDICT] == 0.0 and request.refines:
        settings = np.append(request.settings, 1.0 if scan[LEFT_OUT] > OCCLUDED_SHARE else 0.0)
        refined = refine_shape(values, vector, free, settings, PRIOR_LN_S, True)
        if refined.report[STATUS] == 0.0:
            return fitted(found, refined, vector, free, request)
        found[VERDICT] = POOR
    if found[VERDICT] > 0.0:
        return Outline(Told(vector, found, np.full((5, 5), math.nan)), not_found(ELSEWHERE), nothing_told())
    whole = whole_covariance(covariance, free, turn, request.tilt_unc)
    tell(found, vector, whole, turn)
    return Outline(Told(vector, found, whole), not_found(ELSEWHERE), nothing_told())


@compiled
def nothing_told() -> Told:
    """No fit."""
    return Told(np.zeros(0), np.zeros(0), np.zeros((0, 0)))


@compiled
def tell(found: Floats, vector: Floats, whole: Floats, turn: Floats) -> None:
    """Fill in verdict, turn and ``spreads`` of a fit with this covariance of all parameters."""
    found[VERDICT] = 0.0 if math.isfinite(whole.sum()) else POOR
    found[KNOWN], found[KNOWN + 1] = turn[STEP], turn[UNC]
    found[KNOWN + 2 :] = spreads(vector[2], vector[3], vector[4], whole)


@compiled
def fitted(found: Floats, refined: Refined, vector: Floats, free: Ints, request: OutlineRequest) -> Outline:
    """What `fit_outline` returns of an outline that was refined, at ``vector``."""
    report = refined.report
    found[QUALITY:KNOWN] = report[BLUR : RESIDUAL + 1]
    bottom, other = not_found(ELSEWHERE), nothing_told()
    if request.bottom and report[PLAIN] > 0.0:
        bottom = bottom_within(refined, vector)
    if request.also.size > 0 and report[ARC] >= request.least_arc_also:
        other = second_fit(refined, vector, request.also, request.tilt_unc)
    whole = whole_covariance(refined.covariance, free, refined.turn, request.tilt_unc)
    tell(found, vector, whole, refined.turn)
    return Outline(Told(vector, found, whole), bottom, other)


@compiled
def second_fit(refined: Refined, vector: Floats, free: Ints, tilt_unc: float) -> Told:
    """The fit of another set of parameters to the pixels of one; empty where one linear step does not lead there."""
    rows, scene, own = refined.band.rows, refined.band.scene, copied(refined.belief)
    moved = np.zeros(5)
    step, factor = step_from(refined.verdict, rows, free, scene, moved, own)
    if factor.size == 0:
        return nothing_told()
    after = refined.verdict.copy()
    blur = take(step, free, moved, own.nuisance)
    advance(after, rows, free, scene, step)
    covariance, residual = concluded(after, factor, rows, free, scene)
    if math.isnan(residual) or not is_negligible(remains(rows, moved, blur), after):
        return nothing_told()
    shape, found = vector[:5] + moved, np.full(FOUND, math.nan)
    found[QUALITY], found[QUALITY + 1] = math.exp(own.nuisance[LN_S]), refined.report[ARC]
    found[QUALITY + 2], found[QUALITY + 3] = refined.report[GATED], residual
    turn = pixel_turn(after, rows, scene, free, moved, own) if wants_tilt(free) else no_turn()
    whole = whole_covariance(covariance, free, turn, tilt_unc)
    tell(found, shape, whole, turn)
    return Told(shape, found, whole)
