"""Where the outline of the silhouette leaves the sphere on its way up one flank, and drops that only look like it."""

from __future__ import annotations

import math

import numpy as np

from wentry_cli.compiled import compiled
from wentry_cli.contours.flank import SPACING_PX, Flank, see
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.outer_edge import AT, UNSEEN

# Every fourth ray is looked at until one is off by this; then all, from so many below it on.
COARSE, COARSE_PX, BACK, CHUNK = 4, 0.25, 8, 6
# A departure: beyond this and beyond four times the scatter on the sphere, for nearly all of the next rays.
LEAST_DEPARTURE_PX, SUSPICIOUS_PX = 0.35, 0.2
SUSTAINED_RAYS, SUSTAINED_SHARE = int(10.0 / SPACING_PX), 0.8
LARGEST_DROP_RAYS, DROP_STEP, DROP_CHUNK = int(40.0 / SPACING_PX), 2, 5
# The edge of the sphere itself, by which the ellipse is off there: on rays so far below a departure, clear of blur.
NEAREST_RAY, MIDDLE_RAY, FARTHEST_RAY = math.ceil(3.0 / SPACING_PX), math.ceil(7.0 / SPACING_PX), int(20.0 / SPACING_PX)
MOST_BASE_PX = 1.0
# A wall that clings to the sphere before it leaves shows as a drift of its edge below the corner.
CLINGS_PX, CLINGS_SIGMA = 0.08, 3.5


@compiled
def base_below(flank: Flank, n: int) -> tuple[float, float, int]:
    """Median and scatter of the edge on the sphere below ray ``n``, px, and how many rays it stands on."""
    first, stop = max(0, n - FARTHEST_RAY), n - NEAREST_RAY + 1
    see(flank, first, stop, 1)
    found = flank.found
    kept = np.empty(FARTHEST_RAY)
    number = 0
    for m in range(first, stop):
        if abs(found[m, AT]) < MOST_BASE_PX:
            kept[number] = found[m, AT]
            number += 1
    if number < 3:
        return 0.0, 0.2, number
    middle = median_of(kept, number)
    for m in range(number):
        kept[m] = abs(kept[m] - middle)
    return middle, max(0.03, 1.4826 * median_of(kept, number)), number


@compiled
def first_departure(flank: Flank) -> int:
    """Index of the first ray on which the outline has left the sphere for good; -1 where it never does."""
    found = flank.found
    n, near = 0, 0  # all rays before ``near`` are looked at
    while n < found.shape[0]:
        if n >= near:
            if found[n, AT] == UNSEEN:
                see(flank, n, n + COARSE * CHUNK, COARSE)
            if found[n, AT] < COARSE_PX:
                n += COARSE
                continue
            n, near = max(near, n - BACK), n + COARSE
            see(flank, n - FARTHEST_RAY, near + SUSTAINED_RAYS, 1)
        bound = math.inf
        if not found[n, AT] < SUSPICIOUS_PX:
            base, scatter, _ = base_below(flank, n)
            bound = base + max(LEAST_DEPARTURE_PX, 4.0 * scatter)
        if not (found[n, AT] > bound or math.isnan(found[n, AT])):
            n += 1
            continue
        back = comes_back(flank, n, bound) if stays_off(flank, n, bound) else n + 1
        if back < 0:
            return n
        n = back
    return -1


@compiled
def stays_off(flank: Flank, n: int, bound: float) -> bool:
    """Whether nearly all of the rays from ``n`` on are off the sphere by more than ``bound``."""
    found = flank.found
    stop = min(n + SUSTAINED_RAYS + 1, found.shape[0])
    see(flank, n, stop, 1)
    gone = 0
    for m in range(n, stop):
        gone += 1 if found[m, AT] > bound or math.isnan(found[m, AT]) else 0
    return bool(gone >= SUSTAINED_SHARE * (stop - n))


@compiled
def comes_back(flank: Flank, n: int, bound: float) -> int:
    """Where the outline lies on the sphere again after a drop or bubble that begins at ray ``n``; -1: it does not.

    A cavity wall leads out of reach; what lies inside of it is not the outline.
    """
    found, lost, on = flank.found, 0, 0
    stop = min(n + LARGEST_DROP_RAYS + 1, found.shape[0])
    for m in range(n, stop, DROP_STEP):
        if found[m, AT] == UNSEEN:
            see(flank, m, min(m + DROP_CHUNK * DROP_STEP, stop), DROP_STEP)
        lost = lost + 1 if math.isnan(found[m, AT]) else 0
        on = on + 1 if abs(found[m, AT]) <= bound else 0
        if lost >= 2:
            break
        if on >= 2:
            return m
    return -1


@compiled
def clings(flank: Flank, at: int) -> bool:
    """Whether the outline drifts off the sphere already before the corner at ray ``at``."""
    first, stop = max(0, at - FARTHEST_RAY), at - NEAREST_RAY + 1
    see(flank, first, stop, 1)
    near, drift, number, total, squares = 0, 0.0, 0, 0.0, 0.0
    for n in range(first, stop):
        off = flank.found[n, AT]
        if not abs(off) <= MOST_BASE_PX:
            continue
        if at - n < MIDDLE_RAY:
            near, drift = near + 1, drift + off
        else:
            number, total, squares = number + 1, total + off, squares + off * off
    if near < 1 or number < 3:
        return False
    mean = total / number
    scatter = math.sqrt(max(0.0, squares / number - mean * mean) * (1.0 / near + 1.0 / number))
    return bool(drift / near - mean > max(CLINGS_PX, CLINGS_SIGMA * scatter))
