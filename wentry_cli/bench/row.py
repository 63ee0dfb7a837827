"""One line of a speed-against-error table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BenchRow:
    """What one method reached on one case.

    ``bias`` and ``rmse`` are of ``quantity`` in ``unit`` against a truth that the method did not see;
    ``ratio_to_bound`` is RMSE over the Cramér–Rao bound (NaN where there is none); ``failures`` is the share of items
    without a result or grossly wrong; ``time_us`` is the median time per item in microseconds.
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
