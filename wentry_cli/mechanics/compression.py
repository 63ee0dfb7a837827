"""Quasi-static compression of a sphere between two frictionless plates: its shear modulus from the force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

FloatArray = NDArray[np.float64]

HERTZ = 4.0 / 3.0
# Ratio to Hertz as a polynomial in √x without its constant 1, fitted to axisymmetric finite elements; within .15 %.
RATIO_COEFFICIENTS = (0.1729, 2.808, -18.6321, 64.3367, -99.416, 61.9132)
RATIO_RANGE = (0.002, 0.5)
FEWEST_POINTS = 6
RETURN = 0.1  # of the way of the plates: by how much they come back where a test is unloaded


@dataclass(frozen=True)
class CompressionFit:
    """Modulus in Pa with its standard uncertainty and 95 % interval, zero of the displacement in m, residual in N.

    ``points`` went into the fit; where they were too few it counts those at different displacements under a load.
    """

    g_inf_pa: float
    g_inf_pa_unc: float
    g_inf_low_pa: float
    g_inf_high_pa: float
    zero_offset_m: float
    zero_offset_m_unc: float
    residual_rms_n: float
    points: int
    status: str


def compression_force(x: ArrayLike) -> FloatArray:
    """f(x) with F = G∞ D² f(d/D) of an incompressible neo-Hookean sphere, ``x`` = d/D; 0 for x ≤ 0.

    Below ``RATIO_RANGE`` it runs into Hertz, f = (4/3) x^1.5; above it, it is an extrapolation and returns NaN.
    """
    values = np.asarray(x, dtype=np.float64)
    root = np.sqrt(np.maximum(values, 0.0))
    ratio = np.ones_like(root)
    for power, coefficient in enumerate(RATIO_COEFFICIENTS, start=1):
        ratio += coefficient * root**power
    return np.asarray(np.where(values > RATIO_RANGE[1], np.nan, HERTZ * root**3 * ratio))


def loading_branch(displacement_m: ArrayLike) -> int:
    """How many of the first points were taken while the plates approached: those up to the first turn.

    The plates have turned where they are farther back than ``RETURN`` of their whole way. All points where they do not
    approach over nearly the whole way before that: they are then in no order of time.
    """
    d = np.asarray(displacement_m, dtype=np.float64)
    if not d.size:
        return 0
    way = float(np.ptp(d))
    turned = np.flatnonzero(np.maximum.accumulate(d) - d > RETURN * way)
    if not turned.size:
        return int(d.size)
    branch = d[: int(np.argmax(d[: turned[0]])) + 1]
    return int(branch.size) if np.ptp(branch) >= (1.0 - RETURN) * way else int(d.size)


def fit_compression(displacement_m: ArrayLike, force_n: ArrayLike, diameter_m: float) -> CompressionFit:
    """Fit G∞ and the zero of the displacement to a loading curve: F = G∞ D² f((d − d₀)/D).

    Arrays of one shape, displacement between the plates rising with the force, in m and N. The modulus is a linear
    coefficient, so only d₀ is searched. The noise of the force is taken from the residuals; the uncertainty is that
    of the linearised fit of both. Points deeper than half a diameter are left out. ``status`` is ``ok``, ``too_few``
    (fewer than 6 points with load) or ``not_identified`` (no positive modulus, or an uncertainty above one half of
    it); every value is NaN where it is not ``ok``.
    """
    d = np.asarray(displacement_m, dtype=np.float64).ravel()
    force = np.asarray(force_n, dtype=np.float64).ravel()
    good = np.isfinite(d) & np.isfinite(force)
    d, force = d[good] / diameter_m, force[good] / diameter_m**2
    if d.size < FEWEST_POINTS or np.ptp(d) == 0.0:
        return _unfitted(np.unique(d[force > 0.0]).size, "too_few")
    inside = d - d.min() <= 0.95 * RATIO_RANGE[1]
    d, force = d[inside], force[inside]
    zero = _best_zero(d, force)
    curve = compression_force(d - zero)
    loaded = int(np.count_nonzero(curve > 0.0))
    if loaded < FEWEST_POINTS:
        return _unfitted(loaded, "too_few")
    modulus = float(curve @ force / (curve @ curve))
    return _with_uncertainty(d, force, (modulus, zero), diameter_m)


def _best_zero(d: FloatArray, force: FloatArray) -> float:
    """Zero of the displacement with the least squared residual: a scan, then a bounded search about its best."""

    def cost(zero: float) -> float:
        curve = compression_force(d - zero)
        norm = float(curve @ curve)
        modulus = max(float(curve @ force) / norm, 0.0) if norm > 0.0 else 0.0
        residual = force - modulus * curve
        return float(residual @ residual)

    low = max(float(d.min()) - 0.02, float(d.max()) - 0.999 * RATIO_RANGE[1])
    grid = np.linspace(low, float(d.max()), 201)[:-1]
    best = int(np.argmin([cost(float(z)) for z in grid]))
    bounds = (float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)]))
    return float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-9}).x)


def _with_uncertainty(
    d: FloatArray, force: FloatArray, fitted: tuple[float, float], diameter_m: float
) -> CompressionFit:
    modulus, zero = fitted
    step = 1e-6
    curve = compression_force(d - zero)
    slope = (compression_force(d - zero + step) - compression_force(d - zero - step)) / (2.0 * step)
    jacobian = np.column_stack([curve, -modulus * slope])
    residual = force - modulus * curve
    freedom = d.size - 2
    variance = float(residual @ residual) / freedom
    size = np.linalg.norm(jacobian, axis=0)  # modulus and zero differ by many orders
    scaled = jacobian / size
    covariance = np.linalg.pinv(scaled.T @ scaled) * variance / np.outer(size, size)
    unc, zero_unc = (float(np.sqrt(covariance[i, i])) for i in range(2))
    half = float(student.ppf(0.975, freedom)) * unc
    if not (modulus > 0.0 and unc < 0.5 * modulus):
        return _unfitted(d.size, "not_identified")
    return CompressionFit(
        g_inf_pa=modulus,
        g_inf_pa_unc=unc,
        g_inf_low_pa=modulus - half,
        g_inf_high_pa=modulus + half,
        zero_offset_m=zero * diameter_m,
        zero_offset_m_unc=zero_unc * diameter_m,
        residual_rms_n=float(np.sqrt(np.mean(residual**2))) * diameter_m**2,
        points=int(d.size),
        status="ok",
    )


def _unfitted(points: int, status: str) -> CompressionFit:
    nan = float("nan")
    return CompressionFit(nan, nan, nan, nan, nan, nan, nan, points, status)
