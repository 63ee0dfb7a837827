"""A cut-out of a flat-fielded frame, the one thing that the estimators look at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Patch:
    """Transmission of a region of a frame: dark object on a ground of 1.0, NaN where a pixel is masked.

    ``values`` is float32 (rows, columns); ``x0``, ``y0`` are the full-frame column and row of its first pixel.
    ``noise_floor`` is the standard deviation of ``values`` on plain background, 0 if unknown.
    ``ceiling`` is the transmission at which the sensor clips: pixels at or above it are known to be *at least*
    that bright, which is worth more than masking them. Infinite where nothing clips.
    """

    values: NDArray[np.float32]
    x0: int = 0
    y0: int = 0
    noise_floor: float = 0.0
    ceiling: float = float("inf")
