"""Quantiles of short lists inside of compiled loops (numpy's own cost seconds of compilation at every use)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]
Singles = NDArray[np.floating[Any]]

# So few are put in order at once; of so few each is counted how many are less; so many are put in order of a sample,
# and so many places apart in it a rank may lie from where it should.
VERY_FEW, COUNTED, FEW, AWAY = 10, 160, 512, 40


@compiled
def select(values: Singles, count: int, rank: int) -> float:
    """The value of ``rank`` (0: least) among the first ``count`` entries, which keep their order."""
    return select_two(values, count, rank)[0]


@compiled
def select_two(values: Singles, count: int, rank: int) -> tuple[float, float]:
    """The value of ``rank`` (0: least) among the first ``count`` entries and the next one, itself where there is none.

    By quickselect, which leaves what is greater behind.
    """
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
    after = part[rank] if rank + 1 == count else part[rank + 1]
    for n in range(rank + 2, count):
        after = min(after, part[n])
    return float(part[rank]), float(after)


@compiled
def counted(values: Floats, count: int, rank: int) -> tuple[float, float]:
    """The values of ``rank`` and of the rank before it (NaN for the first), found without a branch for each pair."""
    part, own, before = values[:count], math.nan, math.nan
    for n in range(count):
        value, less = part[n], 0
        for m in range(part.size):
            less += part[m] < value
        if less == rank:
            own = value
        elif less == rank - 1:
            before = value
        if math.isfinite(own) and (rank == 0 or math.isfinite(before)):
            return own, before
    # some are alike
    before, own = select_two(values, count, max(0, rank - 1))
    return (own if rank > 0 else before), before


@compiled
def quantile_of(values: Floats, count: int, share: float) -> float:
    """The value below which ``share`` of the first ``count`` entries lie (no interpolation); NaN where none."""
    if count == 0:
        return math.nan
    rank = min(count - 1, int(share * count))
    return counted(values, count, rank)[0] if count <= COUNTED else select(values, count, rank)


@compiled
def median_of(values: Floats, count: int) -> float:
    """Median of the first ``count`` entries, which keep their order; NaN where there are none."""
    if count == 0:
        return math.nan
    if VERY_FEW < count <= COUNTED:
        upper, lower = counted(values, count, count // 2)
        return upper if count % 2 else 0.5 * (upper + lower)
    if count > VERY_FEW:
        middle, after = select_two(values, count, (count - 1) // 2)
        return middle if count % 2 else 0.5 * (middle + after)
    part = np.empty(count)
    for n in range(count):
        place, value = n, values[n]
        while place > 0 and part[place - 1] > value:
            part[place] = part[place - 1]
            place -= 1
        part[place] = value
    return float(part[count // 2] if count % 2 else 0.5 * (part[count // 2] + part[count // 2 - 1]))


@compiled
def linear_quantile(values: Singles, count: int, share: float) -> float:
    """The quantile of the first ``count`` of many entries, between two of them where it falls there; NaN where none."""
    if count == 0:
        return math.nan
    place = share * (count - 1)
    lower, upper = rank_and_next(values, count, int(place))
    return lower + (place - int(place)) * (upper - lower)


@compiled
def rank_and_next(values: Singles, count: int, rank: int) -> tuple[float, float]:
    """The value of ``rank`` among the first ``count`` of many entries, and the next greater one.

    A sample of them tells two values between which it nearly always lies (Floyd and Rivest 1975), and only what lies
    between these is looked at again, until few are left to be put in order.
    """
    part, sample = values[:count].copy(), np.empty(FEW, values.dtype)
    left, first = count, rank
    while left > FEW:
        for n in range(FEW):
            sample[n] = part[n * left // FEW]
        place = first * FEW // left
        low = select(sample, FEW, place - AWAY) if place >= AWAY else -math.inf
        high = select(sample, FEW, place + AWAY) if place + AWAY < FEW else math.inf
        before, kept = 0, 0
        for n in range(left):
            value = part[n]
            before += 1 if value < low else 0
            part[kept] = value
            kept += 1 if low <= value <= high else 0
        first = first - before
        if first < 0 or min(first + 1, left - before - 1) >= kept:
            return select_two(values, count, rank)
        if kept == left:
            break
        left = kept
    return select_two(part, left, first)
