"""Level "accurate", its inner loop: the misfit of an error-function edge model and its local normal equations.

In sector k a pixel at signed distance d from the ellipse is expected at
    I = inside + (outside + gradient d - inside) Phi((d - displacement + shift) / s)
with s the normal blur and shift = curvature * (variance along the edge) / 2, the inward shift of a blurred convex edge.
Motion across the edge smears it evenly, and Phi gives way to its mean over the path. Sums per sector over the local
parameters (displacement, inside, outside, ln s) are all that the global fit needs: within a sector the Jacobian of the
displacement hardly changes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled, reordered
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Columns of the state of a sector.
OFFSET, INV_S, INSIDE, OUTSIDE, GRADIENT, KAPPA_S, RATIO, SMEAR, STATE = 0, 1, 2, 3, 4, 5, 6, 7, 8
# Columns of the sums of a sector: the lower triangle of its normal matrix over (displacement, inside, outside,
# ln s), the four right-hand sides, then counts, rests and squares.
DD, DI, II, DO, IO, OO, DS, IS, OS, SS, GD, GI, GO, GS = range(14)
COUNT, CHI2, COUNT_IN, REST_IN, SQUARE_IN, COUNT_OUT, REST_OUT, SQUARE_OUT, SUMS = range(14, 23)

# Rows of the room in which the pixels of a band are worked on.
CONTRAST, STEP, EDGE, BLUR, WEIGHT, REST, ROOM = 0, 1, 2, 3, 4, 5, 6

REACH = 6.0
# The noise is taken where the edge does not reach: its model is not exact to the noise of a good camera.
PLATEAU = 0.03
# An inside with less than so many variances of its noise is cut off at black.
BLACK_VARIANCES = 9.0
PER_UNIT = 64
_NODES = np.linspace(-REACH, REACH, int(2 * REACH * PER_UNIT) + 2)
STEP_TABLE = np.array([0.5 * (1.0 + math.erf(node / math.sqrt(2.0))) for node in _NODES])
LINE_TABLE = np.exp(-0.5 * _NODES**2) / math.sqrt(2.0 * math.pi)
TABLE_SCALE = (len(_NODES) - 1) / (2.0 * REACH)


@compiled
def look_up(scaled: float) -> tuple[float, float]:
    """Integral and density of the normal distribution, from tables with linear interpolation (error 1e-5)."""
    place = (min(REACH - 1e-6, max(-REACH, scaled)) + REACH) * TABLE_SCALE
    node = np.uint32(place)  # an index that cannot be negative needs no branch
    share, after = place - node, node + np.uint32(1)
    step = STEP_TABLE[node] + share * (STEP_TABLE[after] - STEP_TABLE[node])
    return step, LINE_TABLE[node] + share * (LINE_TABLE[after] - LINE_TABLE[node])


@compiled
def scale_distances(distance: Floats, starts: Ints, state: Floats, scaled: Floats, contrast: Floats) -> None:
    """Fill in how many blurs outside of the edge each pixel is, and the step of the level that its sector expects."""
    for k in range(starts.size - 1):
        offset, inv_s = state[k, OFFSET], state[k, INV_S]
        step, gradient = state[k, OUTSIDE] - state[k, INSIDE], state[k, GRADIENT]
        for n in range(starts[k], starts[k + 1]):
            scaled[n] = (distance[n] + offset) * inv_s
            contrast[n] = step + gradient * distance[n]


@compiled
def look_up_all(scaled: Floats, step: Floats, line: Floats, tilted: Floats) -> None:
    """Fill in Phi, phi and phi times ``scaled`` of a sharp edge."""
    for n in range(scaled.size):
        step[n], line[n] = look_up(scaled[n])
        tilted[n] = line[n] * scaled[n]


@compiled
def smear_over(scaled: Floats, smear: float, step: Floats, line: Floats, tilted: Floats) -> None:
    """Put the means over the path, ``smear`` to either side, in place of Phi, phi and phi times ``scaled``.

    From the integrals x Phi + phi, Phi and -phi.
    """
    per_path = 0.5 / smear
    for n in range(scaled.size):
        first, last = scaled[n] - smear, scaled[n] + smear
        before, line_before = look_up(first)
        after, line_after = look_up(last)
        step[n] = (last * after + line_after - first * before - line_before) * per_path
        line[n], tilted[n] = (after - before) * per_path, (line_before - line_after) * per_path


@compiled
def cut_at_black(model: Floats, by_out: Floats, noise: Floats) -> None:
    """Turn expected levels into those of a sensor that shows what noise brings below black as black."""
    for n in range(model.size):
        sd = math.sqrt(noise[0] + (noise[1] - noise[0]) * by_out[n])
        step, line = look_up(model[n] / sd)
        model[n] = model[n] * step + sd * line


@compiled
def compare(level: Floats, ceiling: float, inside: float, noise: Floats, room: Floats) -> None:
    """Turn contrast, Phi, phi and phi times the scaled distance in ``room`` into what is summed.

    That is, in rows from EDGE on, the change of the level with displacement (times s) and with ln s of a straight edge,
    and weight and rest.
    """
    contrast, step, line, tilted = room[CONTRAST], room[STEP], room[EDGE], room[BLUR]
    weight, rest = room[WEIGHT], room[REST]
    for n in range(level.size):
        weight[n] = inside + contrast[n] * step[n]
    if inside * inside < BLACK_VARIANCES * noise[0] < BLACK_VARIANCES:
        cut_at_black(weight, step, noise)
    spread = noise[1] - noise[0]
    for n in range(level.size):
        rest[n] = min(level[n], ceiling) - weight[n]
        weight[n] = 1.0 / (noise[0] + spread * step[n])
        line[n] *= -contrast[n]
        tilted[n] *= -contrast[n]


@reordered
def sum_levels(room: Floats, first: int, last: int, row: Floats) -> None:
    """Products of displacement, levels and rest, over the pixels of one sector."""
    edge, out, weight, rest = (
        room[EDGE, first:last],
        room[STEP, first:last],
        room[WEIGHT, first:last],
        room[REST, first:last],
    )
    dd = di = ii = do = io = oo = gd = gi = 0.0
    for n in range(rest.size):
        by_in = 1.0 - out[n]
        by_edge, inside, outside = weight[n] * edge[n], weight[n] * by_in, weight[n] * out[n]
        dd += by_edge * edge[n]
        di += by_edge * by_in
        do += by_edge * out[n]
        ii += inside * by_in
        io += inside * out[n]
        oo += outside * out[n]
        gd += by_edge * rest[n]
        gi += inside * rest[n]
    row[DD], row[DI], row[II], row[DO], row[IO], row[OO], row[GD], row[GI] = dd, di, ii, do, io, oo, gd, gi


@reordered
def sum_blur(room: Floats, first: int, last: int, row: Floats) -> None:
    """Products with the change by ln s, and of the rest with itself and the outer level."""
    edge, blur, out = room[EDGE, first:last], room[BLUR, first:last], room[STEP, first:last]
    weight, rest = room[WEIGHT, first:last], room[REST, first:last]
    ds = inner_s = outer_s = ss = go = gs = chi2 = 0.0
    for n in range(rest.size):
        by_blur, off = weight[n] * blur[n], weight[n] * rest[n]
        ds += by_blur * edge[n]
        inner_s += by_blur * (1.0 - out[n])
        outer_s += by_blur * out[n]
        ss += by_blur * blur[n]
        gs += by_blur * rest[n]
        go += off * out[n]
        chi2 += off * rest[n]
    row[DS], row[IS], row[OS], row[SS], row[GS], row[GO], row[CHI2] = ds, inner_s, outer_s, ss, gs, go, chi2


@reordered
def sum_plateau(room: Floats, first: int, last: int, row: Floats) -> None:
    """Number, rests and their squares of the pixels that the edge does not reach, on either side."""
    out, rest = room[STEP, first:last], room[REST, first:last]
    count_in = rest_in = square_in = count_out = rest_out = square_out = 0.0
    for n in range(rest.size):
        dark, light = 1.0 if out[n] < PLATEAU else 0.0, 1.0 if out[n] > 1.0 - PLATEAU else 0.0
        count_in += dark
        rest_in += dark * rest[n]
        square_in += dark * rest[n] * rest[n]
        count_out += light
        rest_out += light * rest[n]
        square_out += light * rest[n] * rest[n]
    row[COUNT_IN], row[REST_IN], row[SQUARE_IN] = count_in, rest_in, square_in
    row[COUNT_OUT], row[REST_OUT], row[SQUARE_OUT] = count_out, rest_out, square_out


@compiled
def bend_sums(part: Floats, row: Floats) -> None:
    """Turn the sums over a straight edge of unit blur into those of a sector, whose edge is blurred and convex."""
    inv_s, share, shift = part[INV_S], part[RATIO], part[KAPPA_S]
    dd, di, do, gd, ds, ss = row[DD], row[DI], row[DO], row[GD], row[DS], row[SS]
    row[SS] = share * share * ss - 2.0 * share * shift * ds + shift * shift * dd
    row[DS] = inv_s * (share * ds - shift * dd)
    row[IS] = share * row[IS] - shift * di
    row[OS] = share * row[OS] - shift * do
    row[GS] = share * row[GS] - shift * gd
    row[DD], row[DI], row[DO], row[GD] = inv_s * inv_s * dd, inv_s * di, inv_s * do, inv_s * gd


@compiled
def expect(pixels: Floats, starts: Ints, state: Floats, noise: Floats, ceiling: float) -> Floats:
    """What the pixels of a band should show, what they show, and how that changes: rows of (ROOM, pixels).

    The pixels lie sector by sector from ``starts`` on. ``noise`` holds the variances of a pixel inside and outside, 1
    where they are not known yet. What is brighter than ``ceiling`` counts as that bright: a clipped ground is as bright
    as the sensor says. Loops without a branch over all pixels become vector instructions.
    """
    room = np.empty((ROOM, pixels.shape[1]))
    scale_distances(pixels[0], starts, state, room[REST], room[CONTRAST])
    look_up_all(room[REST], room[STEP], room[EDGE], room[BLUR])
    for k in range(starts.size - 1):
        if state[k, SMEAR] > 0.0:
            part = room[:, starts[k] : starts[k + 1]]
            smear_over(part[REST], state[k, SMEAR], part[STEP], part[EDGE], part[BLUR])
    compare(pixels[1], ceiling, state[0, INSIDE], noise, room)
    return room


@compiled
def accumulate(pixels: Floats, starts: Ints, state: Floats, noise: Floats, ceiling: float, sums: Floats) -> None:
    """Fill ``sums`` (sectors, SUMS) from all pixels of the band; the rest as in `expect`."""
    room = expect(pixels, starts, state, noise, ceiling)
    for k in range(starts.size - 1):
        first, last = starts[k], starts[k + 1]
        if first == last:
            sums[k] = 0.0
            continue
        sum_levels(room, first, last, sums[k])
        sum_blur(room, first, last, sums[k])
        sum_plateau(room, first, last, sums[k])
        bend_sums(state[k], sums[k])
        sums[k, COUNT] = last - first


@compiled
def first_levels(pixels: Floats, starts: Ints) -> tuple[float, float]:
    """Median over the sectors of the mean level well inside and well outside; NaN where no sector has one."""
    levels = np.empty((2, starts.size - 1))
    found = np.zeros(2, dtype=np.int64)
    totals, counts = np.empty(2), np.empty(2)
    for k in range(starts.size - 1):
        totals[:], counts[:] = 0.0, 0.0
        for n in range(starts[k], starts[k + 1]):
            if abs(pixels[0, n]) > 2.0:
                side = 1 if pixels[0, n] > 0.0 else 0
                totals[side] += pixels[1, n]
                counts[side] += 1.0
        for side in range(2):
            if counts[side] > 2.0:
                levels[side, found[side]] = totals[side] / counts[side]
                found[side] += 1
    return median_of(levels[0], found[0]), median_of(levels[1], found[1])
