"""The separation line: where the outline of the silhouette leaves the sphere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, NX, NY, X, Y, arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.edges import CANDIDATES, edge_candidates
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

RAY_SPACING_PX = 1.5
SEARCH_PX = 9.0
STEP_PX = 0.5
# A departure: beyond this and beyond four times the scatter on the sphere, for nearly all of the next rays.
LEAST_DEPARTURE_PX = 0.5
SUSTAINED_PX = 14.0
SUSTAINED_SHARE = 0.85
WINDOW_BELOW_PX, WINDOW_ABOVE_PX = 30.0, 14.0
LEAST_RAYS_BELOW = 8
TRIAL_PX = 0.2
OUTLIER_PX = 1.5
LEAST_UNC_PX, MOST_UNC_PX = 0.2, 2.0
MOST_DISAGREEMENT_PX = 5.0
# Above the middle of a sphere flatter than this the wall runs along the normals: what looks like a corner is none.
FLATTEST = 1.5
# A wall that leaves steeply is seen by few rays, and the filter rounds the corner.
FEW_RAYS, FEW_UNC_PX = 7, 1.9
TRUST_SIDES = 3.0


@dataclass(frozen=True)
class SeparationFit:
    """Row of the separation line (full-frame px), both sides and their mean; NaN where it cannot be seen."""

    y_px: float
    y_unc_px: float
    left_y_px: float
    right_y_px: float
    status: str


def find_separation(patch: Patch, fit: SilhouetteFit) -> SeparationFit:
    """Find the first sustained departure of the outward edge from the fitted ellipse, on both sides.

    The edge is sampled along the normals of the ellipse against arc length, from the bottom up. A hinge, on the
    ellipse and then on a straight wall, is fitted about the departure; the two sides are averaged. Where neither side
    shows a corner (a contact high above the widest part of a flat sphere, or no cavity), or where they disagree,
    everything is NaN and the status `no_edge`; `short_arc` where too little of the sphere is left below.
    """
    if fit.status != "ok":
        return unseen(fit.status)
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    shape = fit.shape.vector() - np.array([patch.x0, patch.y0, 0.0, 0.0, 0.0])
    left, right = both_sides(values, shape)
    rows = np.array([left[0], right[0]]) + patch.y0
    unc = np.array([left[1], right[1]])
    if fit.stretch > FLATTEST:
        rows[rows < fit.center_y_px] = math.nan
    seen = np.isfinite(rows)
    if not seen.any():
        return unseen("short_arc" if max(left[2], right[2]) == TOO_SHORT else "no_edge")
    weight = 1.0 / unc[seen] ** 2
    mean = float(np.sum(weight * rows[seen]) / np.sum(weight))
    spread = math.sqrt(1.0 / float(np.sum(weight)))
    if seen.all():
        if abs(float(rows[0] - rows[1])) > MOST_DISAGREEMENT_PX:
            return unseen("no_edge")
        spread = max(spread, 0.5 * abs(float(rows[0] - rows[1])))
    else:
        spread *= TRUST_SIDES
    return SeparationFit(mean, spread, float(rows[0]), float(rows[1]), "ok")


def unseen(status: str) -> SeparationFit:
    """No separation line, and the word that says why."""
    return SeparationFit(math.nan, math.nan, math.nan, math.nan, status)


SEEN, NO_CORNER, TOO_SHORT = 0.0, 1.0, 2.0


@compiled
def departures(values: NDArray[np.float32], shape: Floats) -> tuple[Floats, Floats]:
    """Rows of the rays from the right end over the bottom, left, top; and the outermost edge on each (px, NaN)."""
    a, b = semi_axes(shape)
    count, table = quadrant_table(a, b, RAY_SPACING_PX, 0.2)
    rays = arc_geometry(shape, sector_angles(count, table))
    at, height, _ = edge_candidates(values, rays, SEARCH_PX, STEP_PX, 1)
    strongest = height[:, 0].copy()
    strong = 0.4 * median_of(strongest, strongest.size)
    outer = np.full(rays.shape[0], math.nan)
    for k in range(rays.shape[0]):
        for slot in range(CANDIDATES):
            if height[k, slot] >= strong and not outer[k] >= at[k, slot]:
                outer[k] = at[k, slot]
    return rays, outer


@compiled
def one_side(rays: Floats, outer: Floats, first: int, step: int) -> tuple[Floats, Floats, Floats]:
    """Arc length, ray and departure from the bottom (index ``first``) up one side to the top."""
    count = rays.shape[0] // 2
    length, path, off = np.empty(count), np.empty((count, 4)), np.empty(count)
    travelled = 0.0
    for n in range(count):
        k = (first + step * n) % rays.shape[0]
        length[n] = travelled
        for column in range(4):
            path[n, column] = rays[k, column]
        off[n] = outer[k]
        travelled += rays[k, LENGTH]
    return length, path, off


@compiled
def first_departure(length: Floats, off: Floats) -> tuple[int, float]:
    """Index of the first sustained departure (-1: none) and the scatter of the edge on the sphere below it, px."""
    count = length.size
    quarter = count // 4
    scatter = np.empty(count)
    number = 0
    for n in range(quarter):
        if not math.isnan(off[n]):
            scatter[number] = abs(off[n])
            number += 1
    noise = max(0.05, 1.4826 * median_of(scatter, number)) if number > 3 else 0.2
    bound = max(LEAST_DEPARTURE_PX, 4.0 * noise)
    for n in range(count):
        if not (off[n] > bound or math.isnan(off[n])):
            continue
        gone, seen = 0, 0
        for m in range(n, count):
            if length[m] - length[n] > SUSTAINED_PX:
                break
            seen += 1
            gone += 1 if off[m] > bound or math.isnan(off[m]) else 0
        if gone >= SUSTAINED_SHARE * seen:
            return n, noise
    return -1, noise


@compiled
def hinge(path: Floats, off: Floats, start: tuple[float, float], window: tuple[int, int, int]) -> tuple[float, int]:
    """Sum of squares of an outline on the ellipse up to ``start`` and on a straight wall from there, and its rays.

    ``window`` holds the first ray, the first ray on the wall and the end. The wall is the principal direction, seen
    from ``start``, of the edges behind it.
    """
    total = 0.0
    for n in range(window[0], window[1]):
        if not math.isnan(off[n]):
            total += min(off[n] * off[n], OUTLIER_PX**2)
    xx, xy, yy, number = 0.0, 0.0, 0.0, 0
    for n in range(window[1], window[2]):
        if math.isnan(off[n]):
            continue
        x = path[n, X] + off[n] * path[n, NX] - start[0]
        y = path[n, Y] + off[n] * path[n, NY] - start[1]
        xx, xy, yy, number = xx + x * x, xy + x * y, yy + y * y, number + 1
    if number > 0:
        total += 0.5 * (xx + yy - math.sqrt((xx - yy) ** 2 + 4.0 * xy * xy))
    return total, number


@compiled
def search_window(length: Floats, off: Floats, found: int) -> tuple[int, int]:
    """Rays about a departure: some length of the sphere below it, and the wall as far as the rays reach it."""
    low, high = found, found
    while low > 0 and length[found] - length[low - 1] < WINDOW_BELOW_PX:
        low -= 1
    while high < length.size and length[high] - length[found] < WINDOW_ABOVE_PX:
        if not off[high] < 0.93 * SEARCH_PX:
            break
        high += 1
    return low, high


@compiled
def corner(length: Floats, path: Floats, off: Floats) -> tuple[float, float, float]:
    """Row of the corner on one side, its uncertainty (px) and how it was seen.

    The uncertainty is the half-width over which the sum of squares stays within twice the scatter of its minimum
    (neighbouring rays share pixels, hence twice).
    """
    found, noise = first_departure(length, off)
    if found < 0:
        return math.nan, math.nan, NO_CORNER
    if found < LEAST_RAYS_BELOW:
        return math.nan, math.nan, TOO_SHORT
    low, high = search_window(length, off, found)
    trials = np.arange(length[low + 2], length[found], TRIAL_PX)
    totals = np.full(trials.size, math.inf)
    rows = np.empty(trials.size)
    n = low
    for index in range(trials.size):
        while length[n + 1] <= trials[index]:
            n += 1
        share = (trials[index] - length[n]) / (length[n + 1] - length[n])
        column = path[n, X] + share * (path[n + 1, X] - path[n, X])
        rows[index] = path[n, Y] + share * (path[n + 1, Y] - path[n, Y])
        total, number = hinge(path, off, (column, rows[index]), (low, n + 1, high))
        if number >= 3:
            totals[index] = total
    best = 0
    for index in range(trials.size):
        best = index if totals[index] < totals[best] else best
    if trials.size == 0 or not math.isfinite(totals[best]):
        return math.nan, math.nan, NO_CORNER
    scatter2 = max(noise * noise, totals[best] / max(1, high - low - 3))
    least, most, on_wall = rows[best], rows[best], 0
    for index in range(trials.size):
        if totals[index] < totals[best] + 2.0 * scatter2:
            least, most = min(least, rows[index]), max(most, rows[index])
    for n in range(low, high):
        on_wall += 1 if length[n] > trials[best] else 0
    few = FEW_UNC_PX if on_wall < FEW_RAYS else 0.0
    unc = math.hypot(math.hypot(0.5 * (most - least), LEAST_UNC_PX), few)
    if unc > MOST_UNC_PX or best == 0:
        return math.nan, math.nan, NO_CORNER
    return rows[best], unc, SEEN


@compiled
def both_sides(
    values: NDArray[np.float32], shape: Floats
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """The corners on the left and on the right, each as (row, uncertainty, how it was seen)."""
    rays, outer = departures(values, shape)
    bottom = 0
    for k in range(rays.shape[0]):
        if rays[k, Y] > rays[bottom, Y]:
            bottom = k
    length, path, off = one_side(rays, outer, bottom, 1)
    left = corner(length, path, off)
    length, path, off = one_side(rays, outer, bottom, -1)
    return left, corner(length, path, off)
