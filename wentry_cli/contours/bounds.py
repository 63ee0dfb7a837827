"""How far light allows one to see: the Cramér–Rao bound of a silhouette."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.ellipse import PARAMETERS, EllipseShape, bottom_gradient

Floats = NDArray[np.float64]

ARC_NODES = 2000
BAND_PX = 12.0
DEPTH_NODES = 241


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


def edge_information(noise: float, noise_dark: float, blur_px: float, contrast: float) -> Floats:
    """Information (4 x 4) of 1 px of edge about displacement, level inside, level outside and ln blur."""
    depth = np.linspace(-BAND_PX, BAND_PX, DEPTH_NODES)
    scaled = depth / blur_px
    step = 0.5 * (1.0 + np.array([math.erf(z / math.sqrt(2.0)) for z in scaled]))
    line = np.exp(-0.5 * scaled**2) / math.sqrt(2.0 * math.pi)
    templates = np.stack([-contrast * line / blur_px, 1.0 - step, step, -contrast * line * scaled])
    variance = noise_dark**2 + (noise**2 - noise_dark**2) * step
    return np.asarray((templates / variance) @ templates.T * (depth[1] - depth[0]))


def cramer_rao_bound(
    shape: EllipseShape,
    *,
    free: str = "x y stretch",
    noise: float,
    blur_px: float = 1.04,
    contrast: float = 0.92,
    visible: float = 1.0,
    noise_dark: float | None = None,
) -> Bound:
    """The Cramér–Rao bound of the free parameters and of the lowest row of a blurred dark silhouette.

    ``noise`` is the standard deviation of a pixel on the ground (of level 1), ``noise_dark`` on the object (default
    the same), ``contrast`` the difference of the levels, ``blur_px`` the normal sigma of the edge (optics, pixel and
    motion together), ``visible`` the share of the perimeter that is seen, from the bottom up. The two grey levels,
    the slope of the ground (two components) and the blur are nuisance parameters. Fisher information of independent
    Gaussian pixels, integrated along the arc; grey levels count within 12 px of the edge.
    """
    local = edge_information(noise, noise if noise_dark is None else noise_dark, blur_px, contrast)
    points, _, jacobian, length = arc_nodes(shape)
    kept = points[:, 1] >= visible_top(shape, visible)
    names = free.split()
    columns = [PARAMETERS.index(name) for name in names]
    size = len(columns)
    chain = np.zeros((ARC_NODES, 4, size + 5))
    chain[:, 0, :size] = jacobian[:, columns]
    chain[:, 1, size] = 1.0
    chain[:, 2, size + 1] = 1.0
    chain[:, 2, size + 2] = (points[:, 0] - shape.x) / shape.radius
    chain[:, 2, size + 3] = (points[:, 1] - shape.y) / shape.radius
    chain[:, 3, size + 4] = 1.0
    information = np.einsum("kia,ij,kjb,k->ab", chain[kept], local, chain[kept], length[kept], optimize=True)
    full = np.linalg.inv(information)[:size, :size]
    covariance = np.zeros((5, 5))
    covariance[np.ix_(columns, columns)] = full
    return named_bound(shape, covariance)


def named_bound(shape: EllipseShape, covariance: NDArray[np.float64]) -> Bound:
    """Standard deviations by name from a covariance over PARAMETERS with zero rows where held."""
    sigma = np.sqrt(np.diag(covariance))
    bound = np.where(sigma > 0.0, sigma, math.nan)
    gradient = bottom_gradient(shape)
    return Bound(
        x_px=float(bound[0]),
        y_px=float(bound[1]),
        radius_px=float(bound[2]),
        stretch=float(bound[3]),
        tilt_deg=math.degrees(float(bound[4])),
        bottom_y_px=math.sqrt(float(gradient @ covariance @ gradient)),
        covariance=covariance,
    )
