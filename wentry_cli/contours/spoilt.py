"""Pixels that no edge explains: what hides a part of a sector need not cost the whole of it.

A droplet that touches the outline spoils some pixels of a sector and leaves others as they are. Once the outline is
known from the sectors that nothing hides, each pixel can be judged by itself: those that stand out from what an edge
shows are masked together with their neighbours, into which the blur of what hides them reaches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.likelihood import EDGE, INV_S, REST, STEP, WEIGHT

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Standard deviations from which a pixel is spoilt, and how far (px^2) that reaches.
SPOILT_SIGMA, REACH_PX2, REACH_PX = 3.5, 4, 2
# A sector that keeps less of what it tells about its edge is left out: what is left of it proves little.
LEAST_INFORMATION = 0.4


@compiled
def blot(values: NDArray[np.float32], place: int) -> None:
    """Mask the pixel at ``place``, counted line by line, and those near it."""
    row, column = place // values.shape[1], place % values.shape[1]
    for y in range(max(0, row - REACH_PX), min(values.shape[0], row + REACH_PX + 1)):
        for x in range(max(0, column - REACH_PX), min(values.shape[1], column + REACH_PX + 1)):
            if (y - row) ** 2 + (x - column) ** 2 <= REACH_PX2:
                values[y, x] = np.nan


@compiled
def without_spoilt(
    values: NDArray[np.float32],
    room: Floats,
    starts: Ints,
    places: Ints,
    state: Floats,
    variances: tuple[Floats, float],
) -> NDArray[np.float32]:
    """The patch with the spoilt pixels of the band masked.

    ``room`` is what the pixels show beside what they should, ``state`` what their sectors are expected to show (see
    `likelihood`); ``variances`` are those of the sectors' own levels inside and outside, and of where their edge is
    (px^2).
    """
    spread, off = variances
    cleaned = values.copy()
    information = np.empty(places.size)
    for k in range(starts.size - 1):
        for n in range(starts[k], starts[k + 1]):
            by_edge, by_out = room[EDGE, n] * state[k, INV_S], room[STEP, n]
            level = spread[0] * (1.0 - by_out) ** 2 + spread[1] * by_out**2
            information[n] = by_edge**2 * room[WEIGHT, n]
            variance = 1.0 / room[WEIGHT, n] + level + off * by_edge**2
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
