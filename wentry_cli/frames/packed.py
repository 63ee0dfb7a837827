"""Grey levels packed without padding, 12 and 10 bits each, most significant bit first, unpacked row by row.

Two pixels of 12 bits share three bytes (Photron MRAW, Phantom P12L), four of 10 bits share five (Phantom P10). A row
may start inside a byte, so a rectangle is unpacked from the pixel index of its first column.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled


@compiled
def unpack_12bit(packed: NDArray[np.uint8], start: int, stride: int, out: NDArray[np.uint16]) -> None:
    """Fill ``out`` (rows, columns) from ``packed``, whose first byte begins an even pixel.

    ``start`` is the index of ``out[0, 0]`` counted in pixels from the first byte, ``stride`` the pixels from one row
    to the next.
    """
    rows, columns = out.shape
    for row in range(rows):
        pixel = start + row * stride
        byte = (pixel // 2) * 3
        odd = pixel % 2
        if odd == 1:
            out[row, 0] = ((np.uint16(packed[byte + 1]) & 15) << 8) | np.uint16(packed[byte + 2])
            byte += 3
        pairs = (columns - odd) // 2
        source = packed[byte : byte + 3 * pairs]  # slices that begin at 0 let the compiler use vector instructions
        target = out[row, odd : odd + 2 * pairs]
        for pair in range(pairs):
            middle = np.uint16(source[3 * pair + 1])
            target[2 * pair] = (np.uint16(source[3 * pair]) << 4) | (middle >> 4)
            target[2 * pair + 1] = ((middle & 15) << 8) | np.uint16(source[3 * pair + 2])
        if odd + 2 * pairs < columns:
            byte += 3 * pairs
            out[row, columns - 1] = (np.uint16(packed[byte]) << 4) | (np.uint16(packed[byte + 1]) >> 4)


@compiled
def _code_10bit(packed: NDArray[np.uint8], pixel: int) -> int:
    byte = (pixel // 4) * 5 + pixel % 4  # the code spans this byte and the next
    pair = (np.uint16(packed[byte]) << 8) | np.uint16(packed[byte + 1])
    return int((pair >> (6 - 2 * (pixel % 4))) & 1023)


@compiled
def unpack_10bit(
    packed: NDArray[np.uint8], start: int, stride: int, levels: NDArray[np.uint16], out: NDArray[np.uint16]
) -> None:
    """Fill ``out`` with ``levels[code]`` of the 10-bit codes in ``packed``; ``start`` and ``stride`` as for 12 bits.

    ``packed`` begins a group of four pixels; ``levels`` has 1024 entries (the camera's linearisation).
    """
    rows, columns = out.shape
    for row in range(rows):
        pixel = start + row * stride
        lead = min((4 - pixel % 4) % 4, columns)
        groups = (columns - lead) // 4
        for column in range(lead):
            out[row, column] = levels[_code_10bit(packed, pixel + column)]
        byte = ((pixel + lead) // 4) * 5
        source = packed[byte : byte + 5 * groups]
        target = out[row, lead : lead + 4 * groups]
        for group in range(groups):
            second, third = np.uint16(source[5 * group + 1]), np.uint16(source[5 * group + 2])
            fourth = np.uint16(source[5 * group + 3])
            target[4 * group] = levels[(np.uint16(source[5 * group]) << 2) | (second >> 6)]
            target[4 * group + 1] = levels[((second & 63) << 4) | (third >> 4)]
            target[4 * group + 2] = levels[((third & 15) << 6) | (fourth >> 2)]
            target[4 * group + 3] = levels[((fourth & 3) << 8) | np.uint16(source[5 * group + 4])]
        for column in range(lead + 4 * groups, columns):
            out[row, column] = levels[_code_10bit(packed, pixel + column)]
