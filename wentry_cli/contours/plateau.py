"""What lies farther from the edge than its blur reaches: it tells the grey levels that the edge stands between.

An edge is as well known as the two levels beside it, and within the band of the edge half of the pixels are blurred.
Their neighbours farther away cost little: they are summed once, and their model is the level alone. They count only
where they are even: droplets, a neighbour, or a sphere that gets lighter towards its middle say nothing of the edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import KAPPA, LENGTH, NX, NY, X, Y
from wentry_cli.contours.likelihood import (
    BLACK_VARIANCES,
    CHI2,
    COUNT,
    GI,
    GO,
    GRADIENT,
    II,
    INSIDE,
    OO,
    OUTSIDE,
    look_up,
)
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]

# How far the levels are looked at beyond the band of the edge.
PLATEAU_PX = 5.5
# Sums over the pixels of one sector and side: their number, levels l, distances d, and products of these.
N, L, LL, D, LD, DSQUARE, MOMENTS = 0, 1, 2, 3, 4, 5, 6
INNER, OUTER = 0, 1
FEWEST_SECTORS, LEAST_NUMBER = 5, 4.0
# Pixels within of a sharp bend get narrow: the distance over the radius of curvature up to which they count.
DEEPEST = 0.7
# A plateau is left out where its mean or its scatter is so many standard deviations off those of the others.
OFF_SIGMA, UNEVEN_SIGMA = 4.0, 5.0
# By how much light may differ along the outline, and what counts as scatter where a sensor shows none, of the contrast.
LEVEL_RANGE, LEAST_SCATTER = 0.03, 0.002
# A slope across the plateau beyond so many of its standard deviations goes on to the edge, over about so many px.
SLOPE_SIGMA, TO_EDGE_PX = 2.0, 6.0


class Lines(NamedTuple):
    """How the pixels of one sector lie on lines of the picture, rows or columns, which the normal crosses steeply.

    The point of the outline is at line ``start`` and place ``aside``; ``main`` and ``cross`` are the normal along and
    across the lines. ``width`` is half of a sector on the outline's line, ``bend`` how much it widens and ``turn`` how
    far it shifts from line to line. ``size`` are the lines and places of the picture, ``first`` the first of them
    that may be used, ``step`` the pixels from one to the next.
    """

    start: float
    aside: float
    main: float
    cross: float
    width: float
    bend: float
    turn: float
    size: tuple[int, int]
    first: tuple[int, int]
    step: tuple[int, int]


@compiled
def lines_of(row: Floats, size: tuple[int, int], top: int) -> Lines:
    """The lines through a sector in a picture of ``size``, of which the rows above ``top`` are left out."""
    if abs(row[NY]) >= abs(row[NX]):
        start, aside, main, cross = row[Y], row[X], row[NY], row[NX]
        count, first, step = (size[0], size[1]), (top, 0), (size[1], 1)
    else:
        start, aside, main, cross = row[X], row[Y], row[NX], row[NY]
        count, first, step = (size[1], size[0]), (0, top), (1, size[1])
    inverse = 1.0 / main
    width = 0.5 * row[LENGTH] * abs(inverse)
    return Lines(start, aside, main, cross, width, row[KAPPA] * inverse, cross * inverse, count, first, step)


@compiled
def sum_sector(flat: NDArray[np.float32], lines: Lines, near: float, far: float, found: Floats) -> None:
    """Fill ``found`` with the moments of the pixels of one sector between two distances of one sign, near < far.

    Lines of pixels end at the neighbouring sectors, whose borders are normals of the ellipse. Along a line the distance
    grows evenly, which makes its own moments sums of whole numbers.
    """
    found[:] = 0.0
    cross = lines.cross
    one, other = lines.start + near * lines.main, lines.start + far * lines.main
    first, last = max(lines.first[0], math.ceil(min(one, other))), min(lines.size[0] - 1, math.floor(max(one, other)))
    for line in range(first, last + 1):
        along = line - lines.start
        half, middle = lines.width * (1.0 + lines.bend * along), lines.aside + along * lines.turn
        begin, end = max(lines.first[1], math.ceil(middle - half)), min(lines.size[1], math.ceil(middle + half))
        if begin >= end:
            continue
        base = along * lines.main + (begin - lines.aside) * cross
        at, step = np.uint64(line * lines.step[0] + begin * lines.step[1]), np.uint64(lines.step[1])
        level_sum = square_sum = product_sum = 0.0
        place = 0.0
        for _ in range(begin, end):
            level = np.float64(flat[at])
            level_sum += level
            square_sum += level * level
            product_sum += level * place
            place += 1.0
            at += step
        if math.isnan(level_sum):
            add_seen(flat, (np.uint64(at - step * np.uint64(end - begin)), step), end - begin, (base, cross), found)
            continue
        places, squares = 0.5 * place * (place - 1.0), place * (place - 1.0) * (2.0 * place - 1.0) / 6.0
        found[N] += place
        found[L] += level_sum
        found[LL] += square_sum
        found[D] += base * place + cross * places
        found[LD] += base * level_sum + cross * product_sum
        found[DSQUARE] += base * (base * place + 2.0 * cross * places) + cross * cross * squares


@compiled
def add_seen(
    flat: NDArray[np.float32], start: tuple[np.uint64, np.uint64], count: int, line: tuple[float, float], found: Floats
) -> None:
    """Add the moments of those of ``count`` pixels that are not masked.

    ``start`` is where the first of them is and how far apart they are in ``flat``; ``line`` the distance of the first
    from the edge, and what it grows by.
    """
    for n in range(count):
        level = np.float64(flat[start[0] + np.uint64(n) * start[1]])
        if not math.isnan(level):
            distance = line[0] + n * line[1]
            found[N] += 1.0
            found[L] += level
            found[LL] += level * level
            found[D] += distance
            found[LD] += level * distance
            found[DSQUARE] += distance * distance


@compiled
def sum_plateaus(
    values: NDArray[np.float32],
    rows: Floats,
    starts: NDArray[np.int64],
    inner: tuple[float, float],
    outer: tuple[float, float],
    top_y: float,
    fewest: float,
) -> Floats:
    """Moments (sectors, 2 sides, MOMENTS) of the pixels inside and outside, from where to how far from the edge (px).

    ``starts`` says where the pixels of the edge of each sector begin. 0 where these or those are too few, or do not
    look like those of the other sectors.
    """
    plateaus, flat = np.zeros((rows.shape[0], 2, MOMENTS)), values.reshape(-1)
    top = max(0, math.ceil(top_y)) if top_y > 0.0 else 0
    for k in range(rows.shape[0]):
        if starts[k + 1] - starts[k] < fewest:
            continue
        lines = lines_of(rows[k], values.shape, top)
        deepest = min(inner[1], DEEPEST / max(rows[k, KAPPA], 1e-6))
        if deepest > inner[0]:
            sum_sector(flat, lines, -deepest, -inner[0], plateaus[k, INNER])
        if outer[1] > outer[0]:
            sum_sector(flat, lines, outer[0], outer[1], plateaus[k, OUTER])
    leave_out_uneven(plateaus)
    return plateaus


@compiled
def leave_out_uneven(plateaus: Floats) -> None:
    """Set the moments to 0 where mean or scatter stands out from those of most sectors on the same side."""
    count = plateaus.shape[0]
    means, scatters, numbers = np.empty((2, count)), np.empty((2, count)), np.zeros(2, dtype=np.int64)
    for k in range(count):
        for side in range(2):
            number = plateaus[k, side, N]
            if number < LEAST_NUMBER:
                plateaus[k, side] = 0.0
                continue
            mean = plateaus[k, side, L] / number
            means[side, numbers[side]] = mean
            scatters[side, numbers[side]] = (plateaus[k, side, LL] - number * mean * mean) / (number - 1.0)
            numbers[side] += 1
    middles = np.array([median_of(means[0], numbers[0]), median_of(means[1], numbers[1])])
    contrast = abs(middles[1] - middles[0]) if numbers.min() > 0 else abs(middles[numbers.argmax()])
    for side in range(2):
        if numbers[side] < FEWEST_SECTORS:
            plateaus[:, side] = 0.0
            continue
        scatter = max(median_of(scatters[side], numbers[side]), (LEAST_SCATTER * contrast) ** 2)
        for n in range(numbers[side]):
            means[side, n] = abs(means[side, n] - middles[side])
        usual = min(OFF_SIGMA * 1.4826 * median_of(means[side], numbers[side]), LEVEL_RANGE * contrast)
        for k in range(count):
            number = plateaus[k, side, N]
            if number == 0.0:
                continue
            mean = plateaus[k, side, L] / number
            own = (plateaus[k, side, LL] - number * mean * mean) / (number - 1.0)
            off = abs(mean - middles[side]) > max(OFF_SIGMA * math.sqrt(scatter / number), usual)
            if off or own > scatter * (1.0 + UNEVEN_SIGMA * math.sqrt(2.0 / (number - 1.0))):
                plateaus[k, side] = 0.0


@compiled
def expected_level(part: Floats, side: int, noise: Floats) -> float:
    """Level that a plateau beside a sector of the state ``part`` should show at the edge."""
    if side == OUTER:
        return float(part[OUTSIDE])
    level = part[INSIDE]
    if level**2 < BLACK_VARIANCES * noise[0] < BLACK_VARIANCES:
        sd = math.sqrt(noise[0])
        step, line = look_up(level / sd)
        return float(level * step + sd * line)
    return float(level)


@compiled
def evenness(plateaus: Floats, state: Floats, side: int, noise: Floats) -> float:
    """What the pixels of one side count, 0 to 1: less the more their level goes on to change towards the edge."""
    total, weight, number = 0.0, 0.0, 0.0
    for k in range(plateaus.shape[0]):
        one = plateaus[k, side]
        if one[N] == 0.0:
            continue
        slope = state[k, GRADIENT] if side == OUTER else 0.0
        away = one[D] / one[N]
        spread = one[DSQUARE] - one[N] * away * away
        total += one[LD] - away * one[L] - slope * spread
        weight += spread
        number += one[N]
    if not weight > 0.0:
        return 0.0
    excess = max(0.0, (total / weight) ** 2 - SLOPE_SIGMA**2 * noise[side] / weight)
    return float(1.0 / (1.0 + TO_EDGE_PX**2 * excess * number / noise[side]))


@compiled
def add_plateaus(plateaus: Floats, state: Floats, noise: Floats, sums: Floats) -> None:
    """Add what the plateaus say of the levels to the ``sums`` of their sectors (see `likelihood`)."""
    for side in range(2):
        share = evenness(plateaus, state, side, noise)
        if share == 0.0:
            continue
        weight = share / noise[side]
        square, pull = (II, GI) if side == INNER else (OO, GO)
        for k in range(plateaus.shape[0]):
            one = plateaus[k, side]
            if one[N] == 0.0:
                continue
            level, slope = expected_level(state[k], side, noise), state[k, GRADIENT] if side == OUTER else 0.0
            rest = one[L] - one[N] * level - slope * one[D]
            rests = one[LL] - level * (one[L] + rest) - slope * (2.0 * one[LD] - slope * one[DSQUARE] - level * one[D])
            sums[k, square] += weight * one[N]
            sums[k, pull] += weight * rest
            sums[k, CHI2] += weight * rests
            sums[k, COUNT] += share * one[N]
