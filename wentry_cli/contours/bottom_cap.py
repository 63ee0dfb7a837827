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
from wentry_cli.contours.band import Band
from wentry_cli.contours.discrepancy import residual_statistics
from wentry_cli.contours.global_step import advance, is_negligible, remains, step_from
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.contours.nuisances import Belief
from wentry_cli.contours.refine import HIDDEN_SHARE, Refined, arc_shares, copied, solve_band, take
from wentry_cli.contours.sectors import MOVED, NUMBER, VERDICT, WEIGHT, weigh_sectors

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

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
    """The sectors ``chosen`` of a cap with an empty one beside them on either side: their places, NaN off the cap.

    The Jacobian of the ``rows`` is that of the powers of the place.
    """

    chosen: Ints
    place: Floats
    rows: Floats


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
    """The sectors of a band that lie on the cap."""
    place = places_on_cap(band.rows, lowest_angle(band.shape)[0])
    count, number = place.size, 0
    chosen = np.empty(count, dtype=np.int64)
    for k in range(count):
        if not (math.isnan(place[k]) and math.isnan(place[k - 1]) and math.isnan(place[(k + 1) % count])):
            chosen[number] = k
            number += 1
    rows, places = np.empty((number, band.rows.shape[1])), np.empty(number)
    for n in range(number):
        k = chosen[n]
        rows[n], places[n] = band.rows[k], place[k]
        rows[n, J : J + 5], rows[n, DEPARTURE] = 0.0, 0.0
        if not math.isnan(place[k]):
            for i in range(5):
                rows[n, J + i] = place[k] ** i
    return Cap(chosen[:number].copy(), places, rows)


@compiled
def cut_out(band: Band, cap: Cap) -> Band:
    """The pixels of the cap alone."""
    number, total = cap.place.size, 0
    for n in range(number):
        k = cap.chosen[n]
        total += 0 if math.isnan(cap.place[n]) else band.starts[k + 1] - band.starts[k]
    starts = np.zeros(number + 1, dtype=np.int64)
    plateaus = np.zeros((number, band.plateaus.shape[1], band.plateaus.shape[2]))
    pixels, sources = np.empty((2, total)), np.empty(total, dtype=np.int64)
    for n in range(number):
        k = cap.chosen[n]
        starts[n + 1] = starts[n]
        if math.isnan(cap.place[n]):
            continue
        plateaus[n] = band.plateaus[k]
        first = band.starts[k]
        starts[n + 1] += band.starts[k + 1] - first
        for m in range(starts[n + 1] - starts[n]):
            pixels[0, starts[n] + m] = band.pixels[0, first + m]
            pixels[1, starts[n] + m] = band.pixels[1, first + m]
            sources[starts[n] + m] = band.places[first + m]
    return Band(
        band.shape, pixels, starts, sources, plateaus, cap.rows, band.scene, band.settings, band.width, band.fewest
    )


@compiled
def share_seen(cap: Cap, band: Band) -> float:
    """Share of the sectors of the cap that hold most of the pixels that there should be."""
    total, full = 0, 0
    for n in range(cap.place.size):
        if not math.isnan(cap.place[n]):
            k = cap.chosen[n]
            total += 1
            number = band.starts[k + 1] - band.starts[k]
            full += 1 if number > LEAST_SEEN * cap.rows[n, LENGTH] * band.width else 0
    return full / max(1, total)


@compiled
def is_covered(verdict: Floats) -> bool:
    """Whether too few of the sectors that hold pixels agree with each other."""
    weight, number = 0.0, 0
    for k in range(verdict.shape[0]):
        weight += verdict[k, WEIGHT]
        number += 1 if verdict[k, NUMBER] > 0.0 else 0
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
def lowest_point(shape: Floats, rows: Floats, moved: Floats, factor: Floats, verdict: Floats) -> Floats:
    """What the displacement ``moved`` of a cap about ``shape`` makes its lowest point: ``FOUND_ENTRIES``."""
    if factor.size == 0:
        return not_found(POOR)
    if is_covered(verdict):
        return not_found(OCCLUDED)
    residual, chi2 = residual_statistics(verdict, 3)
    if math.isnan(chi2) or farthest(rows, moved) > MOST_SHIFT_PX:
        return not_found(POOR)
    return point_told(shape, moved, invert_block(factor, 5, max(1.0, chi2)), residual)


@compiled
def constrain(belief: Belief, radius: float) -> None:
    """Put the prior on third and fourth order into ``belief``."""
    belief.precision[:] = 0.0
    belief.precision[3:] = 1.0 / (PRIOR_SHAPE * radius) ** 2


@compiled
def bottom_within(refined: Refined, shape: Floats) -> Floats:
    """The lowest point from a band that holds the whole outline; ``ELSEWHERE`` where it does not hold all of the cap.

    What the whole outline says of levels, blur and noise is believed. A cap that is hidden in part wants more than the
    band.
    """
    cap = cap_of(refined.band)
    if share_seen(cap, refined.band) < 1.0:
        return not_found(ELSEWHERE)
    if shape.size == 5:
        found = bottom_of_sectors(refined, cap, shape)
        if found[HOW] == FOUND:
            return found
    own = copied(refined.belief)
    constrain(own, refined.band.shape[2])
    moved, factor, verdict = solve_band(cut_out(refined.band, cap), own, np.arange(5), 1)
    if factor.size == 0 or arc_shares(cap.rows, verdict)[1] > HIDDEN_SHARE:
        return not_found(ELSEWHERE)
    return lowest_point(refined.band.shape, cap.rows, moved, factor, verdict)


@compiled
def bottom_of_sectors(refined: Refined, cap: Cap, shape: Floats) -> Floats:
    """The lowest point from what the sectors say of the outline that was found, at ``shape``.

    ``ELSEWHERE`` where the cap is too far off it for one linear step, or hidden in part.
    """
    verdict = np.zeros((cap.place.size, VERDICT))
    for n in range(cap.place.size):
        if math.isnan(cap.place[n]):
            verdict[n, MOVED] = math.nan
        else:
            verdict[n] = refined.verdict[cap.chosen[n]]
    own, scene, powers = copied(refined.belief), refined.band.scene, np.arange(5)
    constrain(own, scene[2])
    moved, blur, sure = np.zeros(5), 0.0, np.zeros(cap.place.size)
    factor = np.zeros((0, 0))
    for turn in range(2):
        weigh_sectors(verdict, scene[2], False, turn == 0, sure)
        step, factor = step_from(verdict, cap.rows, powers, scene, moved, own)
        if factor.size == 0:
            return not_found(ELSEWHERE)
        blur += take(step, powers, moved, own.nuisance)
        advance(verdict, cap.rows, powers, scene, step)
    if arc_shares(cap.rows, verdict)[1] > HIDDEN_SHARE:
        return not_found(ELSEWHERE)
    if not is_negligible(remains(cap.rows, moved, blur), verdict):
        return not_found(ELSEWHERE)
    return lowest_point(shape, cap.rows, moved, factor, verdict)
