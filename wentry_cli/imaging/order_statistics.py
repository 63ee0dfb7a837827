"""Quantiles of short lists inside of compiled loops (numpy's own cost seconds of compilation at every use)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]


@compiled
def select(values: Floats, count: int, rank: int) -> float:
    """The value of ``rank`` (0: least) among the first ``count`` entries, which keep their order (quickselect)."""
    part = np.empty(count)
    for n in range(count):
        part[n] = values[n]
    low, high = 0, count - 1
    while low < high:
        pivot = part[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while part[i] < pivot:
                i += 1
            while part[j] > pivot:
                j -= 1
            if i <= j:
                part[i], part[j] = part[j], part[i]
                i += 1
                j -= 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return float(part[rank])


@compiled
def quantile_of(values: Floats, count: int, share: float) -> float:
    """The value below which ``share`` of the first ``count`` entries lie (no interpolation); NaN where none."""
    if count == 0:
        return math.nan
    return select(values, count, min(count - 1, int(share * count)))


@compiled
def median_of(values: Floats, count: int) -> float:
    """Median of the first ``count`` entries; NaN where there are none."""
    if count == 0:
        return math.nan
    upper = select(values, count, count // 2)
    return upper if count % 2 else 0.5 * (upper + select(values, count, count // 2 - 1))
