"""Where the outline of the silhouette leaves the sphere on its way up one side, and drops that only look like it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]

# A departure: beyond this and beyond four times the scatter on the sphere, for nearly all of the next rays.
LEAST_DEPARTURE_PX, SUSPICIOUS_PX = 0.35, 0.1
SUSTAINED_PX, SUSTAINED_SHARE = 10.0, 0.8
LARGEST_DROP_PX = 40.0
# The edge of the sphere itself, by which the ellipse is off there: so far below a departure.
BASE_PX, BLURRED_PX, MOST_BASE_PX = 20.0, 3.0, 1.0
# A wall that clings to the sphere before it leaves shows as a drift of its edge below the corner.
CLINGS_PX, CLINGS_SIGMA = 0.08, 3.5


@compiled
def base_below(length: Floats, off: Floats, n: int) -> tuple[float, float, int]:
    """Median and scatter of the edge on the sphere below ray ``n``, px, and how many rays it stands on."""
    kept = np.empty(n)
    number = 0
    for m in range(n - 1, -1, -1):
        below = length[n] - length[m]
        if below > BASE_PX:
            break
        if below >= BLURRED_PX and abs(off[m]) < MOST_BASE_PX:
            kept[number] = off[m]
            number += 1
    if number < 3:
        return 0.0, 0.2, number
    middle = median_of(kept, number)
    for m in range(number):
        kept[m] = abs(kept[m] - middle)
    return middle, max(0.03, 1.4826 * median_of(kept, number)), number


@compiled
def first_departure(length: Floats, off: Floats) -> int:
    """Index of the first ray on which the outline has left the sphere for good; -1 where it never does."""
    count, n = length.size, 0
    while n < count:
        if off[n] < SUSPICIOUS_PX:
            n += 1
            continue
        base, scatter, _ = base_below(length, off, n)
        bound = base + max(LEAST_DEPARTURE_PX, 4.0 * scatter)
        if not (off[n] > bound or math.isnan(off[n])):
            n += 1
            continue
        gone, seen = 0, 0
        for m in range(n, count):
            if length[m] - length[n] > SUSTAINED_PX:
                break
            seen += 1
            gone += 1 if off[m] > bound or math.isnan(off[m]) else 0
        back = comes_back(length, off, n, bound)
        if gone >= SUSTAINED_SHARE * seen and back < 0:
            return n
        n = max(n + 1, back)
    return -1


@compiled
def comes_back(length: Floats, off: Floats, n: int, bound: float) -> int:
    """Where the outline lies on the sphere again after a drop or bubble that begins at ray ``n``; -1: it does not.

    A cavity wall leads out of reach; what lies inside of it is not the outline.
    """
    lost, on = 0, 0
    for m in range(n, length.size):
        if length[m] - length[n] > LARGEST_DROP_PX:
            break
        lost = lost + 1 if math.isnan(off[m]) else 0
        on = on + 1 if abs(off[m]) <= bound else 0
        if lost >= 2:
            break
        if on >= 3:
            return m
    return -1


@compiled
def clings(length: Floats, off: Floats, at: float) -> bool:
    """Whether the outline drifts off the sphere already before the corner at arc length ``at``."""
    near, far = np.zeros(2), np.zeros(3)
    for n in range(length.size):
        below = at - length[n]
        if math.isnan(off[n]) or abs(off[n]) > MOST_BASE_PX:
            continue
        if BLURRED_PX <= below < BLURRED_PX + 4.0:
            near[0] += 1.0
            near[1] += off[n]
        elif BLURRED_PX + 4.0 <= below < BASE_PX:
            far[0] += 1.0
            far[1] += off[n]
            far[2] += off[n] ** 2
    if near[0] < 1.0 or far[0] < 3.0:
        return False
    mean = far[1] / far[0]
    scatter = math.sqrt(max(0.0, far[2] / far[0] - mean * mean) * (1.0 / near[0] + 1.0 / far[0]))
    return bool(near[1] / near[0] - mean > max(CLINGS_PX, CLINGS_SIGMA * scatter))
