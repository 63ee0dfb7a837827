"""The cap about the lowest point of an outline: what its pixels say by themselves, free of the ellipse.

The outline of the cap is the ellipse plus a free displacement, slope and curvature, and third and fourth order under a
prior, in powers of the place on the cap (-1 to 1 in eccentric angle).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import ANGLE, DEPARTURE, LENGTH, J, farthest, lowest_angle, semi_axes
from wentry_cli.contours.discrepancy import residual_statistics
from wentry_cli.contours.likelihood import COUNT, first_levels
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.contours.nuisances import Belief
from wentry_cli.contours.plateau import PLATEAU_PX
from wentry_cli.contours.refine import (
    HIDDEN_SHARE,
    RECOLLECT_PX,
    SECTOR_PX,
    Band,
    arc_shares,
    cleaned_of,
    copied,
    first_belief,
    gather_band,
    solve_band,
)
from wentry_cli.contours.sectors import LEAST_PIXELS, WEIGHT

Floats = NDArray[np.float64]

# Half of the cap, in eccentric angle: that of the undeformed sphere.
HALF_ANGLE = math.radians(30.0)
# How much a real bottom may depart from the ellipse in third and fourth order at the ends of the cap, share of R.
PRIOR_SHAPE = 0.004
# Share of the cap that must lie in the picture; of what lies there, share and number of sectors that drops leave free.
LEAST_SEEN, LEAST_KEPT, FEWEST_KEPT = 0.6, 0.2, 3.0
MOST_SHIFT_PX = 3.0
# Column, row and its uncertainty (px), residual (px), and index of the status word.
COLUMN, ROW, UNC, REST, HOW, FOUND_ENTRIES = 0, 1, 2, 3, 4, 5
FOUND, OCCLUDED, POOR, OUT_OF_FRAME, ELSEWHERE = 0.0, 1.0, 2.0, 3.0, 4.0


class Cap(NamedTuple):
    """The sectors of a cap and their places on it, NaN off it."""

    band: Band
    place: Floats


@compiled
def places_on_cap(rows: Floats, lowest: float) -> Floats:
    """Places of sectors on the cap, -1 to 1 and NaN off it."""
    place = np.empty(rows.shape[0])
    for k in range(rows.shape[0]):
        turn = (rows[k, ANGLE] - lowest + math.pi) % (2.0 * math.pi) - math.pi
        place[k] = turn / HALF_ANGLE if abs(turn) <= HALF_ANGLE else math.nan
    return place


@compiled
def cap_of(band: Band) -> Cap:
    """The sectors on the cap with an empty one beside them on either side.

    Their Jacobian is that of the powers of the place.
    """
    place = places_on_cap(band.rows, lowest_angle(band.shape)[0])
    count, number, total = place.size, 0, 0
    chosen = np.empty(count, dtype=np.int64)
    for k in range(count):
        if not (math.isnan(place[k]) and math.isnan(place[k - 1]) and math.isnan(place[(k + 1) % count])):
            chosen[number] = k
            number += 1
            total += 0 if math.isnan(place[k]) else band.starts[k + 1] - band.starts[k]
    rows, places = np.empty((number, band.rows.shape[1])), np.empty(number)
    starts = np.zeros(number + 1, dtype=np.int64)
    plateaus = np.zeros((number, band.plateaus.shape[1], band.plateaus.shape[2]))
    pixels, sources = np.empty((2, total)), np.empty(total, dtype=np.int64)
    for n in range(number):
        k = chosen[n]
        rows[n], places[n] = band.rows[k], place[k]
        rows[n, J : J + 5], rows[n, DEPARTURE] = 0.0, 0.0
        starts[n + 1] = starts[n]
        if math.isnan(place[k]):
            continue
        for i in range(5):
            rows[n, J + i] = place[k] ** i
        plateaus[n] = band.plateaus[k]
        first = band.starts[k]
        starts[n + 1] += band.starts[k + 1] - first
        for m in range(starts[n + 1] - starts[n]):
            pixels[0, starts[n] + m] = band.pixels[0, first + m]
            pixels[1, starts[n] + m] = band.pixels[1, first + m]
            sources[starts[n] + m] = band.places[first + m]
    only = Band(band.shape, pixels, starts, sources, plateaus, rows, band.scene, band.settings, band.width)
    return Cap(only, places)


@compiled
def share_seen(cap: Cap) -> float:
    """Share of the sectors of the cap that hold most of the pixels that there should be."""
    total, full, starts = 0, 0, cap.band.starts
    for k in range(cap.place.size):
        if not math.isnan(cap.place[k]):
            total += 1
            number = starts[k + 1] - starts[k]
            full += 1 if number > LEAST_SEEN * cap.band.rows[k, LENGTH] * cap.band.width else 0
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
def lowest_place(moved: Floats, depth: float) -> float:
    """Place where depth * cos(angle) plus the fitted displacement is lowest (Newton's method)."""
    t = 0.0
    for _ in range(6):
        angle = HALF_ANGLE * t
        slope = moved[1] + t * (2.0 * moved[2] + t * (3.0 * moved[3] + 4.0 * t * moved[4]))
        bend = 2.0 * moved[2] + t * (6.0 * moved[3] + 12.0 * t * moved[4])
        first = slope - depth * HALF_ANGLE * math.sin(angle)
        second = bend - depth * HALF_ANGLE**2 * math.cos(angle)
        if not second < 0.0:
            return math.nan
        t -= first / second
    return t


@compiled
def not_found(how: float) -> Floats:
    """No lowest point, for this reason."""
    found = np.full(FOUND_ENTRIES, math.nan)
    found[HOW] = how
    return found


@compiled
def point_told(shape: Floats, moved: Floats, covariance: Floats, residual: float) -> Floats:
    """The lowest point of a cap about ``shape`` that is displaced by the powers ``moved``: ``FOUND_ENTRIES``."""
    lowest, depth = lowest_angle(shape)
    t = lowest_place(moved, depth)
    row, variance = shape[1] + depth * math.cos(HALF_ANGLE * t), 0.0
    for i in range(5):
        row += moved[i] * t**i
        for j in range(5):
            variance += covariance[i, j] * t ** (i + j)
    if not variance > 0.0 or not abs(t) < 1.0:
        return not_found(POOR)
    found = not_found(FOUND)
    a, b = semi_axes(shape)
    phi = lowest + HALF_ANGLE * t
    found[COLUMN] = shape[0] + a * math.cos(phi) * math.cos(shape[4]) + b * math.sin(phi) * math.sin(shape[4])
    found[ROW], found[UNC], found[REST] = row, math.sqrt(variance), residual
    return found


@compiled
def lowest_point(cap: Cap, moved: Floats, factor: Floats, sums: Floats, verdict: Floats) -> Floats:
    """What the displacement ``moved`` of the cap makes its lowest point: the entries of ``FOUND_ENTRIES``."""
    if factor.size == 0:
        return not_found(POOR)
    if is_covered(sums, verdict):
        return not_found(OCCLUDED)
    residual, chi2 = residual_statistics(verdict, 3)
    if math.isnan(chi2) or farthest(cap.band.rows, moved) > MOST_SHIFT_PX:
        return not_found(POOR)
    return point_told(cap.band.shape, moved, invert_block(factor, 5, max(1.0, chi2)), residual)


@compiled
def constrain(belief: Belief, radius: float) -> None:
    """Put the prior on third and fourth order into ``belief``."""
    belief.precision[:] = 0.0
    belief.precision[3:] = 1.0 / (PRIOR_SHAPE * radius) ** 2


@compiled
def bottom_within(band: Band, belief: Belief) -> Floats:
    """The lowest point from a band that holds the whole outline; ``ELSEWHERE`` where it does not hold all of the cap.

    ``belief`` is what the whole outline says of levels, blur and noise. A cap that is hidden in part wants more than
    the band.
    """
    cap = cap_of(band)
    if share_seen(cap) < 1.0:
        return not_found(ELSEWHERE)
    own = copied(belief)
    constrain(own, band.shape[2])
    moved, factor, sums, verdict = solve_band(cap.band, own, np.arange(5), 1)
    if factor.size == 0 or arc_shares(cap.band.rows, sums, verdict)[1] > HIDDEN_SHARE:
        return not_found(ELSEWHERE)
    return lowest_point(cap, moved, factor, sums, verdict)


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
    cap = cap_of(gather_band(part, there, settings, reach, light))
    low, high = first_levels(cap.band.pixels, cap.band.starts)
    if share_seen(cap) < LEAST_SEEN or math.isnan(low):
        return not_found(OUT_OF_FRAME)
    belief = first_belief(cap.band, low, high)
    constrain(belief, shape[2])
    moved, factor, sums, verdict = solve_band(cap.band, belief, np.arange(5), 1)
    if factor.size > 0 and not masked and arc_shares(cap.band.rows, sums, verdict)[1] > HIDDEN_SHARE:
        cleaned = cleaned_of(part, cap.band, moved, belief)
        other = cap_of(gather_band(cleaned, there, settings, reach, light))
        step, better, _, judged = solve_band(other.band, copied(belief), np.arange(5), 0)
        if better.size > 0 and farthest(other.band.rows, step - moved) < RECOLLECT_PX:
            cap, moved, factor, verdict = other, step, better, judged
    found = lowest_point(cap, moved, factor, sums, verdict)
    found[COLUMN] += shape[0] - there[0]
    found[ROW] += shape[1] - there[1]
    return found
