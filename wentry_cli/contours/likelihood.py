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

from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Columns of the state of a sector.
OFFSET, INV_S, INSIDE, OUTSIDE, GRADIENT, KAPPA_S, RATIO, SMEAR, STATE = 0, 1, 2, 3, 4, 5, 6, 7, 8
# Columns of the sums of a sector: the lower triangle of its normal matrix over (displacement, inside, outside,
# ln s), the four right-hand sides, then counts, rests and squares.
DD, DI, II, DO, IO, OO, DS, IS, OS, SS, GD, GI, GO, GS = range(14)
COUNT, CHI2, COUNT_IN, REST_IN, SQUARE_IN, COUNT_OUT, REST_OUT, SQUARE_OUT, SUMS = range(14, 23)

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
def expect(distance: Floats, part: Floats, by_edge: Floats, by_out: Floats, by_blur: Floats, model: Floats) -> None:
    """Fill in what the pixels of a sector should show, and its derivatives.

    ``part`` is the state of the sector. Free of branches in the loop, which the compiler turns into vector
    instructions.
    """
    offset, inv_s, smear = part[OFFSET], part[INV_S], part[SMEAR]
    inside, outside, gradient = part[INSIDE], part[OUTSIDE], part[GRADIENT]
    per_path = 0.5 / smear if smear > 0.0 else 0.0
    for n in range(distance.size):
        scaled = (distance[n] + offset) * inv_s
        if smear > 0.0:
            # means over the path, from the integrals x Phi + phi, Phi and -phi
            first, last = scaled - smear, scaled + smear
            before, line_before = look_up(first)
            after, line_after = look_up(last)
            step = (last * after + line_after - first * before - line_before) * per_path
            line, tilted = (after - before) * per_path, (line_before - line_after) * per_path
        else:
            step, line = look_up(scaled)
            tilted = line * scaled
        contrast = outside + gradient * distance[n] - inside
        model[n] = inside + contrast * step
        by_edge[n] = -contrast * line * inv_s
        by_out[n] = step
        by_blur[n] = -contrast * (tilted * part[RATIO] - line * part[KAPPA_S])


@compiled
def cut_at_black(model: Floats, by_out: Floats, noise: Floats) -> None:
    """Turn expected levels into those of a sensor that shows what noise brings below black as black."""
    for n in range(model.size):
        sd = math.sqrt(noise[0] + (noise[1] - noise[0]) * by_out[n])
        step, line = look_up(model[n] / sd)
        model[n] = model[n] * step + sd * line


@compiled
def add_up(row: Floats, weight: Floats, by_edge: Floats, by_out: Floats, by_blur: Floats, rest: Floats) -> None:
    """Fill the sums ``row`` of one sector."""
    dd = di = ii = do = io = oo = ds = inner_s = outer_s = ss = gd = gi = go = gs = chi2 = 0.0
    count_in = rest_in = square_in = count_out = rest_out = square_out = 0.0
    for n in range(rest.size):
        off, step = rest[n], by_out[n]
        by_in = 1.0 - step
        edge, inside, outside = weight[n] * by_edge[n], weight[n] * by_in, weight[n] * step
        blur = weight[n] * by_blur[n]
        dd += edge * by_edge[n]
        di += edge * by_in
        ii += inside * by_in
        do += edge * step
        io += inside * step
        oo += outside * step
        ds += edge * by_blur[n]
        inner_s += inside * by_blur[n]
        outer_s += outside * by_blur[n]
        ss += blur * by_blur[n]
        gd += edge * off
        gi += inside * off
        go += outside * off
        gs += blur * off
        chi2 += weight[n] * off * off
        if step < PLATEAU:
            count_in += 1.0
            rest_in += off
            square_in += off * off
        elif step > 1.0 - PLATEAU:
            count_out += 1.0
            rest_out += off
            square_out += off * off
    row[DD], row[DI], row[II], row[DO], row[IO], row[OO] = dd, di, ii, do, io, oo
    row[DS], row[IS], row[OS], row[SS] = ds, inner_s, outer_s, ss
    row[GD], row[GI], row[GO], row[GS] = gd, gi, go, gs
    row[COUNT], row[CHI2] = float(rest.size), chi2
    row[COUNT_IN], row[REST_IN], row[SQUARE_IN] = count_in, rest_in, square_in
    row[COUNT_OUT], row[REST_OUT], row[SQUARE_OUT] = count_out, rest_out, square_out


@compiled
def accumulate(pixels: Floats, starts: Ints, state: Floats, noise: Floats, ceiling: float, sums: Floats) -> None:
    """Fill ``sums`` (sectors, SUMS) from all pixels of the band, which lie sector by sector from ``starts`` on.

    ``noise`` holds the variances of a pixel inside and outside, 1 where they are not known yet. What is brighter than
    ``ceiling`` counts as that bright: a clipped ground is as bright as the sensor says.
    """
    spread = noise[1] - noise[0]
    longest = 0
    for k in range(starts.size - 1):
        longest = max(longest, starts[k + 1] - starts[k])
    room = np.empty((6, longest))
    for k in range(starts.size - 1):
        number = starts[k + 1] - starts[k]
        if number == 0:
            sums[k] = 0.0
            continue
        distance, level = pixels[0, starts[k] : starts[k + 1]], pixels[1, starts[k] : starts[k + 1]]
        by_edge, by_out, by_blur = room[0, :number], room[1, :number], room[2, :number]
        model, weight, rest = room[3, :number], room[4, :number], room[5, :number]
        expect(distance, state[k], by_edge, by_out, by_blur, model)
        if state[k, INSIDE] ** 2 < BLACK_VARIANCES * noise[0] < BLACK_VARIANCES:
            cut_at_black(model, by_out, noise)
        for n in range(number):
            rest[n] = min(level[n], ceiling) - model[n]
            weight[n] = 1.0 / (noise[0] + spread * by_out[n])
        add_up(sums[k], weight, by_edge, by_out, by_blur, rest)


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
