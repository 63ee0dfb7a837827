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
RIM_ROWS = (1, 4)  # below the highest row: the rim, without the row that blur makes
LOWEST_RIM_PX = 4


@dataclass(frozen=True)
class Rim:
    """Width of the crown at its rim, px, and its highest row in the full frame; NaN unless ``status`` is ``ok``.

    ``no_edge``: no crown stands over the axis; ``out_of_frame``: it reaches beyond the patch.
    """

    width_px: float
    top_y_px: float
    status: str


def find_rim(patch: Patch, axis_x_px: float) -> Rim:
    """Find the rim of the crown.

    ``patch`` shows what lies above the surface, its last row just above the surface band; the crown is the dark
    component that stands on that row and crosses the axis. Droplets above it are other components.
    """
    level = 1.0 - max(FAINTEST, 5.0 * patch.noise_floor)
    parts = find_dark_parts(patch.values, level, diagonal=False)
    runs = (parts.row, parts.first, parts.last, parts.label)
    width, top = _rim_of_crown(runs, parts.boxes, round(axis_x_px) - patch.x0, parts.shape[0])
    if top < 0:
        return Rim(float("nan"), float("nan"), "no_edge")
    if top == 0:
        return Rim(float("nan"), float("nan"), "out_of_frame")
    return Rim(float(width), float(top + patch.y0), "ok")


@compiled
def _rim_of_crown(runs: tuple[Ints, Ints, Ints, Ints], boxes: Ints, axis: int, rows: int) -> tuple[float, int]:
    """Width of the rim of the largest part that stands on the last rows and crosses ``axis``, and its highest row.

    −1 where there is none.
    """
    row, first, last, label = runs
    standing = np.zeros(boxes.shape[0], np.bool_)
    for run in range(row.size):
        if row[run] >= rows - 3:
            standing[label[run]] = True
    best = -1
    for part in range(boxes.shape[0]):
        left, top, right, bottom, area = boxes[part]
        if not standing[part] or not left <= axis <= right or bottom - top + 1 <= LOWEST_RIM_PX:
            continue
        if best < 0 or area > boxes[best, 4]:
            best = part
    if best < 0:
        return np.nan, -1
    spans, count = np.empty(RIM_ROWS[1] - RIM_ROWS[0]), 0
    for line in range(RIM_ROWS[0], RIM_ROWS[1]):
        left, right = -1, -1
        for run in range(row.size):
            if label[run] == best and row[run] == boxes[best, 1] + line:
                left, right = first[run] if left < 0 else left, last[run]
        if left >= 0:
            spans[count] = right - left + 1
            count += 1
    return median_of(spans, count), boxes[best, 1]
