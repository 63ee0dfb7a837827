"""Pixels that no edge explains: what hides a part of a sector need not cost the whole of it.

A droplet that touches the outline spoils some pixels of a sector and leaves others as they are. Once the outline is
known from the sectors that nothing hides, each pixel can be judged by itself: those that stand out from what an edge
shows are masked together with their neighbours, into which the blur of what hides them reaches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.band import Band
from wentry_cli.contours.discrepancy import residual_statistics
from wentry_cli.contours.global_step import outline_variance
from wentry_cli.contours.likelihood import EDGE, INV_S, REST, STATE, STEP, WEIGHT, expect
from wentry_cli.contours.nuisances import Belief
from wentry_cli.contours.sectors import TOLERANCE_OF_R, TOLERANCE_PX, set_state

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Standard deviations from which a pixel is spoilt, and how far (px, rows and columns) that reaches.
SPOILT_SIGMA, REACH_PX = 3.5, 1
# A sector that keeps less of what it tells about its edge is left out: what is left of it proves little.
LEAST_INFORMATION = 0.2
# What an outline may depart from the ellipse where it is hidden, over what it does where it is seen.
DEPARTS = 2.0


@compiled
def cleaned_of(
    values: NDArray[np.float32], band: Band, moved: Floats, belief: Belief, solved: tuple[Floats, Floats, Ints]
) -> NDArray[np.float32]:
    """The patch without the pixels of the band that do not fit what is believed (see `spoilt`).

    ``solved`` are the Cholesky factor of the last normal matrix, what the sectors said, and the free parameters. An
    edge may be off by what the outline is not known there and, since no sphere is an ellipse, by some times of what the
    kept sectors are off by, but not more than is tolerated of them.
    """
    factor, verdict, free = solved
    state = np.zeros((band.rows.shape[0], STATE))
    set_state(state, band.rows, moved, belief.nuisance, band.scene)
    off = max(TOLERANCE_PX, TOLERANCE_OF_R * band.scene[2])
    off = np.fmin(off, DEPARTS * residual_statistics(verdict, free.size)[0])  # NaN where too few sectors were kept
    loose = outline_variance(factor, band.rows, free)
    room = expect(band.pixels, band.starts, state, belief.noise, band.settings[3])
    return without_spoilt(values, room, band.starts, band.places, state, belief.spread, off**2 + loose)


@compiled
def blot(values: NDArray[np.float32], place: int) -> None:
    """Mask the pixel at ``place``, counted line by line, and those near it."""
    row, column = place // values.shape[1], place % values.shape[1]
    for y in range(max(0, row - REACH_PX), min(values.shape[0], row + REACH_PX + 1)):
        for x in range(max(0, column - REACH_PX), min(values.shape[1], column + REACH_PX + 1)):
            values[y, x] = np.nan


@compiled
def without_spoilt(
    values: NDArray[np.float32],
    room: Floats,
    starts: Ints,
    places: Ints,
    state: Floats,
    spread: Floats,
    off: Floats,
) -> NDArray[np.float32]:
    """The patch with the spoilt pixels of the band masked.

    ``room`` is what the pixels show beside what they should, ``state`` what their sectors are expected to show (see
    `likelihood`); ``spread`` are the variances of the sectors' own levels inside and outside, ``off`` is that of where
    the edge of each is (px^2).
    """
    cleaned = values.copy()
    information = np.empty(places.size)
    for k in range(starts.size - 1):
        for n in range(starts[k], starts[k + 1]):
            by_edge, by_out = room[EDGE, n] * state[k, INV_S], room[STEP, n]
            level = spread[0] * (1.0 - by_out) ** 2 + spread[1] * by_out**2
            information[n] = by_edge**2 * room[WEIGHT, n]
            variance = 1.0 / room[WEIGHT, n] + level + off[k] * by_edge**2
            if room[REST, n] ** 2 > SPOILT_SIGMA**2 * variance:
                blot(cleaned, places[n])
    leave_out_scraps(cleaned.reshape(-1), starts, places, information)
    return cleaned


@compiled
def leave_out_scraps(levels: NDArray[np.float32], starts: Ints, places: Ints, information: Floats) -> None:
    """Mask what is left of the sectors of which too little is left; ``information`` is what each pixel told."""
    for k in range(starts.size - 1):
        total, left = 0.0, 0.0
        for n in range(starts[k], starts[k + 1]):
            total += information[n]
            if not np.isnan(levels[places[n]]):
                left += information[n]
        if left < LEAST_INFORMATION * total:
            for n in range(starts[k], starts[k + 1]):
                levels[places[n]] = np.nan
