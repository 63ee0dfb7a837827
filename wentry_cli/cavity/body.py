"""The dark body that cavity and sphere make up in a region: its columns in every row, and where it is interrupted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.outline import Spans, follow_outline, is_dark, no_spans
from wentry_cli.cavity.region import Region, transmission, was_read
from wentry_cli.compiled import compiled

SURFACE_ROWS = 12  # where the surface band may reach, and a cavity that has left it is still followed
WIDEST_FAINT_PX = 12  # a faint row wider than that is blur between two dark things, not a thin neck


@compiled
def find_body(region: Region, level: float, sphere: tuple[int, int, int]) -> Spans:
    """First and last column of the body per row, -1 where it has none.

    What is below ``level`` is dark, NaN is not. The component that holds the sphere and those that reach from the
    surface over the axis are the body. ``sphere`` is the column of its axis, the width that counts and the row of its
    equator. Only pixels along outlines are looked at, and those on the axis that no outline encloses.
    """
    rows, axis, reach = region.levels.shape[0], sphere[0], sphere[1]
    dark = np.float32(level)
    body, part = no_spans(rows), no_spans(rows)
    known = np.zeros(rows, np.bool_)  # enclosed by the outline of a component that has been looked at
    _find_sphere(region, dark, sphere, body, part)
    for row in range(rows):
        known[row] = body[0][row] <= axis <= body[1][row]
    for row in range(rows):
        if known[row] or not was_read(region, row) or not is_dark(region, dark, row, axis):
            continue
        left, top, right, bottom = follow_outline(region, dark, row, axis, part)
        for line in range(top, bottom + 1):
            known[line] |= part[0][line] <= axis <= part[1][line]
        belongs = right - left + 1 >= reach and top <= SURFACE_ROWS and bottom - top + 1 >= 4
        _move(part, (top, bottom), body, belongs)
    return body


@compiled
def _find_sphere(region: Region, dark: np.float32, sphere: tuple[int, int, int], body: Spans, part: Spans) -> None:
    """Make ``body`` the component that holds most of the sphere's rows above its equator; none where nothing is dark.

    ``part`` is room for the spans of one component, empty before and afterwards.
    """
    axis, reach, equator = sphere
    rows = max(equator - 3, 0), equator
    columns = max(axis - 3 * reach, 0), min(axis + 3 * reach, region.columns - 1)
    most = 0
    for row in range(rows[0], rows[1] + 1):
        column = columns[0]
        while column <= columns[1]:
            if body[0][row] <= column <= body[1][row]:
                column = body[1][row]
            elif is_dark(region, dark, row, column):
                _, top, _, bottom = follow_outline(region, dark, row, column, part)
                column = part[1][row]
                count = _count_dark(region, dark, part, rows, columns)
                if count > most:
                    body[0][:], body[1][:] = -1, -1
                _move(part, (top, bottom), body, count > most)
                most = max(most, count)
            column += 1


@compiled
def _count_dark(region: Region, dark: np.float32, part: Spans, rows: tuple[int, int], columns: tuple[int, int]) -> int:
    """How many pixels of a part are dark between these rows and columns, all included."""
    count = 0
    for row in range(rows[0], rows[1] + 1):
        for column in range(max(part[0][row], columns[0]), min(part[1][row], columns[1]) + 1):
            count += 1 if is_dark(region, dark, row, column) else 0
    return count


@compiled
def _move(part: Spans, rows: tuple[int, int], body: Spans, belongs: bool) -> None:
    """Take the spans of ``part`` out of its rows (both included), and add them to the body if it ``belongs`` to it."""
    for row in range(rows[0], rows[1] + 1):
        if belongs and part[1][row] >= 0:
            seen = body[1][row] >= 0
            body[0][row] = min(body[0][row], part[0][row]) if seen else part[0][row]
            body[1][row] = max(body[1][row], part[1][row])
        part[0][row], part[1][row] = -1, -1


@compiled
def longest_gap(body: Spans) -> tuple[int, int]:
    """The rows (first, behind the last) of the longest stretch without any of the body."""
    longest, begin = (0, 0), 0
    for row in range(body[0].size):
        if body[0][row] >= 0:
            begin = row + 1
        elif row + 1 - begin > longest[1] - longest[0]:
            longest = begin, row + 1
    return longest


@compiled
def find_closed_rows(region: Region, body: Spans, rows: int, level: float) -> NDArray[np.bool_]:
    """Which of the first ``rows`` rows lie between the first and the last of the body but show nothing of it.

    A row shows it that has a pixel within it below ``level``, or only a few faint ones.
    """
    closed = np.zeros(rows, np.bool_)
    begin, end = rows, rows
    for row in range(rows):
        first, last = body[0][row], body[1][row]
        shown = first >= 0 and last - first < WIDEST_FAINT_PX
        column = first
        while not shown and 0 <= column <= last:
            shown = transmission(region, row, column) < level
            column += 1
        if shown:
            begin, end = min(begin, row), row
        closed[row] = not shown
    closed[:begin] = False
    closed[end:] = False
    return closed
