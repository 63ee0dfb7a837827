"""The rim of the splash crown in the side view: how wide it still is."""

from __future__ import annotations

import cv2
import numpy as np

from wentry_cli.imaging.patch import Patch

FAINTEST = 0.2  # of the ground: the film of the crown is translucent
RIM_ROWS = slice(1, 4)  # below the highest row: the rim, without the row that blur makes
LOWEST_RIM_PX = 4


def rim_width(patch: Patch, axis_x_px: float) -> float:
    """Return the width of the crown at its rim, px; NaN where no crown stands over the axis.

    ``patch`` shows what lies above the surface, its last row just above the surface band; the crown is the dark
    component that stands on that row and crosses the axis. Droplets above it are other components.
    """
    values = patch.values
    dark = (values < 1.0 - max(FAINTEST, 5.0 * patch.noise_floor)).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(dark, connectivity=4, ltype=cv2.CV_32S)
    axis = round(axis_x_px) - patch.x0
    best = 0
    for index in {int(label) for label in labels[-3:].ravel()} - {0}:
        left, _, width, height, area = stats[index]
        crosses = left <= axis < left + width and height > LOWEST_RIM_PX
        if crosses and (best == 0 or area > stats[best][4]):
            best = index
    if best == 0:
        return float("nan")
    top = int(stats[best][1])
    rows = (labels[top:] == best)[RIM_ROWS]
    spans = [np.flatnonzero(row) for row in rows if row.any()]
    return float(np.median([span[-1] - span[0] + 1 for span in spans])) if spans else float("nan")
