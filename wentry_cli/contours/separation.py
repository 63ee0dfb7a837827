"""The separation line: where the outline of the silhouette leaves the sphere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import DEPARTURE, LENGTH, Y, arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.corner import NO_CORNER, TOO_SHORT, find_corner
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.edges import CANDIDATES, edge_candidates
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

RAY_SPACING_PX = 1.5
SEARCH_PX = 9.0
STEP_PX = 1.0
USUAL_BLUR_PX = 1.2
LEAST_UNC_PX, MOST_UNC_PX, MOST_DISAGREEMENT_PX = 0.1, 1.3, 5.0
# The sharp end of a sphere flatter than this hides the corner.
FLATTEST = 1.5
# One side alone is believed less, and not where the sphere leans.
TRUST_SIDES = 3.0
JUST_ABOVE_PX, FAR_ABOVE_PX, ON_SPHERE_PX = 6.0, 14.0, 0.5


@dataclass(frozen=True)
class SeparationFit:
    """Row of the separation line (full-frame px), both sides and their mean; NaN where it cannot be seen."""

    y_px: float
    y_unc_px: float
    left_y_px: float
    right_y_px: float
    status: str


def find_separation(patch: Patch, fit: SilhouetteFit, *, departure: tuple[float, ...] = ()) -> SeparationFit:
    """Find where the outline leaves the fitted ellipse for good, on both sides.

    The edge is sampled along the normals of the ellipse against arc length, from the bottom up, and where it leaves
    the wall is carried back to the ellipse (see `corner`); the two sides are averaged. Where neither side shows a
    corner (no cavity, a wall that clings to the sphere, a sphere flatter than 1.5), where it is not known to 1.3 px,
    or where the sides disagree, everything is NaN and the status `no_edge`; `short_arc` where too little of the
    sphere is left below. ``departure`` is how the outline is known to differ from the ellipse.
    """
    if fit.status != "ok":
        return unseen(fit.status)
    if fit.stretch > FLATTEST:
        return unseen("no_edge")
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    blur = fit.blur_px if math.isfinite(fit.blur_px) else USUAL_BLUR_PX
    left, right = both_sides(values, fit.shape.vector(patch.x0, patch.y0, departure), blur)
    rows = (left[0] + patch.y0, right[0] + patch.y0)
    unc = (math.hypot(left[1], LEAST_UNC_PX), math.hypot(right[1], LEAST_UNC_PX))
    seen = [side for side in range(2) if unc[side] < MOST_UNC_PX]
    if not seen:
        return unseen("short_arc" if max(left[2], right[2]) == TOO_SHORT else "no_edge")
    weight = sum(1.0 / unc[side] ** 2 for side in seen)
    mean = sum(rows[side] / unc[side] ** 2 for side in seen) / weight
    spread = math.sqrt(1.0 / weight)
    if len(seen) == 2:
        if abs(rows[0] - rows[1]) > MOST_DISAGREEMENT_PX:
            return unseen("no_edge")
        spread = max(spread, 0.5 * abs(rows[0] - rows[1]))
    else:
        leans = fit.shape.semi_across * math.sin(math.radians(fit.tilt_deg))
        spread = math.hypot(TRUST_SIDES * spread, leans)
        if spread > MOST_UNC_PX:
            return unseen("no_edge")
    return SeparationFit(mean, spread, rows[0], rows[1], "ok")


def unseen(status: str) -> SeparationFit:
    """No separation line, and the word that says why."""
    return SeparationFit(math.nan, math.nan, math.nan, math.nan, status)


@compiled
def departures(values: NDArray[np.float32], shape: Floats) -> tuple[Floats, Floats, float]:
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
            if height[k, slot] >= strong and not outer[k] >= at[k, slot] - rays[k, DEPARTURE]:
                outer[k] = at[k, slot] - rays[k, DEPARTURE]
    return rays, outer, strong


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
def goes_on(path: Floats, off: Floats, row: float) -> bool:
    """Whether this side is still the sphere above ``row``: then a corner there on the other side is that of a drop."""
    seen, on = 0, 0
    for n in range(off.size):
        if JUST_ABOVE_PX < row - path[n, 1] < FAR_ABOVE_PX:
            seen += 1
            on += 1 if abs(off[n]) < ON_SPHERE_PX else 0
    return seen >= 3 and on > 0.6 * seen


@compiled
def both_sides(
    values: NDArray[np.float32], shape: Floats, blur: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """The corners on the left and on the right, each as (row, uncertainty, how it was seen)."""
    rays, outer, strong = departures(values, shape)
    bottom = 0
    for k in range(rays.shape[0]):
        if rays[k, Y] > rays[bottom, Y]:
            bottom = k
    one, other = one_side(rays, outer, bottom, 1), one_side(rays, outer, bottom, -1)
    left = find_corner(values, shape, one, (strong, blur))
    right = find_corner(values, shape, other, (strong, blur))
    nothing = (math.nan, math.nan, NO_CORNER)
    return (
        nothing if goes_on(other[1], other[2], left[0]) else left,
        nothing if goes_on(one[1], one[2], right[0]) else right,
    )
