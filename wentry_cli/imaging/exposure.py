"""How bright a frame is and how much of it is clipped, in one pass over its grey levels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled


@compiled
def sum_and_clipped(levels: NDArray[Any], full_scale: int) -> tuple[int, int]:
    """Sum of the unsigned grey levels (rows, columns) and how many of them are at ``full_scale`` or above."""
    total, clipped, limit = np.uint64(0), np.uint64(0), np.uint32(full_scale)
    for row in range(levels.shape[0]):
        line = levels[row, :]
        row_total, row_clipped = np.uint32(0), np.uint32(0)  # rows are shorter than 65 536 pixels of 16 bit
        for column in range(line.size):
            level = np.uint32(line[column])
            # a sum of two uint32 would else go on in 64 bits
            row_total = np.uint32(row_total + level)
            row_clipped = np.uint32(row_clipped + (np.uint32(1) if level >= limit else np.uint32(0)))
        total += np.uint64(row_total)
        clipped += np.uint64(row_clipped)
    return int(total), int(clipped)
