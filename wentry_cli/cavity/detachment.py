"""When a cavity leaves the surface: its highest point, seen below the band of the surface or continued into it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.normal_equations import solve

Floats = NDArray[np.float64]

BLUR_PX = 1.0  # beside the band of the surface, where its blur is fainter than a wall
LINE_PX = 3.0
FIT_ROWS, FEWEST_ROWS = 8, 5  # below the band, from which the top is continued
LEAST_FALL_PX = 3.0
FEWEST_FRAMES = 4
LONGEST_JUMP_PX, LONGEST_JUMP_RADII = (
    8.0,
    0.2,
)  # between two frames: beyond it another part of the cavity is the highest
NEAR_PX, MOST_FRAMES = 3.0, 12  # about the surface, where the path is straight enough
APEX_UNC, LEAST_APEX_UNC_PX = 0.25, 0.6  # of the rows that the band hides: so well a continued top is known


@dataclass(frozen=True)
class Detachment:
    """When the highest point of the cavity was at the surface for the last time, s; NaN where it never left."""

    t_s: float
    t_unc_s: float


NO_DETACHMENT = Detachment(float("nan"), float("nan"))


def hidden_rows(surface_unc_px: float) -> float:
    """Rows below the middle of the surface that its dark band hides.

    The uncertainty of its row is the thickness of the band over √12, less that of a line (``imaging.free_surface``).
    """
    return 0.5 * math.sqrt(12.0 * surface_unc_px**2 + LINE_PX**2) + BLUR_PX


@compiled
def find_apex(depth_px: Floats, width_px: Floats, hidden_px: float) -> float:
    """Return the depth at which the cavity's top closes, px below the surface; negative while it is open there.

    ``depth_px`` and ``width_px`` (n,) are rows below the surface and the width there. The square of the width (near
    its closure a top is an ellipsoid, a mouth a hyperboloid) follows a parabola over ``FIT_ROWS`` below the band and
    is continued to zero; NaN where that does not close upwards.
    """
    first = 0
    while first < depth_px.size and not (depth_px[first] > hidden_px and width_px[first] > 0.0):
        first += 1
    if first < depth_px.size and depth_px[first] > hidden_px + 1.0:
        first += 1  # a top row in sight is half blur
    rows, squares, count = np.empty(FIT_ROWS), np.empty(FIT_ROWS), 0
    for row in range(first, min(first + FIT_ROWS, depth_px.size)):
        if np.isfinite(width_px[row]):
            rows[count], squares[count] = depth_px[row], width_px[row] ** 2
            count += 1
    for _ in range(2):  # twice without the worst row: between a steep and a less steep wall the smoothing leaves a step
        if count < FEWEST_ROWS:
            return math.nan
        parabola = _parabola(rows[:count], squares[:count], rows[0])
        worst, most = 0, -1.0
        for k in range(count):
            off = abs(_value(parabola, rows[k] - rows[0]) - squares[k])
            if off > most:
                worst, most = k, off
        count -= 1
        for k in range(worst, count):
            rows[k], squares[k] = rows[k + 1], squares[k + 1]
    return float(rows[0] + _greatest_zero(_parabola(rows[:count], squares[:count], rows[0]), 0.5))


@compiled
def _parabola(rows: Floats, values: Floats, origin: float) -> Floats:
    """Coefficients of the least-squares parabola in ``rows - origin``, constant first; NaN where there is none."""
    normal, right, powers = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    middle = np.mean(rows)
    for k in range(rows.size):
        powers[0], powers[1], powers[2] = 1.0, rows[k] - middle, (rows[k] - middle) ** 2
        for i in range(3):
            right[i] += powers[i] * values[k]
            for j in range(3):
                normal[i, j] += powers[i] * powers[j]
    if not solve(normal, right):
        return np.full(3, math.nan)
    away = origin - middle
    right[0] += away * (right[1] + away * right[2])
    right[1] += 2.0 * away * right[2]
    return right


@compiled
def _value(parabola: Floats, at: float) -> float:
    return float(parabola[0] + at * (parabola[1] + at * parabola[2]))


@compiled
def _greatest_zero(parabola: Floats, bound: float) -> float:
    """The greatest zero below ``bound``; NaN where there is none."""
    inside = parabola[1] ** 2 - 4.0 * parabola[0] * parabola[2]
    if not inside >= 0.0:
        return math.nan
    half = -0.5 * (parabola[1] + math.copysign(math.sqrt(inside), parabola[1]))
    greatest = math.nan
    for zero in (half / parabola[2], parabola[0] / half):
        if zero < bound and not zero < greatest:
            greatest = zero
    return greatest


def find_detachment(
    time_s: Floats, top_px: Floats, apex_px: Floats, *, hidden_px: float, radius_px: float
) -> Detachment:
    """Find when the cavity left the surface.

    Parameters
    ----------
    time_s, top_px, apex_px : (n,) arrays
        Time, depth of the highest row of the cavity and depth of its apex (``find_apex``) below the surface in every
        frame, NaN where it was not seen.
    hidden_px, radius_px : float
        Rows that the band of the surface hides, radius of the undeformed sphere.

    Notes
    -----
    A cavity whose parts between it and the surface were lost has not left it: the path of the highest row must begin
    at the surface, be continuous and lead away for good. When it began is where the apex crosses the surface.
    """
    seen = np.flatnonzero(np.isfinite(time_s) & np.isfinite(top_px))
    depth = top_px[seen]
    at_surface = np.flatnonzero(depth <= hidden_px)
    if at_surface.size == 0:
        return NO_DETACHMENT
    last = int(at_surface[-1])
    jumps = np.flatnonzero(np.abs(np.diff(depth[last:])) > max(LONGEST_JUMP_PX, LONGEST_JUMP_RADII * radius_px))
    end = last + int(jumps[0]) + 1 if jumps.size else depth.size
    if end - last <= FEWEST_FRAMES or depth[last + 1 : end].max() < hidden_px + LEAST_FALL_PX:
        return NO_DETACHMENT
    time, depth, apex = time_s[seen[:end]], depth[:end], apex_px[seen[:end]]
    found = _crossing(time, apex, max(APEX_UNC * hidden_px, LEAST_APEX_UNC_PX))
    return found or _from_sight(time[last:], depth[last:], hidden_px)


def _crossing(time: Floats, apex: Floats, apex_unc_px: float) -> Detachment | None:
    """Zero of a line through the apex about its last crossing of the surface."""
    open_frames = np.flatnonzero(apex <= 0.0)
    if open_frames.size == 0 or open_frames[-1] == apex.size - 1:
        return None
    crossing = int(open_frames[-1])
    far = np.flatnonzero(np.abs(apex) > NEAR_PX)
    before, after = far[far <= crossing], far[far > crossing]
    first = max(int(before[-1]) + 1 if before.size else 0, crossing - MOST_FRAMES)
    stop = min(int(after[0]) if after.size else apex.size, crossing + MOST_FRAMES)
    known = first + np.flatnonzero(np.isfinite(apex[first:stop]))
    if known.size < 2:
        return None
    rate, level = np.polyfit(time[known] - time[crossing], apex[known], 1)
    if rate <= 0.0:
        return None
    misfit = float(np.std(apex[known] - level - rate * (time[known] - time[crossing])))
    step = float(np.median(np.diff(time)))
    unc = np.hypot(np.hypot(apex_unc_px, misfit) / rate, 0.5 * step)
    return Detachment(float(time[crossing] - level / rate), float(unc))


def _from_sight(time: Floats, depth: Floats, hidden_px: float) -> Detachment:
    """Within the time that the path in sight takes for the rows that the band hides, before its first frame."""
    rate = float(np.polyfit(time, depth, 1)[0])
    if rate <= 0.0:
        return NO_DETACHMENT
    half = 0.5 * hidden_px / rate
    return Detachment(float(time[0] - half), float(half / np.sqrt(3.0) + 0.5 * (time[1] - time[0])))
