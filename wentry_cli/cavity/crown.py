"""The rim of the splash crown in the side view: how wide it still is."""

from __future__ import annotations

import numpy as np

from wentry_cli.imaging.components import find_dark_parts
from wentry_cli.imaging.patch import Patch

FAINTEST = 0.2  # of the ground: the film of the crown is translucent
RIM_ROWS = slice(1, 4)  # below the highest row: the rim, without the row that blur makes
LOWEST_RIM_PX = 4


def rim_width(patch: Patch, axis_x_px: float) -> float:
    """Return the width of the crown at its rim, px; NaN where no crown stands over the axis.

    ``patch`` shows what lies above the surface, its last row just above the surface band; the crown is the dark
    component that stands on that row and crosses the axis. Droplets above it are other components.
    """
    level = 1.0 - max(FAINTEST, 5.0 * patch.noise_floor)
    parts = find_dark_parts(patch.values, level, diagonal=False)
    axis = round(axis_x_px) - patch.x0
    standing = np.zeros(len(parts.boxes), np.bool_)
    standing[parts.label[parts.row >= parts.shape[0] - 3]] = True
    left, top, right, bottom, area = parts.boxes.T
    crossing = standing & (left <= axis) & (axis <= right) & (bottom - top + 1 > LOWEST_RIM_PX)
    if not crossing.any():
        return float("nan")
    best = int(np.argmax(np.where(crossing, area, -1)))
    rim = (parts.label == best) & (parts.row >= top[best] + RIM_ROWS.start) & (parts.row < top[best] + RIM_ROWS.stop)
    rows = parts.row[rim]
    spans = [parts.last[rim][rows == row].max() - parts.first[rim][rows == row].min() + 1 for row in np.unique(rows)]
    return float(np.median(spans)) if spans else float("nan")
