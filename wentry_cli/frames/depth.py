"""How many bits of a 16-bit container carry grey levels: cameras of 12 or 14 bits write 16-bit files."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.reader import Frame

CONTAINER = 16
CAMERA_DEPTHS = (12, 14)
EMPTY_LOW_BITS = (2, 4, 6, 8)


def sampled_depth(read: Callable[[int], Frame], count: int) -> tuple[int, int, str]:
    """Return (significant bits, bits to shift down, a note) from the first, the middle and the last of 16-bit frames.

    Levels that leave the lowest bits empty were shifted up by the camera's software; levels that never reach the upper
    bits were stored as they are. The full scale decides where a pixel counts as saturated.
    """
    used = largest = 0
    for index in sorted({0, count // 2, count - 1}):
        try:
            levels = read(index)
        except FrameUnreadableError:
            continue
        used |= int(np.bitwise_or.reduce(levels, axis=None))
        largest = max(largest, int(levels.max()))
    empty = (used & -used).bit_length() - 1 if used else 0
    if empty in EMPTY_LOW_BITS:
        depth = CONTAINER - empty
        return depth, empty, f"16-bit files of {depth}-bit levels in the upper bits, shifted down"
    depth = next((bits for bits in CAMERA_DEPTHS if 0 < largest < 1 << bits), CONTAINER)
    note = f"16-bit files; the largest of the levels looked at is {largest}, so {depth} bits are taken for full scale"
    return depth, 0, note
