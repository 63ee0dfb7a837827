"""Level "accurate", its inner loop: the misfit of an error-function edge model and its local normal equations.

In sector k a pixel at signed distance d from the ellipse is expected at
    I = inside + (outside + gradient d - inside) Phi((d - displacement + shift) / s)
with s the normal blur and shift = curvature * (variance along the edge) / 2, the inward shift of a blurred convex edge.
Motion across the edge smears it evenly: a mean over three Gauss-Legendre nodes. Sums per sector over the local
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
# ln s), the four right-hand sides, then counts and squares.
DD, DI, II, DO, IO, OO, DS, IS, OS, SS, GD, GI, GO, GS = range(14)
COUNT, CHI2, COUNT_IN, SQUARE_IN, COUNT_OUT, SQUARE_OUT, SUMS = 14, 15, 16, 17, 18, 19, 20

REACH = 6.0
# The noise is taken where the edge does not reach: its model is not exact to the noise of a good camera.
PLATEAU = 0.03
PER_UNIT = 64
_NODES = np.linspace(-REACH, REACH, int(2 * REACH * PER_UNIT) + 2)
STEP_TABLE = np.array([0.5 * (1.0 + math.erf(node / math.sqrt(2.0))) for node in _NODES])
LINE_TABLE = np.exp(-0.5 * _NODES**2) / math.sqrt(2.0 * math.pi)
TABLE_SCALE = (len(_NODES) - 1) / (2.0 * REACH)


@compiled
def look_up(scaled: float) -> tuple[float, float]:
    """Integral and density of the normal distribution, from tables with linear interpolation (error 1e-5)."""
    place = (min(REACH - 1e-6, max(-REACH, scaled)) + REACH) * TABLE_SCALE
    node = int(place)
    share = place - node
    step = STEP_TABLE[node] + share * (STEP_TABLE[node + 1] - STEP_TABLE[node])
    return step, LINE_TABLE[node] + share * (LINE_TABLE[node + 1] - LINE_TABLE[node])


@compiled
def accumulate(pixels: Floats, sectors: Ints, state: Floats, noise: Floats, ceiling: float, sums: Floats) -> None:
    """Fill ``sums`` (sectors, SUMS) from all pixels of the band.

    ``noise`` holds the variances of a pixel inside and outside. What is brighter than ``ceiling`` counts as that
    bright: a clipped ground is as bright as the sensor says.
    """
    sums[:] = 0.0
    spread = noise[1] - noise[0]
    for n in range(pixels.shape[0]):
        k = sectors[n]
        distance, level = pixels[n, 0], pixels[n, 1]
        part = state[k]
        scaled = (distance + part[OFFSET]) * part[INV_S]
        step, line = look_up(scaled)
        tilted = line * scaled
        if part[SMEAR] > 0.0:
            before, line_before = look_up(scaled - part[SMEAR])
            after, line_after = look_up(scaled + part[SMEAR])
            step = (8.0 * step + 5.0 * (before + after)) / 18.0
            line = (8.0 * line + 5.0 * (line_before + line_after)) / 18.0
            tilted = 8.0 * tilted + 5.0 * (scaled - part[SMEAR]) * line_before
            tilted = (tilted + 5.0 * (scaled + part[SMEAR]) * line_after) / 18.0
        contrast = part[OUTSIDE] + part[GRADIENT] * distance - part[INSIDE]
        model = part[INSIDE] + contrast * step
        rest = min(level, ceiling) - model
        weight = 1.0 / (noise[0] + spread * step)
        by_edge = -contrast * line * part[INV_S]
        by_in, by_out = 1.0 - step, step
        by_blur = -contrast * (tilted * part[RATIO] - line * part[KAPPA_S])
        row = sums[k]
        edge, inside, outside, blur = weight * by_edge, weight * by_in, weight * by_out, weight * by_blur
        row[DD] += edge * by_edge
        row[DI] += edge * by_in
        row[II] += inside * by_in
        row[DO] += edge * by_out
        row[IO] += inside * by_out
        row[OO] += outside * by_out
        row[DS] += edge * by_blur
        row[IS] += inside * by_blur
        row[OS] += outside * by_blur
        row[SS] += blur * by_blur
        row[GD] += edge * rest
        row[GI] += inside * rest
        row[GO] += outside * rest
        row[GS] += blur * rest
        row[COUNT] += 1.0
        row[CHI2] += weight * rest * rest
        if step < PLATEAU:
            row[COUNT_IN] += 1.0
            row[SQUARE_IN] += rest * rest
        elif step > 1.0 - PLATEAU:
            row[COUNT_OUT] += 1.0
            row[SQUARE_OUT] += rest * rest


@compiled
def first_levels(pixels: Floats, sectors: Ints, count: int) -> tuple[float, float]:
    """Median over the sectors of the mean level well inside and well outside; NaN where no sector has one."""
    totals = np.zeros((count, 4))
    for n in range(pixels.shape[0]):
        k = sectors[n]
        if pixels[n, 0] < -2.0:
            totals[k, 0] += pixels[n, 1]
            totals[k, 1] += 1.0
        elif pixels[n, 0] > 2.0:
            totals[k, 2] += pixels[n, 1]
            totals[k, 3] += 1.0
    levels = np.empty((2, count))
    found = np.zeros(2, dtype=np.int64)
    for k in range(count):
        for side in range(2):
            if totals[k, 2 * side + 1] > 2.0:
                levels[side, found[side]] = totals[k, 2 * side] / totals[k, 2 * side + 1]
                found[side] += 1
    return median_of(levels[0], found[0]), median_of(levels[1], found[1])
