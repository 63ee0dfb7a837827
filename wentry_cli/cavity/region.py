"""A rectangle of a raw frame and the flat field behind it: the cavity is large, and no flattened copy is made of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.background import Background, cut_patch
from wentry_cli.imaging.patch import Patch
from wentry_cli.tracking.source import Frames, stored_rows


class Region(NamedTuple):
    """Grey levels of ``columns`` columns and what turns them into transmission.

    ``levels`` are (rows, columns) of any type, or where ``packed`` the bytes of whole rows, two pixels of 12 bits in
    three. ``first`` and ``left`` are the columns of ``levels`` (in pixels) and of ``gain`` (same rows) with which the
    region begins. Rows ``unread`` (first, behind the last; the number of rows twice for none) are not to be looked at.
    """

    levels: NDArray[Any]
    gain: NDArray[np.float32]
    first: int
    left: int
    columns: int
    packed: bool
    unread: tuple[int, int]


def read_region(
    frames: Frames,
    index: int,
    box: tuple[int, int, int, int],
    ground: Background,
    unread: tuple[int, int] | None = None,
) -> Region:
    """The region (x0, y0, x1, y1) of frame ``index``, valid until the next is read; of packed pixels, none is unpacked.

    Rows ``unread`` of the frame (first, behind the last) are left out where that saves time.
    Raises ``FrameUnreadableError`` for a damaged frame or a gap.
    """
    x0, y0, x1, y1 = box
    if ground.contrast > 0.0:  # a bright sphere: the transmission is no multiple of the level
        return region_of_patch(cut_patch(frames.read(index, box), x0, y0, ground))
    gain, nowhere = ground.gain[y0:y1], (y1 - y0, y1 - y0)
    hole = unread or (y1, y1)
    stored = stored_rows(frames, index, (y0, y1), hole)
    if stored:
        levels, first, packed = stored
        return Region(levels, gain, first + x0, x0, x1 - x0, packed, (hole[0] - y0, hole[1] - y0))
    return Region(np.ascontiguousarray(frames.read(index, box)), gain, 0, x0, x1 - x0, False, nowhere)


def region_of_patch(patch: Patch) -> Region:
    """The region of what is flat already."""
    values = np.ascontiguousarray(patch.values)
    rows, columns = values.shape
    return Region(values, np.ones(values.shape, np.float32), 0, 0, columns, False, (rows, rows))


@compiled
def was_read(region: Region, row: int) -> bool:
    """Whether a row may be looked at."""
    return not region.unread[0] <= row < region.unread[1]


@compiled
def piece_of(region: Region, row: int) -> tuple[int, int]:
    """The rows (first, behind the last) that were read about a row."""
    return (0, region.unread[0]) if row < region.unread[0] else (region.unread[1], region.levels.shape[0])


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
def transmission_of_row(region: Region, row: int, first: int, stop: int) -> NDArray[np.float32]:
    """The transmission of the pixels of a row from ``first`` on, before ``stop``; NaN where masked."""
    count, begin = stop - first, region.first + first
    gain = region.gain[row, region.left + first : region.left + stop]
    values = np.empty(count, np.float32)
    if not region.packed:
        levels = region.levels[row, begin : begin + count]
        for column in range(count):
            values[column] = np.float32(levels[column]) * gain[column]
        return values
    odd = begin & 1
    pairs = (count - odd) // 2
    stored = region.levels[row, 3 * ((begin + odd) // 2) :][: 3 * pairs]
    even_gain, even = gain[odd:], values[odd:]  # slices that begin at 0 let the compiler use vector instructions
    for pair in range(pairs):
        high, middle, low = (
            np.uint32(stored[3 * pair]),
            np.uint32(stored[3 * pair + 1]),
            np.uint32(stored[3 * pair + 2]),
        )
        even[2 * pair] = np.float32((high << 4) | (middle >> 4)) * even_gain[2 * pair]
        even[2 * pair + 1] = np.float32(((middle & 15) << 8) | low) * even_gain[2 * pair + 1]
    for column in range(0, odd):
        values[column] = transmission(region, row, first + column)
    for column in range(odd + 2 * pairs, count):
        values[column] = transmission(region, row, first + column)
    return values


@compiled
def _unpacked(stored: NDArray[np.uint8], row: int, pixel: int) -> int:
    """The grey level of one pixel of 12 bits, the most significant first, by its number from the begin of the row."""
    byte = (3 * pixel) >> 1
    pair = (np.int64(stored[row, byte]) << 8) | np.int64(stored[row, byte + 1])
    return int((pair >> (4 - 4 * (pixel & 1))) & 4095)
