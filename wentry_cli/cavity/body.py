"""The dark body that cavity and sphere make up in a region: its columns in every row, and where it is interrupted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.region import Region, transmission
from wentry_cli.compiled import compiled
from wentry_cli.imaging.components import collect_parts, join_row, row_flags, span_rows

Ints = NDArray[np.int32]
Spans = tuple[Ints, Ints]
Runs = tuple[Ints, Ints, Ints, Ints]
"""Row, first and last column and component of every run of dark pixels."""

SURFACE_ROWS = 12  # where the surface band may reach, and a cavity that has left it is still followed
WIDEST_FAINT_PX = 12  # a faint row wider than that is blur between two dark things, not a thin neck


@compiled
def find_body(region: Region, level: float, sphere: tuple[int, int, int]) -> tuple[Spans, Runs, NDArray[np.bool_]]:
    """First and last column of the body per row, -1 where it has none; all dark runs; which components are the body.

    What is below ``level`` is dark, NaN is not. The component that holds the sphere and those that reach from the
    surface over the axis are the body. ``sphere`` is the column of its axis, the width that counts and the row of its
    equator.
    """
    rows = region.levels.shape[0]
    runs, parent = _dark_runs(region, np.float32(level))
    row, first, last = runs[0], runs[1], runs[2]
    label, boxes = np.empty(parent.size, np.int32), np.empty((parent.size, 5), np.int32)
    parts = collect_parts(row, first, last, parent, label, boxes)
    found = (row, first, last, label)
    keep = _belongs(found, boxes[:parts], sphere)
    spans = (np.full(rows, -1, np.int32), np.full(rows, -1, np.int32))
    span_rows(found, keep, spans[0], spans[1])
    return spans, found, keep


@compiled
def _dark_runs(region: Region, level: np.float32) -> tuple[Ints, Ints]:
    """Row, first and last column of the dark runs (3, n), and which run each one hangs on, pixels touching at a corner.

    The frame is read once, row by row: what is dark is known before the row has left the processor's cache.
    """
    rows, columns = region.levels.shape
    # as many runs as there can be: memory that is never written to is never taken
    most = rows * ((columns + 1) // 2)
    runs, parent = np.empty((3, most), np.int32), np.empty(most, np.int32)
    padded = row_flags(columns)
    flags = padded[:columns]
    begin, count = 0, 0
    for row in range(rows):
        levels, gain = region.levels[row, :], region.gain[row, region.left : region.left + columns]
        for column in range(columns):
            flags[column] = np.float32(levels[column]) * gain[column] < level
        begin, count = count, join_row(padded, columns, row, (begin, count), 1, runs, parent)
    return runs[:, :count].copy(), parent[:count].copy()


@compiled
def _belongs(runs: Runs, boxes: Ints, sphere: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Tell which parts hold most of the sphere's rows above its equator, or reach from the surface over its axis."""
    axis, reach, equator = sphere
    keep, counts = np.zeros(boxes.shape[0], np.bool_), np.zeros(boxes.shape[0], np.int64)
    for run in range(runs[0].size):
        if equator - 3 <= runs[0][run] <= equator:
            inside = min(runs[2][run], axis + 3 * reach) - max(runs[1][run], axis - 3 * reach) + 1
            counts[runs[3][run]] += max(inside, 0)
    best = 0
    for part in range(boxes.shape[0]):
        best = part if counts[part] > counts[best] else best
        left, top, right, bottom = boxes[part, 0], boxes[part, 1], boxes[part, 2], boxes[part, 3]
        spans_axis = left <= axis <= right and right - left + 1 >= reach
        keep[part] = spans_axis and top <= SURFACE_ROWS and bottom - top + 1 >= 4
    if keep.size and counts[best] > 0:
        keep[best] = True
    return keep


@compiled
def find_closed_rows(
    region: Region, body: tuple[Spans, Runs, NDArray[np.bool_]], rows: int, level: float
) -> NDArray[np.bool_]:
    """Which of the first ``rows`` rows lie between the first and the last of the body but show nothing of it.

    A row shows it that has a pixel of it below ``level``, or only a few faint ones.
    """
    spans, runs, keep = body
    shown = np.zeros(rows, np.bool_)
    for row in range(rows):
        shown[row] = spans[0][row] >= 0 and spans[1][row] - spans[0][row] < WIDEST_FAINT_PX
    for run in range(runs[0].size):
        row = runs[0][run]
        if row >= rows or shown[row] or not keep[runs[3][run]]:
            continue
        for column in range(runs[1][run], runs[2][run] + 1):
            if transmission(region, row, column) < level:
                shown[row] = True
                break
    seen = np.flatnonzero(shown)
    closed = np.zeros(rows, np.bool_)
    if seen.size:
        for row in range(seen[0], seen[-1]):
            closed[row] = not shown[row]
    return closed
