"""Quantiles of short lists inside of compiled loops (numpy's own cost seconds of compilation at every use)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]
Singles = NDArray[np.floating[Any]]

BINS, FEW, VERY_FEW = 1024, 512, 24


@compiled
def select(values: Singles, count: int, rank: int) -> float:
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
    """Median of the first ``count`` entries, which keep their order; NaN where there are none."""
    if count == 0:
        return math.nan
    if count > VERY_FEW:
        upper = select(values, count, count // 2)
        return upper if count % 2 else 0.5 * (upper + select(values, count, count // 2 - 1))
    part = np.empty(count)
    for n in range(count):
        place, value = n, values[n]
        while place > 0 and part[place - 1] > value:
            part[place] = part[place - 1]
            place -= 1
        part[place] = value
    return float(part[count // 2] if count % 2 else 0.5 * (part[count // 2] + part[count // 2 - 1]))


@compiled
def _bin_of(counts: NDArray[np.int64], rank: int) -> tuple[int, int]:
    """The bin in which the entry of ``rank`` lies, and how many entries lie in the bins before it."""
    before, index = 0, 0
    while before + counts[index] <= rank:
        before += counts[index]
        index += 1
    return index, before


@compiled
def linear_quantile(values: Floats, count: int, share: float) -> float:
    """The quantile of the first ``count`` of many entries, between two of them where it falls there; NaN where none."""
    if count == 0:
        return math.nan
    place = share * (count - 1)
    lower, upper = rank_and_next(values, count, int(place))
    return lower + (place - int(place)) * (upper - lower)


@compiled
def rank_and_next(values: Singles, count: int, rank: int) -> tuple[float, float]:
    """The value of ``rank`` among the first ``count`` of many entries, and the next greater one.

    They are counted in bins first, and again those of one or two bins, until few are left to be put in order.
    """
    part, following = values[:count].copy(), min(rank + 1, count - 1)
    counts = np.empty(BINS, np.int64)
    while count > FEW:
        low, high = part[0], part[0]
        for n in range(count):
            low, high = min(low, part[n]), max(high, part[n])
        scale = (BINS - 1) / (high - low) if high > low else 0.0
        counts[:] = 0
        for n in range(count):
            counts[int((part[n] - low) * scale)] += 1
        first, before = _bin_of(counts, rank)
        last, _ = _bin_of(counts, following)
        kept = 0
        for n in range(count):
            if first <= int((part[n] - low) * scale) <= last:
                part[kept] = part[n]
                kept += 1
        rank, following = rank - before, following - before
        if kept == count:
            break
        count = kept
    return select(part, count, rank), select(part, count, following)
