"""A fit with the radius of the sphere put in: what that changes, and what is then known how well."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.outline_fit import spreads

Floats = NDArray[np.float64]


def radius_slope(fit: SilhouetteFit) -> Floats:
    """How x, y, R, stretch and tilt of a fit with free radius answer to a change of the radius by one pixel."""
    variance = fit.covariance[2, 2]
    if not variance > 0:
        return np.zeros(5)
    return np.asarray(fit.covariance[:, 2] / variance, np.float64)


@compiled
def _with_radius_held(covariance: Floats, slope: Floats, unc: float, shape: Floats) -> tuple[Floats, Floats]:
    """Covariance without what came from a free radius, and with what one that is known to ``unc`` does by ``slope``.

    Behind it its ``spreads`` for ``shape``, a parameter vector.
    """
    held = np.empty((5, 5))
    variance = covariance[2, 2]
    for i in range(5):
        for j in range(5):
            from_radius = covariance[i, 2] * covariance[2, j] / variance if variance > 0.0 else 0.0
            held[i, j] = covariance[i, j] - from_radius + slope[i] * slope[j] * unc**2
    held[2, :] = 0.0
    held[:, 2] = 0.0
    return held, spreads(shape[2], shape[3], shape[4], held)


@compiled
def _all_held(covariances: Floats, slopes: Floats, unc: float, shapes: Floats) -> tuple[Floats, Floats]:
    """``_with_radius_held`` of many fits: covariances (n, 5, 5) and spreads (n, 6)."""
    held, spread = np.empty_like(covariances), np.empty((len(slopes), 6))
    for n in range(len(slopes)):
        held[n], spread[n] = _with_radius_held(covariances[n], slopes[n], unc, shapes[n])
    return held, spread


def with_radius(
    fits: Sequence[SilhouetteFit], radius: float, slopes: Floats, *, radius_unc: float = 0.0
) -> list[SilhouetteFit]:
    """Constrain fits to another radius: the conditional mean and covariance of the linearised problem.

    ``slopes`` (n, 5) are those of ``radius_slope``, of each fit or of a like one nearby. For a fit with free radius the
    covariance loses what came from the radius; for one with fixed radius only the values move. What ``radius_unc`` of
    the pooled radius does to the others is then added.
    """
    if not fits:
        return []
    shapes = np.array([fit.shape for fit in fits])
    shapes[:, 4] = np.radians(shapes[:, 4])
    shapes += (radius - shapes[:, 2])[:, None] * slopes
    shapes[:, 2] = radius
    held, spread = _all_held(np.array([fit.covariance for fit in fits]), slopes, radius_unc, shapes)
    shapes[:, 4] = np.degrees(shapes[:, 4])
    rows = zip(fits, shapes.tolist(), held, spread.tolist(), strict=True)
    return [_moved(fit, EllipseShape(*shape), covariance, uncs) for fit, shape, covariance, uncs in rows]


def _moved(fit: SilhouetteFit, shape: EllipseShape, covariance: Floats, spread: list[float]) -> SilhouetteFit:
    """The fit with another shape, its covariance and its ``spreads``."""
    x_unc, y_unc, _, stretch_unc, _, bottom_unc = spread
    return fit._replace(
        center_x_px=shape.x,
        center_y_px=shape.y,
        radius_px=shape.radius,
        stretch=shape.stretch,
        center_x_unc_px=x_unc,
        center_y_unc_px=y_unc,
        radius_unc_px=math.nan,
        stretch_unc=stretch_unc if fit.stretch_unc == fit.stretch_unc else math.nan,
        bottom_y_px=shape.bottom_y,
        bottom_y_unc_px=bottom_unc,
        covariance=covariance,
    )
