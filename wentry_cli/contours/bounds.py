"""How far light allows one to see: the Cramér–Rao bound of a silhouette."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from wentry_cli.contours.ellipse import PARAMETERS, EllipseShape
from wentry_cli.contours.fitting import bottom_unc

Floats = NDArray[np.float64]

ARC_NODES = 2000
BAND_PX = 12.0
DEPTHS = np.linspace(-BAND_PX, BAND_PX, 241)
SLOPE_PER_PX = 2e-4
SMEAR_NODES, SMEAR_STEPS = 41, 25


@dataclass(frozen=True)
class Bound:
    """Least standard deviations that any unbiased estimator can reach, NaN where a parameter is held (px, 1, deg)."""

    x_px: float
    y_px: float
    radius_px: float
    stretch: float
    tilt_deg: float
    bottom_y_px: float
    covariance: NDArray[np.float64]


def visible_top(shape: EllipseShape, visible: float) -> float:
    """Row below which the share ``visible`` of the perimeter lies (full-frame px); -inf for all of it."""
    if visible >= 1.0:
        return -math.inf
    points, _, _, length = arc_nodes(shape)
    order = np.argsort(-points[:, 1], kind="stable")
    seen = np.cumsum(length[order]) / length.sum()
    return float(np.interp(visible, seen, points[order, 1]))


def arc_nodes(shape: EllipseShape) -> tuple[Floats, Floats, Floats, Floats]:
    """Points (n, 2), outward normals (n, 2), Jacobian of the displacement (n, 5) and lengths (n) along the outline."""
    phi = (np.arange(ARC_NODES) + 0.5) * 2.0 * math.pi / ARC_NODES
    a, b, tilt = shape.semi_across, shape.semi_along, math.radians(shape.tilt_deg)
    u, v = a * np.cos(phi), b * np.sin(phi)
    speed = np.hypot(a * np.sin(phi), b * np.cos(phi))
    nu, nv = b * np.cos(phi) / speed, a * np.sin(phi) / speed
    turn = np.array([[math.cos(tilt), math.sin(tilt)], [-math.sin(tilt), math.cos(tilt)]])
    points = np.stack([u, v], axis=1) @ turn.T + np.array([shape.x, shape.y])
    normals = np.stack([nu, nv], axis=1) @ turn.T
    jacobian = np.column_stack(
        [
            normals,
            (u * nu + v * nv) / shape.radius,
            (u * nu - 2.0 * v * nv) / shape.stretch,
            v * nu - u * nv,
        ]
    )
    return points, normals, jacobian, speed * 2.0 * math.pi / ARC_NODES


def edge_information(noise: float, noise_dark: float, blur_px: float, contrast: float, smear_px: float = 0.0) -> Floats:
    """Information (4 x 4) of 1 px of edge about displacement, level inside, level outside and ln blur.

    ``smear_px`` is the way across the edge during the exposure.
    """
    return np.asarray(np.sum(information_by_depth(noise, noise_dark, blur_px, contrast, smear_px), axis=0))


def information_by_depth(
    noise: float, noise_dark: float, blur_px: float, contrast: float, smear_px: float = 0.0
) -> Floats:
    """What the light at each of DEPTHS adds to `edge_information` (n, 4, 4)."""
    instants = (np.arange(SMEAR_NODES) + 0.5) / SMEAR_NODES - 0.5 if smear_px > 0.0 else np.zeros(1)
    scaled = (DEPTHS[:, None] + smear_px * instants) / blur_px
    step = np.mean(ndtr(scaled), axis=1)
    lines = np.exp(-0.5 * scaled**2) / math.sqrt(2.0 * math.pi)
    line, tilted = np.mean(lines, axis=1), np.mean(lines * scaled, axis=1)
    templates = np.stack([-contrast * line / blur_px, 1.0 - step, step, -contrast * tilted])
    variance = noise_dark**2 + (noise**2 - noise_dark**2) * step
    return np.asarray(np.einsum("id,jd->dij", templates / variance, templates) * (DEPTHS[1] - DEPTHS[0]))


def smeared_information(smear_px: Floats, edge: tuple[float, float, float, float], counts: Floats) -> Floats:
    """`edge_information` at each node (n, 4, 4), interpolated over the way ``smear_px`` (n) that the edge moves.

    ``counts`` (n, depths) is what the light at each of DEPTHS counts.
    """
    farthest = float(np.max(smear_px))
    if farthest == 0.0:
        return np.tensordot(counts, information_by_depth(*edge), axes=1)
    ways = np.linspace(0.0, farthest, SMEAR_STEPS)
    tables = np.stack([np.tensordot(counts, information_by_depth(*edge, float(way)), axes=1) for way in ways])
    place = np.minimum(smear_px / ways[1], SMEAR_STEPS - 1.0 - 1e-9)
    node, number = place.astype(np.intp), np.arange(smear_px.size)
    share = (place - node)[:, None, None]
    return np.asarray((1.0 - share) * tables[node, number] + share * tables[node + 1, number])


def pixels_across(points: Floats, normals: Floats, picture: Floats) -> Floats:
    """The pixels of a picture, the centre of the first at (0, 0), at each of DEPTHS of each point; 0 beyond it."""
    framed = np.pad(picture, 1)
    column, row = (
        np.clip(points[:, axis, None] + normals[:, axis, None] * DEPTHS + 1.5, 0.0, size - 0.5).astype(np.int32)
        for axis, size in enumerate(framed.shape[::-1])
    )
    return np.asarray(framed.ravel()[row * framed.shape[1] + column])


def cramer_rao_bound(
    shape: EllipseShape,
    *,
    free: str = "x y stretch",
    noise: float,
    blur_px: float = 1.04,
    contrast: float = 0.92,
    visible: float = 1.0,
    noise_dark: float | None = None,
    motion_px: tuple[float, float] = (0.0, 0.0),
    right_px: float = math.inf,
    counts: NDArray[np.float64] | None = None,
) -> Bound:
    """The Cramér–Rao bound of the free parameters and of the lowest row of a blurred dark silhouette.

    ``noise`` is the standard deviation of a pixel on the ground (of level 1), ``noise_dark`` on the object (default
    the same), ``contrast`` the difference of the levels, ``blur_px`` the sigma of the edge (optics and pixel),
    ``motion_px`` the way during the exposure (x, y), which smears the edge evenly where it lies across, ``visible``
    the share of the perimeter that is seen, from the bottom up, and ``right_px`` the column at which the picture
    ends. ``counts`` (rows, columns) is what each pixel of the picture counts, the centre of the first at (0, 0): 1
    where nothing hides it, 0 where it tells nothing, t^2 where what is seen of the sphere is dimmed to t by something
    that is known; beyond the picture is nothing. Raises ``LinAlgError`` where nothing is left. The two grey levels, the
    slope of the ground (two components) and the blur are nuisance parameters. Fisher information of independent
    Gaussian pixels, integrated along the arc; grey levels count within 12 px of the edge.
    """
    points, normals, jacobian, length = arc_nodes(shape)
    kept = (points[:, 1] >= visible_top(shape, visible)) & (points[:, 0] < right_px)
    points, normals, jacobian, length = points[kept], normals[kept], jacobian[kept], length[kept]
    smear = np.abs(normals @ np.array(motion_px))
    dark = noise if noise_dark is None else noise_dark
    left = np.ones((len(points), DEPTHS.size)) if counts is None else pixels_across(points, normals, counts)
    local = smeared_information(smear, (noise, dark, blur_px, contrast), left)
    names = free.split()
    columns = [PARAMETERS.index(name) for name in names]
    size = len(columns)
    chain = np.zeros((len(points), 4, size + 5))
    chain[:, 0, :size] = jacobian[:, columns]
    chain[:, 1, size] = 1.0
    chain[:, 2, size + 1] = 1.0
    chain[:, 2, size + 2] = (points[:, 0] - shape.x) / shape.radius
    chain[:, 2, size + 3] = (points[:, 1] - shape.y) / shape.radius
    chain[:, 3, size + 4] = 1.0
    information = np.einsum("kia,kij,kjb,k->ab", chain, local, chain, length, optimize=True)
    full = np.linalg.inv(information)[:size, :size]
    covariance = np.zeros((5, 5))
    covariance[np.ix_(columns, columns)] = full
    return named_bound(shape, covariance)


def named_bound(shape: EllipseShape, covariance: NDArray[np.float64]) -> Bound:
    """Standard deviations by name from a covariance over PARAMETERS with zero rows where held."""
    sigma = np.sqrt(np.diag(covariance))
    bound = np.where(sigma > 0.0, sigma, math.nan)
    return Bound(
        x_px=float(bound[0]),
        y_px=float(bound[1]),
        radius_px=float(bound[2]),
        stretch=float(bound[3]),
        tilt_deg=math.degrees(float(bound[4])),
        bottom_y_px=bottom_unc(shape, covariance),
        covariance=covariance,
    )


def cap_bound(shape: EllipseShape, *, noise: float, noise_dark: float, half_angle_deg: float = 30.0) -> float:
    """Bound of the lowest row (px) from the cap within ``half_angle_deg`` of the bottom alone; no tilt.

    The cap's displacement, slope and curvature are free, as are levels, slope of the ground and blur; third and
    fourth order are zero, so an estimator that allows for them may lie above.
    """
    points, _, _, length = arc_nodes(shape)
    angle = np.arcsin(np.clip((points[:, 0] - shape.x) / shape.semi_across, -1.0, 1.0)) / math.radians(half_angle_deg)
    kept = (points[:, 1] > shape.y) & (np.abs(angle) <= 1.0)
    chain = np.zeros((int(kept.sum()), 4, 8))
    for order in range(3):
        chain[:, 0, order] = angle[kept] ** order
    chain[:, 1, 3] = chain[:, 2, 4] = chain[:, 3, 7] = 1.0
    chain[:, 2, 5] = (points[kept, 0] - shape.x) / shape.radius
    chain[:, 2, 6] = (points[kept, 1] - shape.y) / shape.radius
    # within the cap the height hardly varies: the design's prior on the slope of the ground keeps it from the level
    prior = np.zeros((8, 8))
    prior[5, 5] = prior[6, 6] = 1.0 / (SLOPE_PER_PX * shape.radius) ** 2
    local = edge_information(noise, noise_dark, 1.04, 0.92)
    information = np.einsum("kia,ij,kjb,k->ab", chain, local, chain, length[kept], optimize=True) + prior
    return math.sqrt(float(np.linalg.inv(information)[0, 0]))
