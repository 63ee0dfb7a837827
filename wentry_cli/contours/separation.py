"""The separation line: where the outline of the silhouette leaves the sphere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.corner import NO_CORNER, SEEN, TOO_SHORT, Corner, find_corner
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.flank import Flank, both_flanks, see
from wentry_cli.imaging.outer_edge import AT
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

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
    line, unc, left, right, how = separation_line(values, fit.shape.vector(patch.x0, patch.y0, departure), blur)
    if how != SEEN:
        return unseen("short_arc" if how == TOO_SHORT else "no_edge")
    return SeparationFit(line + patch.y0, unc, left + patch.y0, right + patch.y0, "ok")


def unseen(status: str) -> SeparationFit:
    """No separation line, and the word that says why."""
    return SeparationFit(math.nan, math.nan, math.nan, math.nan, status)


@compiled
def goes_on(flank: Flank, row: float) -> bool:
    """Whether this side is still the sphere above ``row``: then a corner there on the other side is that of a drop."""
    path, found = flank.path, flank.found
    first, stop = 0, 0
    for n in range(path.shape[0]):
        first = n + 1 if row - path[n, 1] <= JUST_ABOVE_PX else first
        stop = n + 1 if row - path[n, 1] < FAR_ABOVE_PX else stop
    see(flank, first, stop, 1)
    on = 0
    for n in range(first, stop):
        on += 1 if abs(found[n, AT]) < ON_SPHERE_PX else 0
    return stop - first >= 3 and on > 0.6 * (stop - first)


@compiled
def both_sides(values: NDArray[np.float32], shape: Floats, blur: float) -> tuple[Corner, Corner]:
    """The corners on the left and on the right."""
    one, other = both_flanks(values, shape)
    left, right = find_corner(one, blur), find_corner(other, blur)
    nothing = (math.nan, math.nan, NO_CORNER)
    return nothing if goes_on(other, left[0]) else left, nothing if goes_on(one, right[0]) else right


@compiled
def separation_line(values: NDArray[np.float32], shape: Floats, blur: float) -> tuple[float, float, float, float, int]:
    """Row of the line, its uncertainty, the rows of both sides (px in ``values``), and how it was seen."""
    nan = math.nan
    left, right = both_sides(values, shape, blur)
    one, other = math.hypot(left[1], LEAST_UNC_PX), math.hypot(right[1], LEAST_UNC_PX)
    if not (one < MOST_UNC_PX or other < MOST_UNC_PX):
        return nan, nan, nan, nan, max(NO_CORNER, left[2], right[2])
    if one < MOST_UNC_PX and other < MOST_UNC_PX:
        apart = abs(left[0] - right[0])
        if apart > MOST_DISAGREEMENT_PX:
            return nan, nan, nan, nan, NO_CORNER
        weight, share = 1.0 / one**2 + 1.0 / other**2, 1.0 / (1.0 + (one / other) ** 2)
        unc = max(math.sqrt(1.0 / weight), 0.5 * apart)
        return share * left[0] + (1.0 - share) * right[0], unc, left[0], right[0], SEEN
    alone, unc = (left[0], one) if one < MOST_UNC_PX else (right[0], other)
    unc = math.hypot(TRUST_SIDES * unc, shape[2] * shape[3] * math.sin(shape[4]))
    if unc > MOST_UNC_PX:
        return nan, nan, nan, nan, NO_CORNER
    return alone, unc, left[0], right[0], SEEN
