"""Lines that may honestly be drawn beside the data, with where they come from."""

from __future__ import annotations

import numpy as np

# Slopes of T on D √(ρ_s/G∞): small oscillations of the affine ellipsoid, 2π/√40, and the exact n = 2 mode of a free
# incompressible sphere (k R = 2.6656). Water loading ⅔ ρ_w/ρ_s multiplies by 1.2735 where the sphere is wetted all
# round; in a cavity about half is wetted.
PERIOD_IN_AIR = (0.70248, 1.1786)  # G_∞ + G_T affine … G∞ exact
PERIOD_IN_WATER = (1.14, 1.501)  # half wetted, affine … wetted all round, exact
PAPER_PERIOD_EXPERIMENT = 1.4
PAPER_PERIOD_MODEL = 1.2
PERIOD_OF_TABLE_1 = (0.78, 0.95)  # least and greatest T/(D √(ρ_s/G∞)) of its six spheres, λ₀ from 1.05 to 2.2
SLOPE_OF_TABLE_1 = 0.83  # through the origin over them
PAPER_PINCH_OFF = 1.3
PAPER_DELTA_U_EXPONENT = -0.5
PAPER_STIFFNESS_LIMIT = 0.2
PAPER_PREFACTOR = (0.35, 0.86)  # 1/(1 + C_m) for λ = 1.5 … 0.74 as the paper states it
PAPER_STRETCH_RANGE = (0.74, 1.5)
PUBLISHED_BETA = (1.7, 2.3)  # t_p √(g/R) of rigid spheres


def published_pinch_off_band(froude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """t_p U₀/D for the published prefactors β = t_p √(g/R) = 1.7 … 2.3 of rigid spheres: (β/√2) Fr."""
    low, high = PUBLISHED_BETA
    return low / np.sqrt(2) * froude, high / np.sqrt(2) * froude


def ring_model_pinch_off(froude: np.ndarray, alpha: float = 0.5, depths: int = 4000) -> np.ndarray:
    """t_p U₀/D of a cavity of independent rings behind a sphere of constant speed, from first contact.

    A ring at depth z is born at z/U₀ with radius r₀ = D/2 and speed α U₀ and follows R² = r₀² + 2 r₀ α U₀ s − g z s²;
    the cavity closes where z/U₀ + s is least. Half is added, the passage of the centre after first contact.
    Units: lengths in D, times in D/U₀, so g becomes Fr⁻². Shape of ``froude`` in, the same out.
    """
    fr = np.asarray(froude, dtype=float)[..., None]
    z = fr * np.geomspace(0.02, 20.0, depths)
    pull = z / fr**2
    s = (0.5 * alpha + np.sqrt(0.25 * alpha**2 + 0.25 * pull)) / pull
    closing: np.ndarray = (z + s).min(axis=-1) + 0.5
    return closing


def added_mass_prefactor(stretch: float) -> float:
    """1/(1 + C_m) of a fully wetted spheroid of stretch λ, C_m after Lamb (``mechanics/added_mass.py``)."""
    from wentry_cli.mechanics.added_mass import added_mass_coefficient

    return 1.0 / (1.0 + float(added_mass_coefficient(stretch)))
