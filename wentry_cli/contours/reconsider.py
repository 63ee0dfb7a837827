"""A second opinion where much is hidden: do the sectors that look like edges agree on another ellipse?"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J
from wentry_cli.contours.normal_equations import solve
from wentry_cli.contours.sectors import MOVED, QUALITY, QUALITY_END, VARIANCE
from wentry_cli.imaging.order_statistics import quantile_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TRIALS = 150
AGREE_SIGMA, AGREE_PX = 3.0, 0.02
# Sectors farther off than this say too little about where their edge is.
FARTHEST_PX = 1.2


@compiled
def edge_like(verdict: Floats) -> Ints:
    """Sectors whose pixels look like an edge, whether they agree with the ellipse or not."""
    qualities = np.empty(verdict.shape[0])
    number = 0
    for k in range(verdict.shape[0]):
        if not math.isnan(verdict[k, MOVED]):
            qualities[number] = verdict[k, QUALITY]
            number += 1
    usual = quantile_of(qualities, number, 0.25) / 0.85 if number > 0 else math.nan
    kept = np.empty(verdict.shape[0], dtype=np.int64)
    number = 0
    for k in range(verdict.shape[0]):
        if abs(verdict[k, MOVED]) < FARTHEST_PX and verdict[k, QUALITY] < QUALITY_END * usual:
            kept[number] = k
            number += 1
    return kept[:number]


@compiled
def agreement(verdict: Floats, rows: Floats, sectors: Ints, step: Floats) -> float:
    """How many sectors agree with the ellipse moved by ``step``, those that agree well counting more."""
    total = 0.0
    for index in range(sectors.size):
        k = sectors[index]
        off = verdict[k, MOVED]
        for i in range(5):
            off -= rows[k, J + i] * step[i]
        z2 = off * off / (verdict[k, VARIANCE] + AGREE_PX**2)
        total += max(0.0, 1.0 - z2 / AGREE_SIGMA**2)
    return total


@compiled
def other_ellipse(verdict: Floats, rows: Floats, free: Ints) -> Floats:
    """The step (5) to the ellipse that most edge-like sectors agree on, zero where that is the present one.

    Random minimal sets (RANSAC, fixed seed) over the sectors' own displacements.
    """
    size = free.size
    sectors = edge_like(verdict)
    best = np.zeros(5)
    if sectors.size < size + 3:
        return best
    most = agreement(verdict, rows, sectors, best)
    state = np.uint32(2463534242)
    for _ in range(TRIALS):
        normal, right, step = np.zeros((size, size)), np.zeros(size), np.zeros(5)
        for _ in range(size):
            state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
            k = sectors[int(state >> np.uint32(8)) % sectors.size]
            for i in range(size):
                right[i] += rows[k, J + free[i]] * verdict[k, MOVED]
                for j in range(size):
                    normal[i, j] += rows[k, J + free[i]] * rows[k, J + free[j]]
        if not solve(normal, right):
            continue
        for i in range(size):
            step[free[i]] = right[i]
        total = agreement(verdict, rows, sectors, step)
        if total > most:
            most = total
            best[:] = step
    return best
