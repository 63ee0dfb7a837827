"""One line of a speed-against-error table."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BenchRow:
    """What one method reached on one case.

    ``bias`` and ``rmse`` are of ``quantity`` in ``unit`` against a truth that the method did not see;
    ``ratio_to_bound`` is RMSE over the Cramér–Rao bound (NaN where there is none); ``failures`` is the share of items
    without a result or grossly wrong; ``time_us`` is the median time per item in microseconds. Where a method states
    an uncertainty, ``pull`` is the standard deviation of (estimate − truth)/uncertainty and ``beyond_3`` the share
    beyond 3. ``measured`` is the share of items with a result, ``false_ok`` the share that was called good with an
    error far beyond its uncertainty, ``items`` their number, and ``held`` the share that 95 % intervals hold. Of a
    sequence ``in_view`` is the number of frames with a sphere, ``unmeasurable_ok`` the share called good of those that
    cannot be measured, and ``worst`` the largest |error|/uncertainty. Where a part of every item is hidden, ``limit``
    is the root mean square of the bounds of what is left of each over the bound of one that nothing hides, for who is
    told what is hidden, and ``limit_known`` for who knows what hides it; ``ratio_to_left`` is the root mean square of
    the errors over the former bounds, and ``ratio_to_left_median`` their median over that of a normal distribution.
    """

    chapter: str
    case: str
    method: str
    quantity: str
    unit: str
    bias: float
    rmse: float
    ratio_to_bound: float
    failures: float
    time_us: float
    note: str = ""
    pull: float = math.nan
    beyond_3: float = math.nan
    measured: float = math.nan
    false_ok: float = math.nan
    items: int = 0
    held: float = math.nan
    in_view: int = 0
    unmeasurable_ok: float = math.nan
    worst: float = math.nan
    limit: float = math.nan
    limit_known: float = math.nan
    ratio_to_left: float = math.nan
    ratio_to_left_median: float = math.nan
