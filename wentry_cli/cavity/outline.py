"""The outline of a dark component of a region, pixel by pixel: what lies within or without it is not looked at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.region import Region, piece_of, transmission
from wentry_cli.compiled import compiled

Ints = NDArray[np.int32]
Spans = tuple[Ints, Ints]
"""First and last column per row, -1 where there is none."""

# The neighbours of a pixel, clockwise from the one to the right.
DOWN = np.array([0, 1, 1, 1, 0, -1, -1, -1])
ACROSS = np.array([1, 1, 0, -1, -1, -1, 0, 1])
LEFT = 4


@compiled
def no_spans(rows: int) -> Spans:
    """Spans of nothing."""
    return np.full(rows, -1, np.int32), np.full(rows, -1, np.int32)


@compiled
def is_dark(region: Region, dark: np.float32, row: int, column: int) -> bool:
    """Whether a pixel is darker than ``dark``; one that is masked (NaN) is not."""
    return bool(transmission(region, row, column) < dark)


@compiled
def follow_outline(region: Region, dark: np.float32, row: int, column: int, spans: Spans) -> tuple[int, int, int, int]:
    """Fill ``spans`` with the component of the dark pixel (row, column); its box: left, top, right, bottom, included.

    Pixels that touch at a corner belong together, and rows that were not read end it. From the pixel to the left, the
    first border is followed; if it is that of a hole, one goes on from its leftmost pixel. ``spans`` is without any
    before.
    """
    piece = piece_of(region, row)
    while True:
        while column > 0 and is_dark(region, dark, row, column - 1):
            column -= 1
        (left, top, right, bottom), at, outer = _follow_border(region, dark, (row, column), piece, spans)
        if outer:
            return left, top, right, bottom
        spans[0][top : bottom + 1], spans[1][top : bottom + 1] = -1, -1
        row, column = at, left


@compiled
def _follow_border(
    region: Region, dark: np.float32, start: tuple[int, int], piece: tuple[int, int], spans: Spans
) -> tuple[tuple[int, int, int, int], int, bool]:
    """Go clockwise round the border that begins to the left of a dark pixel: box, row of its leftmost pixel, outer?

    Border following after Moore; it ends where the first step would be made again. ``outer`` tells that the component
    lies within its border, not around it; ``start`` is a row and a column, ``piece`` rows (first, behind the last).
    """
    first, last = spans
    row, column = start
    left, top, right, bottom, at = column, row, column, row, row
    begin, first_step, area = LEFT + 1, -1, 0
    while True:
        first[row] = column if first[row] < 0 else min(first[row], column)
        last[row] = max(last[row], column)
        if column < left:
            left, at = column, row
        top, right, bottom = min(top, row), max(right, column), max(bottom, row)
        step = _next_step(region, dark, (row, column), piece, begin)
        if step < 0 or (step == first_step and row == start[0] and column == start[1]):
            return (left, top, right, bottom), at, area >= 0
        if first_step < 0:
            first_step = step
        area += (2 * column + ACROSS[step]) * DOWN[step]
        row, column = row + DOWN[step], column + ACROSS[step]
        begin = (step + 7 - (step & 1)) & 7  # behind the neighbour that was last seen not to be dark


@compiled
def _next_step(region: Region, dark: np.float32, at: tuple[int, int], piece: tuple[int, int], begin: int) -> int:
    """The first dark neighbour within ``piece`` clockwise from ``begin`` on; -1 where there is none."""
    for turn in range(8):
        step = (begin + turn) & 7
        to_row, to_column = at[0] + DOWN[step], at[1] + ACROSS[step]
        if (
            piece[0] <= to_row < piece[1]
            and 0 <= to_column < region.columns
            and is_dark(region, dark, to_row, to_column)
        ):
            return step
    return -1
