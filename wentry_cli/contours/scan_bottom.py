"""Level "fast" of the lowest point: edges along rays over the bottom cap alone, and a smooth curve through them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J, X, Y, arc_rows, farthest, lowest_angle, semi_axes
from wentry_cli.contours.bottom_cap import (
    HALF_ANGLE,
    LEAST_KEPT,
    LEAST_SEEN,
    MOST_SHIFT_PX,
    OCCLUDED,
    OUT_OF_FRAME,
    POOR,
    PRIOR_SHAPE,
    not_found,
    point_told,
)
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.local_bottom import BottomFit, bottom_found, no_bottom
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.contours.outline_fit import SCAN_VARIANCE
from wentry_cli.contours.ray_fit import rest_of, tukey_fit
from wentry_cli.contours.ray_scatter import independent_rays, rays_that_share, swallowed
from wentry_cli.contours.scan import (
    FINE,
    FINE_LINES,
    FINE_PX,
    FINE_SIGMA_PX,
    FINE_STEP_PX,
    LIMITS_PX,
    LINE_VARIANCE,
    SLACK_OF_R,
    correct_edges,
)
from wentry_cli.imaging.edges import edge_candidates
from wentry_cli.imaging.order_statistics import quantile_of
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

# Rays lie so far apart on the cap that their lines lie side by side, px, as far as their number is within the bounds.
SPACING_PX = 3.0
FEWEST_RAYS, MOST_RAYS = 20, 48
# Coefficients of the powers of the place on the cap, 0 to 4, of which the last two are known beforehand.
POWERS, KNOWN = 5, 3


def fit_scan_bottom(patch: Patch, fit: SilhouetteFit, *, motion_px: tuple[float, float] = (0.0, 0.0)) -> BottomFit:
    """Locate the lowest point from edges along rays within 30 degrees of the bottom.

    As `fit_local_bottom`: the angle is the eccentric one of the fitted ellipse, which only says where to look, and the
    outline of the cap is the ellipse plus a free displacement, slope and curvature, and third and fourth order under a
    prior. They are fitted to the matched edges that the level "fast" finds.
    """
    if fit.status != "ok":
        return no_bottom(fit.status)
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    shape = fit.shape.vector(patch.x0, patch.y0)
    return bottom_found(patch, scan_bottom(values, shape, np.array(motion_px, np.float64), float(patch.noise_floor)))


@compiled
def cap_rays(shape: Floats, lowest: float, size: tuple[int, int]) -> tuple[Floats, float]:
    """Rays over the cap that lie in the picture, and the share of all that they are.

    Their Jacobian is that of the powers of their places on the cap, -1 to 1.
    """
    count = min(MOST_RAYS, max(FEWEST_RAYS, int(2.0 * HALF_ANGLE * semi_axes(shape)[0] / SPACING_PX)))
    place = (2.0 * np.arange(count) + 1.0) / count - 1.0
    rows = arc_rows(shape, lowest + HALF_ANGLE * place, np.full(count, 2.0 * HALF_ANGLE / count))
    number = 0
    for k in range(count):
        if 1.0 <= rows[k, X] < size[1] - 2.0 and 1.0 <= rows[k, Y] < size[0] - 2.0:
            rows[number] = rows[k]
            for i in range(POWERS):
                rows[number, J + i] = place[k] ** i
            number += 1
    return rows[:number], number / count


@compiled
def told_by_rays(factor: Floats, stiff: float, scale: float) -> float:
    """How many of the coefficients the rays tell: those that are known beforehand count less."""
    inverse = invert_block(factor, POWERS, stiff * scale**2)
    told = float(POWERS)
    for i in range(KNOWN, POWERS):
        told -= inverse[i, i]
    return told


@compiled
def scan_bottom(values: NDArray[np.float32], shape: Floats, motion: Floats, noise: float) -> Floats:
    """The lowest point of an outline about ``shape`` (patch pixels): the entries of `bottom_cap`.

    ``motion`` is that during the exposure (x, y), px, ``noise`` that of a pixel, 0 where it is not known.
    """
    rays, seen = cap_rays(shape, lowest_angle(shape)[0], values.shape)
    if seen < LEAST_SEEN:
        return not_found(OUT_OF_FRAME)
    at, height, told = edge_candidates(values, rays, FINE_PX, FINE_STEP_PX, FINE_LINES, FINE_SIGMA_PX)
    correct_edges(at, rays, SCAN_VARIANCE + LINE_VARIANCE, motion)
    limit = max(LIMITS_PX[FINE], SLACK_OF_R * shape[2])
    least = max(0.3 * quantile_of(height[:, 0].copy(), rays.shape[0], 0.75), 0.02, noise if noise > 0.0 else told)
    shared, stiff, factor = rays_that_share(rays), np.zeros(POWERS), np.zeros((POWERS, POWERS))
    stiff[KNOWN:] = shared / (PRIOR_SHAPE * shape[2]) ** 2
    free, settings = np.arange(POWERS), np.array([least, limit, limit])
    moved, scale, share = tukey_fit(at, height, rays, free, np.zeros(POWERS), settings, stiff, factor)
    if math.isnan(scale) or share < LEAST_KEPT:
        return not_found(OCCLUDED)
    if farthest(rays, moved) > MOST_SHIFT_PX:
        return not_found(POOR)
    off = np.empty((rays.shape[0], 1))
    rest_of(at, height, rays, moved, least, off[:, 0])
    few = swallowed(independent_rays(off, scale, shared), told_by_rays(factor, stiff[KNOWN], scale))
    return point_told(shape, moved, invert_block(factor, POWERS, scale**2 * shared * few), scale)
