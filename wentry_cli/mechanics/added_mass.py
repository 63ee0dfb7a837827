"""Added mass of the deformed sphere: a spheroid with semi-axes (λR, λR, R/λ²) that moves along its axis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

SERIES_LIMIT = 0.02
SERIES_TERMS = 12


def added_mass_coefficient(stretch: ArrayLike) -> NDArray[np.float64]:
    """C_m = α₀/(2 − α₀): added mass over displaced mass for motion along the axis, of any shape like ``stretch``.

    Fully wetted, unbounded, potential flow: ½ for the sphere, more for the oblate body (λ > 1). NaN stays NaN.
    Accurate to about 1e-15 relative, by a series where the closed form cancels near λ = 1.

    Source: H. Lamb, Hydrodynamics, sixth edition, articles 114 and 373.
    Raises ``ValueError`` where a stretch is not positive.
    """
    values = np.asarray(stretch, dtype=np.float64)
    if np.any(values <= 0.0):
        raise ValueError("a stretch must be positive")
    alpha = np.array([_alpha(float(v)) for v in values.ravel()]).reshape(values.shape)
    return np.asarray(alpha / (2.0 - alpha))


def _alpha(stretch: float) -> float:
    """α₀ = 2 ab² ∫ ds … of the axis; 2/3 for the sphere, 2 for a disc."""
    if math.isnan(stretch):
        return math.nan
    # With q = 1 − (b/a)², b across and a along the axis: α₀ = 2 (1 − q) Σ qᵏ/(2k + 3); q < 0 where oblate.
    q = -math.expm1(6.0 * math.log(stretch))
    if abs(q) < SERIES_LIMIT:
        return 2.0 * (1.0 - q) * sum(q**k / (2 * k + 3) for k in range(SERIES_TERMS))
    root = math.sqrt(abs(q))
    inverse = math.atanh(root) if q > 0.0 else math.atan(root)
    return 2.0 * (1.0 - q) * (inverse / root - 1.0) / q
