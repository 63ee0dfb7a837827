"""A fit with the radius of the sphere put in, or its tilt: what that changes, and what is then known how well."""

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
def _with_radius_held(
    vectors: Floats, covariances: Floats, slopes: Floats, radius: float, unc: float
) -> tuple[Floats, Floats]:
    """Covariances without what came from a free radius, and with what one that is known to ``unc`` does by ``slopes``.

    Behind them their ``spreads``. ``vectors`` (n, 5) are moved to the ``radius`` in place.
    """
    held, spread = np.empty(covariances.shape), np.empty((vectors.shape[0], 6))
    for n in range(vectors.shape[0]):
        covariance, slope, change = covariances[n], slopes[n], radius - vectors[n, 2]
        variance = covariance[2, 2]
        for i in range(5):
            vectors[n, i] = radius if i == 2 else vectors[n, i] + change * slope[i]
            for j in range(5):
                from_radius = covariance[i, 2] * covariance[2, j] / variance if variance > 0.0 else 0.0
                held[n, i, j] = covariance[i, j] - from_radius + slope[i] * slope[j] * unc**2
        held[n, 2, :] = 0.0
        held[n, :, 2] = 0.0
        spread[n] = spreads(radius, vectors[n, 3], vectors[n, 4], held[n])
    return held, spread


def with_radius(
    fits: Sequence[SilhouetteFit], radius: float, slopes: Floats, *, radius_unc: float = 0.0
) -> list[SilhouetteFit]:
    """Constrain fits to another radius: the conditional mean and covariance of the linearised problem.

    ``slopes`` (fits, 5) are those of ``radius_slope``, of each fit or of a like one nearby. For a fit with free radius
    the covariance loses what came from the radius; for one with fixed radius only the values move. What ``radius_unc``
    of the pooled radius does to the others is then added.
    """
    vectors = np.array([(fit.center_x_px, fit.center_y_px, fit.radius_px, fit.stretch, 0.0) for fit in fits])
    vectors[:, 4] = np.radians([fit.tilt_deg for fit in fits])
    covariances = np.array([fit.covariance for fit in fits])
    held, spread = _with_radius_held(vectors, covariances, slopes, radius, radius_unc)
    rows = zip(fits, vectors.tolist(), spread.tolist(), held, strict=True)
    return [_replaced(fit, vector, uncs, covariance) for fit, vector, uncs, covariance in rows]


def _replaced(fit: SilhouetteFit, vector: list[float], uncs: list[float], covariance: Floats) -> SilhouetteFit:
    """The fit at another vector and with other uncertainties; its own tilt stays."""
    x, y, radius, stretch, tilt = vector
    x_unc, y_unc, _, stretch_unc, _, bottom_unc = uncs
    return fit._replace(
        center_x_px=x,
        center_y_px=y,
        radius_px=radius,
        stretch=stretch,
        center_x_unc_px=x_unc,
        center_y_unc_px=y_unc,
        radius_unc_px=math.nan,
        stretch_unc=stretch_unc if fit.stretch_unc == fit.stretch_unc else math.nan,
        bottom_y_px=EllipseShape(x, y, radius, stretch, math.degrees(tilt)).bottom_y,
        bottom_y_unc_px=bottom_unc,
        covariance=covariance,
    )


def with_tilt(fit: SilhouetteFit, tilt_deg: float, tilt_unc_deg: float) -> SilhouetteFit:
    """Hold the tilt at another value, known to an uncertainty: the conditional mean and covariance.

    A fit that tells nothing of how it answers to the tilt is returned as it is.
    """
    if not fit.covariance[4, 4] > 0.0:
        return fit
    slope = fit.covariance[:, 4] / fit.covariance[4, 4]
    tilt, unc = math.radians(tilt_deg), math.radians(tilt_unc_deg)
    vector = fit.shape.vector()
    vector += slope * (tilt - vector[4])
    covariance = fit.covariance - np.outer(slope, fit.covariance[4]) + np.outer(slope, slope) * unc**2
    spread = spreads(vector[2], vector[3], tilt, covariance).tolist()
    held = fit._replace(tilt_deg=tilt_deg, tilt_unc_deg=tilt_unc_deg, radius_unc_px=spread[2])
    return _replaced(held, vector.tolist(), spread, covariance)
