"""A rectangle of a raw frame and the flat field behind it: the cavity is large, and no flattened copy is made of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.background import Background, cut_patch
from wentry_cli.imaging.patch import Patch
from wentry_cli.tracking.source import Frames, PackedFrames


class Region(NamedTuple):
    """Grey levels of ``columns`` columns and what turns them into transmission.

    ``levels`` are (rows, columns) of any type, or where ``packed`` the bytes of whole rows, two pixels of 12 bits in
    three. ``first`` and ``left`` are the columns of ``levels`` (in pixels) and of ``gain`` (same rows) with which the
    region begins.
    """

    levels: NDArray[Any]
    gain: NDArray[np.float32]
    first: int
    left: int
    columns: int
    packed: bool


def read_region(frames: Frames, index: int, box: tuple[int, int, int, int], ground: Background) -> Region:
    """The region (x0, y0, x1, y1) of frame ``index``, valid until the next is read; of packed pixels, none is unpacked.

    Raises ``FrameUnreadableError`` for a damaged frame or a gap.
    """
    x0, y0, x1, y1 = box
    if ground.contrast > 0.0:  # a bright sphere: the transmission is no multiple of the level
        return region_of_patch(cut_patch(frames.read(index, box), x0, y0, ground))
    rows = frames.packed_rows(index, (y0, y1)) if isinstance(frames, PackedFrames) else None
    if rows:
        return Region(rows[0], ground.gain[y0:y1], rows[1] + x0, x0, x1 - x0, True)
    return Region(np.ascontiguousarray(frames.read(index, box)), ground.gain[y0:y1], 0, x0, x1 - x0, False)


def region_of_patch(patch: Patch) -> Region:
    """The region of what is flat already."""
    values = np.ascontiguousarray(patch.values)
    return Region(values, np.ones(values.shape, np.float32), 0, 0, values.shape[1], False)


@compiled
def transmission(region: Region, row: int, column: int) -> float:
    """The transmission of one pixel in single precision; NaN where it is masked."""
    gain = region.gain[row, region.left + column]
    if region.packed:
        unpacked: float = np.float32(_unpacked(region.levels, row, region.first + column)) * gain
        return unpacked
    value: float = np.float32(region.levels[row, region.first + column]) * gain
    return value


@compiled
def _unpacked(stored: NDArray[np.uint8], row: int, pixel: int) -> int:
    """The grey level of one pixel of 12 bits, the most significant first, by its number from the begin of the row."""
    byte = (3 * pixel) >> 1
    pair = (np.int64(stored[row, byte]) << 8) | np.int64(stored[row, byte + 1])
    return int((pair >> (4 - 4 * (pixel & 1))) & 4095)
