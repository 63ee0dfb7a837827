"""The splash crown in the side view: how wide its rim still is, and how high it stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.components import find_dark_parts
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.patch import Patch

Ints = NDArray[np.int32]

FAINTEST = 0.2  # of the ground: the film of the crown is translucent
RIM_ROWS = (1, 4)  # below the row where the wall ends: the rim, without the row that blur makes
LOWEST_RIM_PX = 4
JETS, LEAP_ROWS = 0.6, 2  # share of a row that jets fill at most; rows over which blur spreads the end of the wall
STEEPEST = 6  # px by which a leaning wall widens from row to row, both sides together


@dataclass(frozen=True)
class Rim:
    """Width of the crown at its rim, px, and the row of the rim in the full frame; NaN unless ``status`` is ``ok``.

    ``no_edge``: no crown stands over the axis; ``out_of_frame``: it reaches beyond the patch. ``highest_y_px`` is the
    highest row of all that stands on the last rows of the patch: what lies above it tells nothing.
    """

    width_px: float
    top_y_px: float
    status: str
    highest_y_px: int


def find_rim(patch: Patch, axis_x_px: float) -> Rim:
    """Find the rim of the crown.

    ``patch`` shows what lies above the surface, its last row just above the surface band; the crown is the dark
    component that stands on that row and crosses the axis. Droplets above it are other components; jets that rise from
    it belong to it, but its rim is where its wall ends.
    """
    level = 1.0 - max(FAINTEST, 5.0 * patch.noise_floor)
    parts = find_dark_parts(patch.values, level, diagonal=False)
    runs = (parts.row, parts.first, parts.last, parts.label)
    width, top, highest = _rim_of_crown(runs, parts.boxes, round(axis_x_px) - patch.x0, parts.shape)
    if top <= 0:
        return Rim(float("nan"), float("nan"), "no_edge" if top < 0 else "out_of_frame", highest + patch.y0)
    return Rim(float(width), float(top + patch.y0), "ok", highest + patch.y0)


@compiled
def _rim_of_crown(
    runs: tuple[Ints, Ints, Ints, Ints], boxes: Ints, axis: int, shape: tuple[int, int]
) -> tuple[float, int, int]:
    """Width and row of the rim of the largest part that stands on the last rows and crosses ``axis``; −1 for none.

    And the highest row of all parts that stand there.
    """
    row, label, rows = runs[0], runs[3], shape[0]
    standing = np.zeros(boxes.shape[0], np.bool_)
    for run in range(row.size):
        if row[run] >= rows - 3:
            standing[label[run]] = True
    best, highest = -1, rows
    for part in range(boxes.shape[0]):
        left, top, right, bottom, area = boxes[part]
        highest = min(highest, top) if standing[part] else highest
        if not standing[part] or not left <= axis <= right or bottom - top + 1 <= LOWEST_RIM_PX:
            continue
        if best < 0 or area > boxes[best, 4]:
            best = part
    if best < 0:
        return np.nan, -1, highest
    across, dark = _rows_of_part(runs, best, shape)
    top = _rim_row(dark, boxes[best, 1])
    spans, count = np.empty(RIM_ROWS[1] - RIM_ROWS[0]), 0
    for line in range(top + RIM_ROWS[0], min(top + RIM_ROWS[1], rows)):
        if across[line] > 0:
            spans[count] = across[line]
            count += 1
    return median_of(spans, count), top, highest


@compiled
def _rows_of_part(runs: tuple[Ints, Ints, Ints, Ints], part: int, shape: tuple[int, int]) -> tuple[Ints, Ints]:
    """How far ``part`` reaches across each row, and how much of the row is dark between: px, (rows,) each.

    Both are 0 from the first row on in which it reaches both sides of the patch, as the surface does.
    """
    row, first, last, label = runs
    left, across, dark = np.zeros(shape[0], np.int32), np.zeros(shape[0], np.int32), np.zeros(shape[0], np.int32)
    for run in range(row.size):
        line = row[run]
        if label[run] == part:
            left[line] = first[run] if dark[line] == 0 else left[line]
            across[line] = last[run] - left[line] + 1
            dark[line] += last[run] - first[run] + 1
    for line in range(shape[0]):
        if across[line] == shape[1]:
            across[line:], dark[line:] = 0, 0
            break
    return across, dark


@compiled
def _rim_row(dark: Ints, top: int) -> int:
    """The row in which the wall of the crown ends: above it jets fill little of a row; ``top`` is its highest row.

    There far more of a row becomes ``dark`` (rows,), and faster than a wall leans. The tips of jets may do that too, so
    of several such places, each some rows long, it is the one where most is gained. What lies beyond the patch
    (``top`` 0) is as its first row.
    """
    rim, most = top, 0
    start, last, base = top, -LEAP_ROWS - 1, 0
    beyond = dark[0] if top == 0 else 0
    for line in range(top, dark.size):
        above = dark[line - LEAP_ROWS] if line - LEAP_ROWS >= top else beyond
        if above >= JETS * dark[line] or dark[line] - above <= STEEPEST * LEAP_ROWS:
            continue
        if line - last > LEAP_ROWS:
            base, start = above, max(line - LEAP_ROWS + 1, top)
            while dark[start] - base <= STEEPEST:
                start += 1
        last = line
        if dark[line] - base > most:
            rim, most = start, dark[line] - base
    return rim
