"""The lowest point of the silhouette from its bottom cap alone, free of the ellipse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J, farthest, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.clipped import CLIPPED_PX, is_clipped
from wentry_cli.contours.discrepancy import residual_statistics
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.likelihood import COUNT, first_levels
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.contours.nuisances import PRIOR_LN_S
from wentry_cli.contours.plateau import PLATEAU_PX
from wentry_cli.contours.refine import (
    HIDDEN_SHARE,
    RECOLLECT_PX,
    SECTOR_ANGLE,
    SECTOR_PX,
    Band,
    arc_shares,
    cleaned_of,
    copied,
    first_belief,
    gather_band,
    reach_of,
    solve_band,
)
from wentry_cli.contours.sectors import LEAST_PIXELS, WEIGHT
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

# How much a real bottom may depart from the ellipse in third and fourth order at the ends of the cap, share of R.
PRIOR_SHAPE = 0.004
# Share of the cap that must lie in the picture; of what lies there, share and number of sectors that drops leave free.
LEAST_SEEN, LEAST_KEPT, FEWEST_KEPT = 0.6, 0.2, 3.0
MOST_SHIFT_PX = 3.0
FOUND, OCCLUDED, POOR, OUT_OF_FRAME = 0.0, 1.0, 2.0, 3.0
STATUS_WORDS = ("ok", "occluded", "poor_fit", "out_of_frame")


@dataclass(frozen=True)
class BottomFit:
    """The lowest point of the outline, full-frame px, NaN where it could not be measured."""

    x_px: float
    y_px: float
    y_unc_px: float
    residual_rms_px: float
    status: str


def fit_local_bottom(
    patch: Patch,
    fit: SilhouetteFit,
    *,
    half_angle_deg: float = 30.0,
    motion_px: tuple[float, float] = (0.0, 0.0),
) -> BottomFit:
    """Locate the lowest point from the edge within ``half_angle_deg`` of the bottom.

    The angle is the eccentric one of the fitted ellipse, that is the cap of the undeformed sphere. The ellipse only
    says where to look: the outline of the cap is the ellipse plus a free displacement, slope and curvature, and third
    and fourth order under a prior, fitted to the pixels as in `fit_silhouette`.
    """
    if fit.status != "ok":
        return BottomFit(math.nan, math.nan, math.nan, math.nan, fit.status)
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    shape = fit.shape.vector(patch.x0, patch.y0)
    settings = np.array([-math.inf, *motion_px, patch.ceiling, 0.0])
    reach = reach_of(PRIOR_LN_S if math.isnan(fit.blur_px) else math.log(fit.blur_px))
    found = refine_bottom(values, shape, math.radians(half_angle_deg), settings, reach, False)
    if found[4] != FOUND and np.isnan(values).any():
        again = refine_bottom(values, shape, math.radians(half_angle_deg), settings, reach, True)
        found = again if again[4] == FOUND else found
    status = STATUS_WORDS[int(found[4])]
    if status != "ok":
        return BottomFit(math.nan, math.nan, math.nan, math.nan, status)
    unc = math.hypot(float(found[2]), CLIPPED_PX if is_clipped(patch) else 0.0)
    return BottomFit(float(found[0]) + patch.x0, float(found[1]) + patch.y0, unc, float(found[3]), status)


@compiled
def cap_rows(shape: Floats, phi: Floats, half_angle: float) -> tuple[Floats, float, float]:
    """Places of the sectors on the cap, -1 to 1 and NaN off it; angle of the lowest point and its depth, px."""
    a, b = semi_axes(shape)
    across, along = -a * math.sin(shape[4]), b * math.cos(shape[4])
    lowest = math.atan2(along, across)
    place = np.empty(phi.size)
    for k in range(phi.size):
        turn = (phi[k] - lowest + math.pi) % (2.0 * math.pi) - math.pi
        place[k] = turn / half_angle if abs(turn) <= half_angle else math.nan
    return place, lowest, math.hypot(across, along)


@compiled
def cap_band(band: Band, place: Floats) -> tuple[Band, Floats]:
    """The sectors on the cap with an empty one beside them on either side, and their places.

    Their Jacobian is that of the powers of the place.
    """
    count, number = place.size, 0
    chosen = np.empty(count, dtype=np.int64)
    for k in range(count):
        if not (math.isnan(place[k]) and math.isnan(place[k - 1]) and math.isnan(place[(k + 1) % count])):
            chosen[number] = k
            number += 1
    rows, places = np.empty((number, band.rows.shape[1])), np.empty(number)
    starts = np.zeros(number + 1, dtype=np.int64)
    plateaus = np.empty((number, band.plateaus.shape[1], band.plateaus.shape[2]))
    for n in range(number):
        k = chosen[n]
        rows[n], places[n], plateaus[n] = band.rows[k], place[k], band.plateaus[k]
        off = math.isnan(place[k])
        for i in range(5):
            rows[n, J + i] = 0.0 if off else place[k] ** i
        starts[n + 1] = starts[n] + (0 if off else band.starts[k + 1] - band.starts[k])
    pixels, sources = np.empty((2, starts[number])), np.empty(starts[number], dtype=np.int64)
    for n in range(number):
        first = band.starts[chosen[n]]
        for m in range(starts[n + 1] - starts[n]):
            pixels[0, starts[n] + m] = band.pixels[0, first + m]
            pixels[1, starts[n] + m] = band.pixels[1, first + m]
            sources[starts[n] + m] = band.places[first + m]
    return Band(pixels, starts, sources, plateaus, rows, band.scene, band.settings), places


@compiled
def share_seen(starts: NDArray[np.int64], place: Floats) -> float:
    """Share of the sectors of the cap that hold most of the pixels that the fullest of them holds."""
    fullest, full, total = 0, 0, 0
    for k in range(place.size):
        fullest = max(fullest, starts[k + 1] - starts[k])
    for k in range(place.size):
        if not math.isnan(place[k]):
            total += 1
            full += 1 if starts[k + 1] - starts[k] > LEAST_SEEN * fullest else 0
    return full / max(1, total)


@compiled
def is_covered(sums: Floats, verdict: Floats) -> bool:
    """Whether too few of the sectors that hold pixels agree with each other."""
    weight, number = 0.0, 0
    for k in range(sums.shape[0]):
        weight += verdict[k, WEIGHT]
        number += 1 if sums[k, COUNT] >= LEAST_PIXELS else 0
    return weight < max(FEWEST_KEPT, LEAST_KEPT * number)


@compiled
def lowest_place(moved: Floats, depth: float, half_angle: float) -> float:
    """Place where depth * cos(angle) plus the fitted displacement is lowest (Newton's method)."""
    t = 0.0
    for _ in range(6):
        angle = half_angle * t
        slope = moved[1] + t * (2.0 * moved[2] + t * (3.0 * moved[3] + 4.0 * t * moved[4]))
        bend = 2.0 * moved[2] + t * (6.0 * moved[3] + 12.0 * t * moved[4])
        first = slope - depth * half_angle * math.sin(angle)
        second = bend - depth * half_angle**2 * math.cos(angle)
        if not second < 0.0:
            return math.nan
        t -= first / second
    return t


@compiled
def cut_cap(
    values: NDArray[np.float32], shape: Floats, ends: tuple[float, float], top: float, margin: float
) -> tuple[NDArray[np.float32], Floats]:
    """The part of the patch below row ``top`` that lies about the cap, and the shape in its pixels.

    ``ends`` are the eccentric angles at which the cap ends, ``margin`` is how far beyond them pixels count (px).
    """
    a, b = semi_axes(shape)
    places = np.empty(2)
    for n in range(2):
        places[n] = a * math.cos(ends[n]) * math.cos(shape[4]) + b * math.sin(ends[n]) * math.sin(shape[4])
    left = min(values.shape[1], max(0, math.floor(shape[0] + places.min() - margin)))
    right = max(left, min(values.shape[1], math.ceil(shape[0] + places.max() + margin) + 1))
    first = min(values.shape[0], max(0, math.floor(top)))
    moved = shape.copy()
    moved[0] -= left
    moved[1] -= first
    return values[first:, left:right].copy(), moved


@compiled
def refine_bottom(
    values: NDArray[np.float32], shape: Floats, half_angle: float, settings: Floats, reach: float, masked: bool
) -> tuple[float, float, float, float, float]:
    """Column, row and its uncertainty (patch px), residual (px) and the index of the status word."""
    nan = math.nan
    a, b = semi_axes(shape)
    count, table = quadrant_table(a, b, SECTOR_PX, SECTOR_ANGLE)
    place, lowest, depth = cap_rows(shape, sector_angles(count, table), half_angle)
    margin = reach + PLATEAU_PX + math.hypot(settings[1], settings[2]) + SECTOR_PX
    settings[0] = -math.inf
    top = shape[1] + depth * math.cos(half_angle) - 1.5 * margin
    part, there = cut_cap(values, shape, (lowest - half_angle, lowest + half_angle), top, margin)
    light = 1.0 if masked else math.nan
    cap, places = cap_band(gather_band(part, there, settings, reach, light), place)
    if share_seen(cap.starts, places) < LEAST_SEEN:
        return nan, nan, nan, nan, OUT_OF_FRAME
    low, high = first_levels(cap.pixels, cap.starts)
    if math.isnan(low):
        return nan, nan, nan, nan, OUT_OF_FRAME
    belief = first_belief(cap, low, high)
    belief.precision[3:] = 1.0 / (PRIOR_SHAPE * shape[2]) ** 2
    moved, factor, sums, verdict = solve_band(cap, belief, np.arange(5), 1)
    if factor.size > 0 and not masked and arc_shares(cap.rows, sums, verdict)[1] > HIDDEN_SHARE:
        cleaned = cleaned_of(part, cap, moved, belief)
        other, places = cap_band(gather_band(cleaned, there, settings, reach, light), place)
        step, better, _, judged = solve_band(other, copied(belief), np.arange(5), 0)
        if better.size > 0 and farthest(other.rows, step - moved) < RECOLLECT_PX:
            cap, moved, factor, verdict = other, step, better, judged
    if factor.size == 0:
        return nan, nan, nan, nan, POOR
    if is_covered(sums, verdict):
        return nan, nan, nan, nan, OCCLUDED
    residual, chi2 = residual_statistics(verdict, 3)
    t = lowest_place(moved, depth, half_angle)
    if math.isnan(chi2) or not abs(t) < 1.0 or farthest(cap.rows, moved) > MOST_SHIFT_PX:
        return nan, nan, nan, nan, POOR
    covariance = invert_block(factor, 5, max(1.0, chi2))
    row, variance = shape[1] + depth * math.cos(half_angle * t), 0.0
    for i in range(5):
        row += moved[i] * t**i
        for j in range(5):
            variance += covariance[i, j] * t ** (i + j)
    phi = lowest + half_angle * t
    column = shape[0] + a * math.cos(phi) * math.cos(shape[4]) + b * math.sin(phi) * math.sin(shape[4])
    return column, row, math.sqrt(variance), residual, FOUND
