"""Ground that no frame shows before the sphere has passed: what is bright there later may be the core of a cavity."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.clean_mean import BLOCK_PX
from wentry_cli.imaging.ground import block_means, fill_holes

COVERED = 0.05  # of the bright ground: what is darker than the level by that in the first frame shows something else
CORE, FADING = 0.95, 0.98  # of the ground around: a patch that is darker somewhere, and how far it reaches
EDGE_BLOCKS, ACROSS = 2, 0.7
SOME = 3  # every third block each way tells how bright the ground is


def false_ground(level: NDArray[np.float32], begun: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Where a level (rows, columns) of the empty scene is that of the bright core of a cavity.

    ``begun`` are the ``block_means`` of the first frame. Light that has passed through the cavity is bright, but not as
    bright as the ground. Where sphere or mirror image cover a place in all frames before the cavity is there, it is the
    brightest that is ever seen. Such a place is dark in the first frame, which no ground is that something else covers
    later, and its level lies below that of the ground around it; what stands in the picture from the beginning, a bar,
    a stain, is dark in the first frame too, and as dark in the level. The dark band of the surface,
    which may end within a block, goes right across the picture.
    """
    rows, columns = level.shape
    known = block_means(level)
    some, then = known[::SOME, ::SOME], begun[::SOME, ::SOME]
    if not np.isfinite(some).any():
        return np.zeros(level.shape, bool)
    ground, light = float(np.nanpercentile(some, 80)), float(np.nanmedian(then / some))
    covered = begun < light * known - COVERED * ground
    covered[np.mean(covered, axis=1) > ACROSS] = False
    if not covered.any() or covered.all():
        return np.zeros(level.shape, bool)
    even = known / _usual_of_rows(known, ~covered, ground)[:, None]
    around = fill_holes(np.where(covered, np.float32(np.nan), even), bent=False)
    fading = covered & (even < FADING * around)
    _, label = cv2.connectedComponents(fading.astype(np.uint8))
    cores = np.unique(label[fading & (even < CORE * around)])
    if not cores.any():
        return np.zeros(level.shape, bool)
    wide = cv2.dilate(np.isin(label, cores[cores > 0]).astype(np.uint8), np.ones((2 * EDGE_BLOCKS + 1,) * 2, np.uint8))
    return np.repeat(np.repeat((wide > 0) & covered, BLOCK_PX, 0), BLOCK_PX, 1)[:rows, :columns]


def _usual_of_rows(known: NDArray[np.float32], plain: NDArray[np.bool_], ground: float) -> NDArray[np.float32]:
    """Median level of each row where it is ``plain`` and known, that of the ``ground`` where nothing of it is."""
    seen = plain & np.isfinite(known)
    ordered = np.sort(np.where(seen, known, np.float32(np.inf)), axis=1)
    rows, number = np.arange(len(known)), np.count_nonzero(seen, axis=1)
    lower, upper = (ordered[rows, np.maximum(number - more, 0) // 2] for more in (1, 0))
    with np.errstate(invalid="ignore"):
        return np.where(number > 0, 0.5 * (lower + upper), np.float32(ground))
