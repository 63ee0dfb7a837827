"""The text of a table: nine significant digits of a number, as ``%.9g`` gives them, and words, in compiled code.

A double times a power of ten that is one itself errs by half of its last bit. Where that leaves open which way a number
is rounded, and for very small and very large ones, the caller is asked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

DIGITS, FIRST, BEHIND = 9, 10**8, 10**9  # the numbers of nine digits
EXACT_POWERS = np.array([10.0**k for k in range(23)])  # greater ones are no doubles
LEAST, GREATEST = 1e-12, 1e20
TEN = np.uint32(10)
UNSURE = 1e-6  # of the last digit: ten times what scaling errs by
FIXED = -4  # exponent below which %g changes to powers of ten
CELL = 24  # bytes that the text of a number takes at most, with the comma behind it
ZERO, MINUS, POINT, COMMA, LINE_END = (ord(sign) for sign in "0-.,\n")

Bytes = NDArray[np.uint8]


def text_of(values: NDArray[np.float64], words: Mapping[int, Sequence[bytes]] | None = None) -> bytes:
    """The rows of ``values`` (rows, columns) as lines of cells with commas between them; NaN is an empty cell.

    ``words`` holds the different words of columns of text, in whose cells stands which of them it is.
    """
    words = words or {}
    columns, cells = values.shape[1], np.ascontiguousarray(values).ravel()
    first, known = np.full(columns, -1, np.intp), [word for column in words.values() for word in column]
    first[list(words)] = np.cumsum([0, *map(len, words.values())])[:-1]
    ends = np.cumsum([0, *map(len, known)], dtype=np.intp)
    longest = sum(max(map(len, column), default=0) for column in words.values())
    out = np.empty(len(values) * (columns * CELL + longest), np.uint8)
    told = (first, ends, np.frombuffer(b"".join(known) or b" ", np.uint8))
    cell, end = 0, 0
    while cell < cells.size:
        cell, end = _write_cells(cells, told, cell, end, out)
        if cell < cells.size:
            text = b"%.9g" % cells[cell] + (b"\n" if (cell + 1) % columns == 0 else b",")
            out[end : end + len(text)] = np.frombuffer(text, np.uint8)
            cell, end = cell + 1, end + len(text)
    return out[:end].tobytes()


@compiled
def _write_cells(
    cells: NDArray[np.float64],
    words: tuple[NDArray[np.intp], NDArray[np.intp], Bytes],
    cell: int,
    end: int,
    out: Bytes,
) -> tuple[int, int]:
    """Write cells from ``cell`` on to ``out`` (from ``end``) until one is unsure; that cell and the end of the text.

    ``words`` are the first word of each column, -1 where it has numbers, where each word begins, and their letters.
    """
    first, begins, letters = words
    bits = cells.view(np.int64)
    column = cell % first.size
    while cell < cells.size:
        value = cells[cell]
        if not math.isnan(value):
            if first[column] >= 0:
                word = first[column] + int(value)
                for place in range(begins[word], begins[word + 1]):
                    out[end] = letters[place]
                    end += 1
            else:
                written = _write_number(value, bits[cell], end, out)
                if written < 0:
                    break
                end = written
        cell += 1
        column += 1
        out[end] = COMMA if column < first.size else LINE_END
        column = column if column < first.size else 0
        end += 1
    return cell, end


@compiled
def _write_number(value: float, bits: int, end: int, out: Bytes) -> int:
    """Write one number, stored as ``bits``, to ``out`` from ``end`` on; where it ends, or -1 where it is unsure."""
    if math.copysign(1.0, value) < 0.0:
        out[end] = MINUS
        end += 1
    size = abs(value)
    if size == 0.0:
        out[end] = ZERO
        return end + 1
    if not LEAST <= size < GREATEST:
        return -1
    if size < BEHIND and size == math.floor(size):
        return _write_whole(np.uint32(size), end, out)
    exponent = (((bits >> 52) & 2047) - 1023) * 1233 >> 12  # of ten by that of two: the right one, or one too small
    scaled = _scaled(size, exponent)
    if scaled < FIRST or scaled >= BEHIND:
        exponent += 1 if scaled >= BEHIND else -1
        scaled = _scaled(size, exponent)
    whole = math.floor(scaled)
    if abs(scaled - whole - 0.5) < UNSURE:
        return -1
    digits = np.uint32(whole) + np.uint32(1 if scaled - whole > 0.5 else 0)
    if digits >= BEHIND:
        digits //= TEN
        exponent += 1
    return _write_digits(np.uint32(digits), exponent, end, out)


@compiled
def _write_whole(number: np.uint32, end: int, out: Bytes) -> int:
    """Write a whole number of at most nine digits."""
    count, rest = 1, number // TEN
    while rest > 0:
        rest //= TEN
        count += 1
    for place in range(count - 1, -1, -1):
        out[end + place] = ZERO + number % TEN
        number //= TEN
    return end + count


@compiled
def _scaled(size: float, exponent: int) -> float:
    """``size`` with nine digits before the point, the power of ten of the first being ``exponent``."""
    power = DIGITS - 1 - exponent
    return float(size * EXACT_POWERS[power] if power >= 0 else size / EXACT_POWERS[-power])


@compiled
def _write_digits(digits: np.uint32, exponent: int, end: int, out: Bytes) -> int:
    """Write nine ``digits`` without the zeros behind them, the point after the first one or where ``%g`` sets it."""
    count = DIGITS
    while digits % TEN == 0:
        digits //= TEN
        count -= 1
    power = exponent < FIXED or exponent >= DIGITS
    before = 1 if power else exponent + 1  # digits before the point
    if before <= 0:
        for place in range(2 - before):
            out[end + place] = POINT if place == 1 else ZERO
        end += 2 - before
    point = 1 if 0 < before < count else 0
    for place in range(count - 1, -1, -1):
        out[end + place + (point if place >= before else 0)] = ZERO + digits % TEN
        digits //= TEN
    if point:
        out[end + before] = POINT
    end += count + point
    for _ in range(before - count):
        out[end] = ZERO
        end += 1
    if power:
        out[end], out[end + 1] = ord("e"), MINUS if exponent < 0 else ord("+")
        out[end + 2], out[end + 3] = ZERO + abs(exponent) // 10, ZERO + abs(exponent) % 10
        end += 4
    return end
