"""Extrema and unit crossings of the oscillation: found in each step, and written where they are more than rounding.

Near rest the error of the integration makes turns and moves λ over 1 and back. A turn counts where λ̈ is more than that
error; where one of a pair that nearly merges falls to it, the more extreme of its neighbours of one kind stays.
A crossing counts once λ stands clear of 1 on the other side. So what is written alternates, peak and valley, upward
and downward, whatever the size of the swing.
"""

from __future__ import annotations

from wentry_cli.compiled import compiled
from wentry_cli.mechanics.bergstrom_boyce import FloatArray, IntArray
from wentry_cli.mechanics.dense_output import find_passage, interpolate
from wentry_cli.mechanics.stages import MARKS, NEW, STATE

PEAK, VALLEY, UPWARD, DOWNWARD = 1, 2, 3, 4
EVENT_COLUMNS = 5  # time, kind, stretch, rate, x
FOUND, PEAKS, WRITTEN, ACCEPTED, REJECTED, SIDE, WAITING = 0, 1, 2, 3, 4, 5, 6  # places in ``counts``
COUNTS = 7

Event = tuple[float, float, float, float, float]


@compiled
def mark_events(work: FloatArray, accuracy: float) -> int:
    """Find the extremum and the unit crossings of a step, in their order.

    Writes (fraction, kind) into the rows from ``MARKS`` on and returns their number. A step holds at most one extremum,
    so λ is monotone on both sides of it. ``accuracy`` is of the fraction.
    """
    before, after = work[STATE, 1], work[NEW, 1]
    turn, turn_kind, count = 2.0, PEAK, 0
    if before > 0.0 >= after:
        turn = find_passage(work, 1, 0.0, 0.0, 1.0, accuracy)
    elif before < 0.0 <= after:
        turn, turn_kind = find_passage(work, 1, 0.0, 0.0, 1.0, accuracy), VALLEY
    low, start = 0.0, work[STATE, 0]
    for part in range(2):
        high = min(turn, 1.0) if part == 0 else 1.0
        end = work[NEW, 0] if high == 1.0 else interpolate(work, 0, high)
        if start < 1.0 <= end or start > 1.0 >= end:
            work[MARKS + count, 0] = find_passage(work, 0, 1.0, low, high, accuracy)
            work[MARKS + count, 1] = UPWARD if start < end else DOWNWARD
            count += 1
        if turn > 1.0:
            break
        if part == 0:
            work[MARKS + count, 0], work[MARKS + count, 1] = turn, turn_kind
            count += 1
        low, start = high, end
    return count


@compiled
def note_extremum(found: Event, events: FloatArray, counts: IntArray, negligible: float) -> bool:
    """Write the extremum ``found``, and before it the crossing that waits for it; False if ``events`` is full."""
    settle_crossing(found[2], events, counts, negligible)
    row = counts[FOUND] - 1
    while row >= 0 and events[row, 1] > VALLEY:
        row -= 1
    if row >= 0 and events[row, 1] == found[1]:
        if (found[2] > events[row, 2]) != (found[1] == PEAK):
            return True
        counts[FOUND] -= 1
        counts[PEAKS] -= 1 if found[1] == PEAK else 0
        for k in range(row, counts[FOUND]):
            _move(events, k + 1, k)
    if counts[FOUND] >= events.shape[0] - 1:
        return False
    _write(found, events, counts[FOUND])
    counts[FOUND] += 1
    counts[PEAKS] += 1 if found[1] == PEAK else 0
    return True


@compiled
def note_crossing(found: Event, events: FloatArray, counts: IntArray) -> None:
    """Let the crossing ``found`` wait, in the last row of ``events``, until λ is clear of 1."""
    _write(found, events, events.shape[0] - 1)
    counts[WAITING] = 1


@compiled
def settle_crossing(stretch: float, events: FloatArray, counts: IntArray, negligible: float) -> None:
    """Write the crossing that waits if λ has come clear of 1, to ``stretch``, on the other side than before."""
    side = 1 if stretch > 1.0 else -1
    last = events.shape[0] - 1
    if abs(stretch - 1.0) < negligible or side == counts[SIDE]:
        return
    counts[SIDE] = side
    if counts[WAITING] == 1 and counts[FOUND] < last:
        _move(events, last, counts[FOUND])
        counts[FOUND] += 1
    counts[WAITING] = 0


@compiled
def _write(found: Event, events: FloatArray, row: int) -> None:
    events[row, 0], events[row, 1], events[row, 2], events[row, 3], events[row, 4] = found


@compiled
def _move(events: FloatArray, row: int, to: int) -> None:
    for c in range(EVENT_COLUMNS):
        events[to, c] = events[row, c]
