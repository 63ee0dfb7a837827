"""The rim of the splash crown in the side view: how wide it still is."""

from __future__ import annotations

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


def rim_width(patch: Patch, axis_x_px: float) -> float:
    """Return the width of the crown at its rim, px; NaN where no crown stands over the axis.

    ``patch`` shows what lies above the surface, its last row just above the surface band; the crown is the dark
    component that stands on that row and crosses the axis. Droplets above it are other components.
    """
    level = 1.0 - max(FAINTEST, 5.0 * patch.noise_floor)
    parts = find_dark_parts(patch.values, level, diagonal=False)
    runs = (parts.row, parts.first, parts.last, parts.label)
    return _rim_of_crown(runs, parts.boxes, round(axis_x_px) - patch.x0, parts.shape[0])


@compiled
def _rim_of_crown(runs: tuple[Ints, Ints, Ints, Ints], boxes: Ints, axis: int, rows: int) -> float:
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
    spans, count = np.empty(RIM_ROWS[1] - RIM_ROWS[0]), 0
    for line in range(RIM_ROWS[0], RIM_ROWS[1] if best >= 0 else 0):
        left, right = -1, -1
        for run in range(row.size):
            if label[run] == best and row[run] == boxes[best, 1] + line:
                left, right = first[run] if left < 0 else left, last[run]
        if left >= 0:
            spans[count] = right - left + 1
            count += 1
    return median_of(spans, count)
