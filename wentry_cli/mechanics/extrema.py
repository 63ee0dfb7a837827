"""Which turning points and crossings of λ = 1 count: those that stand out of the error of the integration.

A turning point counts if λ swings away from it by more than the error on both sides, a crossing if λ goes beyond 1 by
more than the error on both sides. What does not count is left out in pairs, so that peaks and valleys alternate and so
do the directions of the crossings, however small the oscillation has become beside a stretch that still creeps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import FloatArray

PEAK, VALLEY, UPWARD, DOWNWARD = 1, 2, 3, 4
KIND, STRETCH = 1, 2  # columns of an event
FOUND, PEAKS = 0, 1  # places in ``counts``

IntArray = NDArray[np.int64]


@compiled
def admit(events: FloatArray, counts: IntArray, start: float, negligible: float) -> None:
    """Judge the candidate in the row behind the ``counts[FOUND]`` events that count, and keep it if it does too.

    ``start`` is λ at the release, ``negligible`` the swing that is rounding. A candidate may show that the event
    before it did not count, which is then taken out.
    """
    row = counts[FOUND]
    turning = events[row, KIND] <= VALLEY
    last = _last(events, row, turning)
    again = last >= 0 and events[last, KIND] == events[row, KIND]
    if turning and again:  # what lay between them was negligible: the further one of the two is the turning point
        further = events[row, STRETCH] - events[last, STRETCH]
        if (further if events[row, KIND] == PEAK else -further) >= negligible:
            _take_out(events, last, row + 1)
    elif turning:
        if abs(events[row, STRETCH] - (events[last, STRETCH] if last >= 0 else start)) >= negligible:
            counts[FOUND] += 1
            counts[PEAKS] += 1 if events[row, KIND] == PEAK else 0
    elif not again:
        if _reach(events, (last + 1, row), start if last < 0 else 1.0) >= negligible:
            counts[FOUND] += 1
        elif last >= 0:
            _take_out(events, last, row)
            counts[FOUND] -= 1


@compiled
def is_left(events: FloatArray, counts: IntArray, stretch: float, negligible: float) -> bool:
    """Whether λ, now ``stretch``, has swung away from the last turning point: before that it is none."""
    last = _last(events, counts[FOUND], True)
    return last < 0 or abs(stretch - events[last, STRETCH]) >= negligible


@compiled
def settle(events: FloatArray, counts: IntArray, stretch: float, negligible: float) -> None:
    """Take out the last turning point and the last crossing where λ, now ``stretch``, has not left them behind."""
    if not is_left(events, counts, stretch, negligible):
        _take_out(events, _last(events, counts[FOUND], True), counts[FOUND])
        counts[FOUND] -= 1
    last = _last(events, counts[FOUND], False)
    if last >= 0 and _reach(events, (last + 1, counts[FOUND]), stretch) < negligible:
        _take_out(events, last, counts[FOUND])
        counts[FOUND] -= 1


@compiled
def _last(events: FloatArray, count: int, turning: bool) -> int:
    """Row of the last turning point, or crossing, among the first ``count`` events; −1 if there is none."""
    for row in range(count - 1, -1, -1):
        if (events[row, KIND] <= VALLEY) == turning:
            return row
    return -1


@compiled
def _reach(events: FloatArray, rows: tuple[int, int], stretch: float) -> float:
    """How far λ goes from 1 at the turning points among the ``rows`` (first, end), and at ``stretch``."""
    reach = abs(stretch - 1.0)
    for row in range(rows[0], rows[1]):
        if events[row, KIND] <= VALLEY:
            reach = max(reach, abs(events[row, STRETCH] - 1.0))
    return float(reach)


@compiled
def _take_out(events: FloatArray, gone: int, count: int) -> None:
    """Move the events behind the row ``gone`` up by one."""
    for row in range(gone, count - 1):
        events[row] = events[row + 1]
