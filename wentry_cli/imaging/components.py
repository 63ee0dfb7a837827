"""Connected dark parts of a patch as runs of pixels: a mostly bright patch has few, so all that follows is cheap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Ints = NDArray[np.int32]


@dataclass(frozen=True)
class DarkParts:
    """Runs of dark pixels, row by row from left to right, and the boxes of the components that they make up.

    ``row``, ``first``, ``last`` (both included) and ``label`` have an entry per run; ``boxes`` has a row per component:
    left, top, right, bottom (included) and area. Components are numbered from 0 by their first run.
    """

    row: Ints
    first: Ints
    last: Ints
    label: Ints
    boxes: Ints
    shape: tuple[int, int]

    def spans(self, keep: NDArray[np.bool_]) -> tuple[Ints, Ints]:
        """First and last column per row of the components for which ``keep`` is true, -1 where they have none."""
        first, last = np.full(self.shape[0], -1, np.int32), np.full(self.shape[0], -1, np.int32)
        span_rows((self.row, self.first, self.last, self.label), keep, first, last)
        return first, last


def find_dark_parts(values: NDArray[np.float32], level: float, *, diagonal: bool = True) -> DarkParts:
    """Find the connected parts of ``values`` (rows, columns) that are below ``level``; NaN is not dark.

    ``diagonal`` tells whether pixels that touch at a corner belong together (8-connected) or not (4-connected).
    """
    # as many runs as there can be: memory that is never written to is never taken
    most = values.shape[0] * ((values.shape[1] + 1) // 2)
    runs = np.empty((3, most), np.int32)
    parent = np.empty(most, np.int32)
    count = _find_runs(values, np.float32(level), 1 if diagonal else 0, runs, parent)
    row, first, last = runs[:, :count].copy()
    label = np.empty(count, np.int32)
    boxes = np.empty((count, 5), np.int32)
    parts = collect_parts(row, first, last, parent[:count], label, boxes)
    return DarkParts(row, first, last, label, boxes[:parts].copy(), (values.shape[0], values.shape[1]))


@compiled
def _root(parent: Ints, run: int) -> int:
    while parent[run] != run:
        parent[run] = parent[parent[run]]
        run = parent[run]
    return run


@compiled
def _run_end(flags: NDArray[np.uint8], words: NDArray[np.uint64], column: int, flag: int) -> int:
    """First column from ``column`` on whose flag is another; ``words`` are the same flags, eight at a time."""
    same = np.uint64(0x0101010101010101) if flag else np.uint64(0)
    while column < flags.size and flags[column] == flag:
        column += 8 if column % 8 == 0 and words[column // 8] == same else 1
    return min(column, flags.size)


@compiled
def _find_runs(values: NDArray[np.float32], level: np.float32, touch: int, runs: Ints, parent: Ints) -> int:
    """Fill ``runs`` (row, first, last) and join every run to those that it touches in the row above; their number."""
    rows, columns = values.shape
    padded = row_flags(columns)
    flags = padded[:columns]
    begin, count = 0, 0
    for row in range(rows):
        line = values[row, :]
        for column in range(columns):
            flags[column] = line[column] < level
        begin, count = count, join_row(padded, columns, row, (begin, count), touch, runs, parent)
    return count


@compiled
def row_flags(columns: int) -> NDArray[np.uint8]:
    """Room for a flag per column, none of them set, and for at least one more, so that they are read by eights."""
    return np.zeros(8 * (columns // 8 + 1), np.uint8)


@compiled
def join_row(
    padded: NDArray[np.uint8], columns: int, row: int, above: tuple[int, int], touch: int, runs: Ints, parent: Ints
) -> int:
    """Append the runs of set flags of ``row`` to ``runs``, joined to those of the row above; how many there are then.

    ``padded`` is a row of ``row_flags``, ``above`` the first run of the row above and how many runs there are so far.
    """
    words, flags = padded.view(np.uint64), padded[:columns]
    other_begin, other_end = above  # the runs of the row above that may touch the next run
    count = other_end
    first = _run_end(flags, words, 0, 0)
    while first < columns:
        stop = _run_end(flags, words, first, 1)
        runs[0, count], runs[1, count], runs[2, count] = row, first, stop - 1
        parent[count] = count
        while other_begin < other_end and runs[2, other_begin] + touch < first:
            other_begin += 1
        other = other_begin
        while other < other_end and runs[1, other] < stop + touch:
            a, b = _root(parent, other), _root(parent, count)
            parent[max(a, b)] = min(a, b)
            other += 1
        count += 1
        first = _run_end(flags, words, stop, 0)
    return count


@compiled
def collect_parts(row: Ints, first: Ints, last: Ints, parent: Ints, label: Ints, boxes: Ints) -> int:
    """Fill the ``label`` of every run and the ``boxes`` of the components (as in ``DarkParts``); how many they are."""
    parts = 0
    for run in range(row.size):
        root = _root(parent, run)
        if root == run:
            label[run] = parts
            boxes[parts, 0], boxes[parts, 1], boxes[parts, 2], boxes[parts, 3] = first[run], row[run], last[run], 0
            boxes[parts, 4] = 0
            parts += 1
        here = label[root]
        label[run] = here
        boxes[here, 0] = min(boxes[here, 0], first[run])
        boxes[here, 2] = max(boxes[here, 2], last[run])
        boxes[here, 3] = row[run]
        boxes[here, 4] += last[run] - first[run] + 1
    return parts


@compiled
def span_rows(runs: tuple[Ints, Ints, Ints, Ints], keep: NDArray[np.bool_], left: Ints, right: Ints) -> None:
    """Fill the first and last column per row of the components to ``keep``; ``runs`` are row, first, last and label."""
    for run in range(runs[0].size):
        if keep[runs[3][run]]:
            row = runs[0][run]
            if left[row] < 0:
                left[row] = runs[1][run]
            right[row] = runs[2][run]
