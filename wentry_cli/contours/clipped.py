"""What is not known of an edge before a ground that the sensor clips: half of a light that nobody measured."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.arc import J, Y, arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

CLIPPED_SHARE = 0.995
LEAST_GROUND = 0.2
# A ground that would be a tenth brighter than the sensor's highest level moves the edge of a blur of 1 px by this.
CLIPPED_PX = 0.2
STEP_PX, STEP_ANGLE = 4.0, math.radians(12.0)


def is_clipped(patch: Patch) -> bool:
    """Whether the ground of ``patch`` lies at the ceiling of the sensor, or was masked for that."""
    if not math.isfinite(patch.ceiling):
        return False
    return float(np.mean(~(patch.values < CLIPPED_SHARE * patch.ceiling))) > LEAST_GROUND


def shift_covariance(shape: Floats, free: NDArray[np.int64], top_y_px: float) -> Floats:
    """Covariance of the free parameters where all of the edge below ``top_y_px`` may lie `CLIPPED_PX` off, alike.

    ``shape`` is the parameter vector in the patch, ``free`` the indices of the free parameters.
    """
    count, table = quadrant_table(*semi_axes(shape), STEP_PX, STEP_ANGLE)
    rows = arc_geometry(shape, sector_angles(count, table))
    seen = rows[rows[:, Y] > top_y_px]
    step = np.linalg.lstsq(seen[:, J + free], np.full(len(seen), CLIPPED_PX), rcond=None)[0]
    return np.asarray(np.outer(step, step))
