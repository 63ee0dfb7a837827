"""The dimensionless numbers of water entry, as the paper defines them. SI throughout; NaN goes in and comes out."""

from __future__ import annotations

import math


def froude(speed_m_s: float, diameter_m: float, gravity_m_s2: float = 9.81) -> float:
    """Return Fr = U₀/√(g D)."""
    return speed_m_s / math.sqrt(gravity_m_s2 * diameter_m)


def bond(
    diameter_m: float, liquid_density_kg_m3: float, surface_tension_n_m: float, gravity_m_s2: float = 9.81
) -> float:
    """Return Bo = ρ_w g D²/σ."""
    return liquid_density_kg_m3 * gravity_m_s2 * diameter_m**2 / surface_tension_n_m


def reynolds(speed_m_s: float, diameter_m: float, liquid_density_kg_m3: float, viscosity_pa_s: float) -> float:
    """Return Re = ρ_w U₀ D/μ."""
    return liquid_density_kg_m3 * speed_m_s * diameter_m / viscosity_pa_s


def stiffness_ratio(shear_modulus_pa: float, speed_m_s: float, liquid_density_kg_m3: float) -> float:
    """Return G∞/(ρ_w U₀²), shear modulus over impact pressure; NaN for a sphere at rest."""
    if speed_m_s == 0.0:
        return math.nan
    return shear_modulus_pa / (liquid_density_kg_m3 * speed_m_s**2)


def elastic_time(diameter_m: float, shear_modulus_pa: float, density_kg_m3: float) -> float:
    """Return D/√(G∞/ρ_s), s: the abscissa of the oscillation period."""
    return diameter_m / math.sqrt(shear_modulus_pa / density_kg_m3)


def effective_diameter(diameter_m: float, stretch_peak: float) -> float:
    """Return D_eff = λ_pN D, with λ_pN the peak of the cavity that pinches off."""
    return stretch_peak * diameter_m


def speed_from_height(height_m: float, gravity_m_s2: float = 9.81) -> float:
    """Return √(2 g h), the impact speed of a fall from rest without air."""
    return math.sqrt(2.0 * gravity_m_s2 * height_m)


def velocity_loss(speed_m_s: float, speed_after_m_s: float) -> float:
    """Return ΔU/U₀ = (U₀ − U₁)/U₀; above 1 for a sphere that rebounds."""
    return (speed_m_s - speed_after_m_s) / speed_m_s if speed_m_s else math.nan
