"""From a patch and a guess to an ellipse in one compiled call: the scan and, from what it found, the likelihood."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.bottom_cap import ELSEWHERE, bottom_within, not_found
from wentry_cli.contours.refine import BLUR, PLAIN, RESIDUAL, STATUS, refine_shape
from wentry_cli.contours.scan import LEFT_OUT, OCCLUDED_SHARE, scan_shape
from wentry_cli.contours.turning import ANSWER, STEP, UNC

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEARCH_PX = 12.0
RAYS = 96
# Blur along the edge that the scan assumes, px^2: an optical sigma of 1, the pixel (1/12), bilinear sampling (1/6).
SCAN_VARIANCE = 1.25
# Where `fit_outline` puts its verdict, blur, arc, gated share and residual, the turn and the `spreads`.
VERDICT, QUALITY, KNOWN, FOUND = 0, 1, 5, 13
VERDICTS, POOR = ("", "short_arc", "out_of_frame", "no_edge", "occluded", "poor_fit"), 5.0


class OutlineRequest(NamedTuple):
    """How an outline is to be fitted: one that compiled code can read.

    ``settings`` are those of `refine.Band` but the last, which the scan tells; ``refines`` is False for the scan alone;
    ``noise`` is the least one of the patch, ``least_arc`` the share of the perimeter that must be seen, ``tilt_unc``
    (rad) how well a tilt that is held is known; ``bottom`` asks for the lowest point from the cap alone, too, and
    ``followed`` says that the guess comes from frames just before, of which a scan makes use.
    """

    settings: Floats
    refines: bool
    noise: float
    least_arc: float
    tilt_unc: float
    bottom: bool
    followed: bool


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
def fit_outline(
    values: NDArray[np.float32], vector: Floats, free: Ints, request: OutlineRequest
) -> tuple[Floats, Floats, Floats]:
    """Scan and, at the level "accurate", refine a shape, which is moved in place (patch pixels, tilt in radians).

    Returns the numbers of the fit (``VERDICT`` and on), the covariance of all parameters, and the entries of
    `bottom_cap` for the lowest point, where it was asked for and the same pixels tell it.
    """
    bottom = not_found(ELSEWHERE)
    found = np.full(FOUND, math.nan)
    top_y, across, down, _, one_sided = request.settings
    scans = 2.0 if request.refines else 3.0
    search = np.array([SEARCH_PX, one_sided, RAYS, SCAN_VARIANCE, scans, across, down, request.noise])
    covariance, scan, turn = scan_shape(values, vector, free, top_y, search, request.followed)
    found[QUALITY + 1 : KNOWN] = scan[1:4]
    found[VERDICT] = scan_verdict(scan, request.least_arc)
    if found[VERDICT] == 0.0 and request.refines:
        settings = np.append(request.settings, 1.0 if scan[LEFT_OUT] > OCCLUDED_SHARE else 0.0)
        covariance, fine, turn, band, belief = refine_shape(values, vector, free, settings)
        if fine[STATUS] == 0.0:
            found[QUALITY:KNOWN] = fine[BLUR : RESIDUAL + 1]
            if request.bottom and fine[PLAIN] > 0.0:
                bottom = bottom_within(band, belief)
        else:
            found[VERDICT] = POOR
    if found[VERDICT] > 0.0:
        return found, np.full((5, 5), math.nan), bottom
    whole = whole_covariance(covariance, free, turn, request.tilt_unc)
    if not math.isfinite(whole.sum()):
        found[VERDICT] = POOR
    found[KNOWN], found[KNOWN + 1] = turn[STEP], turn[UNC]
    found[KNOWN + 2 :] = spreads(vector[2], vector[3], vector[4], whole)
    return found, whole, bottom
