"""The lowest point of the silhouette from its bottom cap alone, free of the ellipse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import farthest, lowest_angle, semi_axes
from wentry_cli.contours.band import SECTOR_PX, gather_band, reach_of
from wentry_cli.contours.bottom_cap import (
    COLUMN,
    FOUND,
    HALF_ANGLE,
    HOW,
    LEAST_SEEN,
    OUT_OF_FRAME,
    REST,
    ROW,
    UNC,
    cap_of,
    constrain,
    cut_out,
    lowest_point,
    not_found,
    share_seen,
)
from wentry_cli.contours.clipped import CLIPPED_PX, is_clipped
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.nuisances import PRIOR_LN_S
from wentry_cli.contours.plateau import PLATEAU_PX
from wentry_cli.contours.refine import (
    HIDDEN_SHARE,
    RECOLLECT_PX,
    arc_shares,
    copied,
    first_belief,
    solve_band,
)
from wentry_cli.contours.scan import OCCLUDED_SHARE
from wentry_cli.contours.sectors import LEAST_LEFT, LEAST_PIXELS, LEVEL_IN
from wentry_cli.contours.spoilt import cleaned_of
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

STATUS_WORDS = ("ok", "occluded", "poor_fit", "out_of_frame")


@dataclass(frozen=True)
class BottomFit:
    """The lowest point of the outline, full-frame px, NaN where it could not be measured."""

    x_px: float
    y_px: float
    y_unc_px: float
    residual_rms_px: float
    status: str


def fit_local_bottom(patch: Patch, fit: SilhouetteFit, *, motion_px: tuple[float, float] = (0.0, 0.0)) -> BottomFit:
    """Locate the lowest point from the edge within 30 degrees of the bottom.

    The angle is the eccentric one of the fitted ellipse, that is the cap of the undeformed sphere. The ellipse only
    says where to look (see `bottom_cap`).
    """
    if fit.status != "ok":
        return no_bottom(fit.status)
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    shape = fit.shape.vector(patch.x0, patch.y0)
    settings = np.array([-math.inf, *motion_px, patch.ceiling, 0.0, fit.gated_fraction > OCCLUDED_SHARE], np.float64)
    reach = reach_of(PRIOR_LN_S if math.isnan(fit.blur_px) else math.log(fit.blur_px))
    found = refine_bottom(values, shape, settings, reach, False)
    if found[HOW] != FOUND and np.isnan(values).any():
        again = refine_bottom(values, shape, settings, reach, True)
        found = again if again[HOW] == FOUND else found
    return bottom_found(patch, found)


def bottom_found(patch: Patch, found: NDArray[np.float64]) -> BottomFit:
    """Turn what `bottom_cap` found in a patch into full-frame pixels and a status."""
    if found[HOW] != FOUND:
        return no_bottom(STATUS_WORDS[int(found[HOW])])
    unc = math.hypot(float(found[UNC]), CLIPPED_PX if is_clipped(patch) else 0.0)
    return BottomFit(float(found[COLUMN]) + patch.x0, float(found[ROW]) + patch.y0, unc, float(found[REST]), "ok")


def no_bottom(status: str) -> BottomFit:
    """No lowest point, and the word that says why."""
    return BottomFit(math.nan, math.nan, math.nan, math.nan, status)


@compiled
def cut_cap(values: NDArray[np.float32], shape: Floats, margin: float) -> tuple[NDArray[np.float32], Floats]:
    """The part of the patch that lies about the cap, and the shape in its pixels.

    ``margin`` is how far beyond the ends of the cap pixels count (px).
    """
    a, b = semi_axes(shape)
    lowest, depth = lowest_angle(shape)
    top = shape[1] + depth * math.cos(HALF_ANGLE) - 1.5 * margin
    places = np.empty(2)
    for n in range(2):
        end = lowest + (HALF_ANGLE if n == 1 else -HALF_ANGLE)
        places[n] = a * math.cos(end) * math.cos(shape[4]) + b * math.sin(end) * math.sin(shape[4])
    left = min(values.shape[1], max(0, math.floor(shape[0] + places.min() - margin)))
    right = max(left, min(values.shape[1], math.ceil(shape[0] + places.max() + margin) + 1))
    first = min(values.shape[0], max(0, math.floor(top)))
    moved = shape.copy()
    moved[0] -= left
    moved[1] -= first
    return values[first:, left:right].copy(), moved


@compiled
def refine_bottom(values: NDArray[np.float32], shape: Floats, settings: Floats, reach: float, masked: bool) -> Floats:
    """The lowest point of an outline about ``shape``, the entries of ``FOUND_ENTRIES``; ``settings`` as in `Band`."""
    margin = reach + PLATEAU_PX + math.hypot(settings[1], settings[2]) + SECTOR_PX
    settings[0] = -math.inf
    part, there = cut_cap(values, shape, margin)
    light = 1.0 if masked else math.nan
    around = gather_band(part, there, settings, reach, light, LEAST_PIXELS)
    cap = cap_of(around)
    band = cut_out(around, cap)
    belief = first_belief(band, PRIOR_LN_S, 1.0)
    if share_seen(cap, around) < LEAST_SEEN or math.isnan(belief.nuisance[LEVEL_IN]):
        return not_found(OUT_OF_FRAME)
    constrain(belief, shape[2])
    moved, factor, verdict = solve_band(band, belief, np.arange(5), 1)
    if factor.size > 0 and not masked and arc_shares(band.rows, verdict)[1] > HIDDEN_SHARE:
        cleaned = cleaned_of(part, band, moved, belief, (factor, verdict, np.arange(5)))
        again = gather_band(cleaned, there, settings, reach, light, LEAST_LEFT)
        other = cut_out(again, cap_of(again))
        step, better, judged = solve_band(other, copied(belief), np.arange(5), 0)
        if better.size > 0 and farthest(other.rows, step - moved) < RECOLLECT_PX:
            band, moved, factor, verdict = other, step, better, judged
    found = lowest_point(there, band.rows, moved, factor, verdict)
    found[COLUMN] += shape[0] - there[0]
    found[ROW] += shape[1] - there[1]
    return found
