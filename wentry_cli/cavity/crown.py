"""The splash crown in the side view: how wide its rim still is, and how high it stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wentry_cli.imaging.components import DarkParts, find_dark_parts
from wentry_cli.imaging.patch import Patch

FAINTEST = 0.2  # of the ground: the film of the crown is translucent
RIM_ROWS = slice(1, 4)  # below the highest row: the rim, without the row that blur makes
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
    best = _standing(parts, round(axis_x_px) - patch.x0)
    if best < 0:
        return Rim(float("nan"), float("nan"), "no_edge")
    top = int(parts.boxes[best, 1])
    if top == 0:
        return Rim(float("nan"), float("nan"), "out_of_frame")
    rim = (parts.label == best) & (parts.row >= top + RIM_ROWS.start) & (parts.row < top + RIM_ROWS.stop)
    rows = parts.row[rim]
    spans = [parts.last[rim][rows == row].max() - parts.first[rim][rows == row].min() + 1 for row in np.unique(rows)]
    return Rim(float(np.median(spans)), float(top + patch.y0), "ok")


def _standing(parts: DarkParts, axis: int) -> int:
    """Number of the largest component that stands on the last rows and crosses the column ``axis``, −1 if none."""
    standing = np.zeros(len(parts.boxes), np.bool_)
    standing[parts.label[parts.row >= parts.shape[0] - 3]] = True
    left, top, right, bottom, area = parts.boxes.T
    crossing = standing & (left <= axis) & (axis <= right) & (bottom - top + 1 > LOWEST_RIM_PX)
    return int(np.argmax(np.where(crossing, area, -1))) if crossing.any() else -1
