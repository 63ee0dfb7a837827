"""A rectangle of a raw frame and the flat field behind it: the cavity is large, and no flattened copy is made of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.background import Background, cut_patch
from wentry_cli.imaging.patch import Patch


class Region(NamedTuple):
    """Grey levels (rows, columns) of any type, and what turns them into transmission.

    ``gain`` has the same rows and as many columns as the frame; ``left`` is its column of the first of ``levels``.
    """

    levels: NDArray[Any]
    gain: NDArray[np.float32]
    left: int


def region_of(levels: NDArray[Any], x0: int, y0: int, ground: Background) -> Region:
    """The region of the raw ``levels`` whose first pixel is column ``x0``, row ``y0`` of the frame."""
    if ground.contrast > 0.0:  # a bright sphere: the transmission is no multiple of the level
        return region_of_patch(cut_patch(levels, x0, y0, ground))
    return Region(np.ascontiguousarray(levels), ground.gain[y0 : y0 + levels.shape[0]], x0)


def region_of_patch(patch: Patch) -> Region:
    """The region of what is flat already."""
    return Region(np.ascontiguousarray(patch.values), np.ones(patch.values.shape, np.float32), 0)


@compiled
def transmission(region: Region, row: int, column: int) -> float:
    """The transmission of one pixel in single precision; NaN where it is masked."""
    value: float = np.float32(region.levels[row, column]) * region.gain[row, region.left + column]
    return value
