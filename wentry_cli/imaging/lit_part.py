"""The part of a picture that has light: a black frame about it, or black rows at its foot, belong to no scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

UNLIT = 0.12  # of the light of the picture: what the brightest tenth of a row or column without light stays below
BLURRED_PX = 3  # over which the picture goes from black to its own level


def lit_part(level: NDArray[Any]) -> tuple[slice, slice]:
    """Rows and columns of a picture that are not black rows or columns at its edge.

    ``level`` is (rows, columns) of grey levels. All of the picture where nothing at its edges is black, or all is.
    """
    bound = UNLIT * float(np.percentile(level[::4, ::4], 90))
    if not bound > 0.0:
        return slice(0, level.shape[0]), slice(0, level.shape[1])
    # black to its full length: a sphere or a bar at the edge leaves light beside it
    return _lit_lines(level[:, ::4], bound), _lit_lines(level[::4].T, bound)


def within_blur(part: slice, length: int) -> slice:
    """The rows or columns of ``lit_part`` without those that the blur of a black edge darkens; ``length`` of all."""
    first = part.start + BLURRED_PX if part.start > 0 else 0
    last = part.stop - BLURRED_PX if part.stop < length else length
    return slice(first, max(first, last))


def _lit_lines(lines: NDArray[Any], bound: float) -> slice:
    """From the first row of ``lines`` with light to the last; all of them where none has any."""
    first, dark = (
        next((count for count, line in enumerate(some) if np.percentile(line, 90) > bound), len(lines))
        for some in (lines, lines[::-1])
    )
    return slice(first, len(lines) - dark) if first < len(lines) else slice(0, len(lines))
