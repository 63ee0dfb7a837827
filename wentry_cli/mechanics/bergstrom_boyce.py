"""The Bergström–Boyce sphere: an incompressible ellipsoid of revolution with a relaxing and a lasting network.

Semi-axes (λR, λR, R/λ²); the stretch λ = λ_e λ_p splits into an elastic and a viscous part. Time is measured in
t_c = R √(ρ_s/G∞); five dimensionless groups are left (see ``Groups``). The state that is integrated is
(λ, dλ/dt*, x, dissipated energy, A* cⁿ) with x = λ_p² − 1, because then the flow rule needs neither a logarithm nor the
difference √I₁ᵖ − √3, which loses all its digits near λ_p = 1. A* cⁿ follows from x; it has a derivative of its own
because the power would take half the time of the integration.

Source: Hurd et al., Water entry of deformable spheres, Appendix A; equations re-derived (docs/theory.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.errors import ConfigurationError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
GroupValues = tuple[float, float, float, float, float]  # γ, A*, n, m, ξ

SQRT3 = math.sqrt(3.0)
STATE_SIZE = 5  # stretch, its rate, x = λ_p² − 1, dissipated energy, mobility A* cⁿ
MOBILITY = 4  # place of A* cⁿ in the state
SENSITIVITY_NAMES = ("stretch_0", "log_flow", "n", "stiffness_ratio", "x_0")
FULL_SIZE = 20  # state and five triples of sensitivities


@dataclass(frozen=True)
class Material:
    """A sphere and its material: everything that the free oscillation depends on. SI units, names as in the tables."""

    radius_m: float
    density_kg_m3: float
    g_inf_pa: float
    g_t_pa: float
    xi: float
    tau0_pa: float
    m: float
    n: float
    eps0_dot_1_s: float


@dataclass(frozen=True)
class Groups:
    """Dimensionless groups of the oscillation, and the time ``time_scale_s`` = t_c in which it is measured.

    ``stiffness_ratio`` is γ = G_T/G∞; ``flow`` is A* = ½ ε̇₀ (G_T/τ₀)ᵐ t_c.
    """

    stiffness_ratio: float
    flow: float
    n: float
    m: float
    xi: float
    time_scale_s: float

    @property
    def values(self) -> GroupValues:
        """The five groups in the order in which the compiled functions read them."""
        return self.stiffness_ratio, self.flow, self.n, self.m, self.xi


def material_problems(material: Material) -> list[str]:
    """Say what is wrong with ``material``: one phrase per parameter, an empty list if it can be used."""
    positive = ("radius_m", "density_kg_m3", "g_inf_pa", "tau0_pa")
    not_negative = ("g_t_pa", "xi", "m", "eps0_dot_1_s")
    problems = []
    for name in (*positive, *not_negative, "n"):
        value = getattr(material, name)
        if not math.isfinite(value):
            problems.append(f"{name} is {value:g}, not a finite number")
        elif name in positive and value <= 0.0:
            problems.append(f"{name} is {value:g} and must be greater than 0")
        elif name in not_negative and value < 0.0:
            problems.append(f"{name} is {value:g} and must not be negative")
    if material.xi == 0.0 and material.n < 0.0:
        problems.append(f"xi = 0 with n = {material.n:g} makes the flow rule infinite at the start; give xi > 0")
    return problems


def _is_sound(material: Material) -> bool:
    """Whether ``material_problems`` would find nothing: quick, since a fit asks some thousand times."""
    m, end = material, math.inf
    positive = (
        0.0 < m.radius_m < end and 0.0 < m.density_kg_m3 < end and 0.0 < m.g_inf_pa < end and 0.0 < m.tau0_pa < end
    )
    rest = 0.0 <= m.g_t_pa < end and 0.0 <= m.xi < end and 0.0 <= m.m < end and 0.0 <= m.eps0_dot_1_s < end
    return positive and rest and -end < m.n < end and (m.xi > 0.0 or m.n >= 0.0)


def find_groups(material: Material) -> Groups:
    """Reduce ``material`` to its dimensionless groups.

    Raises ``ConfigurationError`` with one sentence where the parameters make no sense or a group overflows.
    """
    if not _is_sound(material):
        raise ConfigurationError("the material cannot be integrated: " + "; ".join(material_problems(material)))
    time_scale = material.radius_m * math.sqrt(material.density_kg_m3 / material.g_inf_pa)
    if material.g_t_pa == 0.0 or material.eps0_dot_1_s == 0.0:
        log_flow = -math.inf
    else:
        log_stress = math.log(material.g_t_pa) - math.log(material.tau0_pa)
        log_flow = math.log(0.5 * material.eps0_dot_1_s) + material.m * log_stress + math.log(time_scale)
    if log_flow > 700.0:
        raise ConfigurationError(
            f"the material flows without bound: eps0_dot_1_s (g_t_pa/tau0_pa)^m is about 10^{log_flow / 2.302585:.0f}; "
            "check the unit of tau0_pa, which is Pa, and m"
        )
    return Groups(
        material.g_t_pa / material.g_inf_pa,
        math.exp(log_flow),
        material.n,
        material.m,
        material.xi,
        time_scale,
    )


@compiled
def excess_invariant(x: float) -> float:
    """I₁ − 3 of a stretch whose square is 1 + x, without cancellation: x² (2x + 3)/(1 + x)²."""
    return x * x * (2.0 * x + 3.0) / ((1.0 + x) * (1.0 + x))


@compiled
def elastic_stress(stretch: float, x: float) -> float:
    """s = λ_e² − λ_e⁻⁴ with λ_e² = λ²/(1 + x), accurate where λ_e is near 1."""
    u = stretch * stretch / (1.0 + x)
    return ((stretch - 1.0) * (stretch + 1.0) - x) / (1.0 + x) * (u * u + u + 1.0) / (u * u)


@compiled
def flow_hardening(x: float, xi: float) -> float:
    """c = √I₁ᵖ − √3 + ξ with λ_p² = 1 + x, accurate where λ_p is near 1; (I₁ᵖ − 3)/(√I₁ᵖ + √3) over one division."""
    p = 1.0 + x
    excess = x * x * (2.0 * x + 3.0)
    return float(excess / (p * (math.sqrt(3.0 * p * p + excess) + SQRT3 * p)) + xi)


@compiled
def mobility(x: float, groups: GroupValues) -> float:
    """A* cⁿ, the rate of flow under unit stress, at x = λ_p² − 1."""
    return 0.0 if groups[1] == 0.0 else float(groups[1] * flow_hardening(x, groups[4]) ** groups[2])


@compiled
def hardening_slope(x: float, xi: float) -> float:
    """d ln c/dx, with c as in ``flow_hardening``; 0 where c is 0."""
    p = 1.0 + x
    excess = x * x * (2.0 * x + 3.0)
    root = math.sqrt(3.0 * p * p + excess)
    total = root + SQRT3 * p
    hardening = excess + xi * p * total
    return x * (3.0 + x * (3.0 + x)) * total / (p * root * hardening) if hardening > 0.0 else 0.0


@compiled
def flow_rate(s: float, mobile: float, m: float) -> float:
    """(dλ_p/dt*)/λ_p by the flow rule, from the elastic stress ``s`` and the mobility A* cⁿ."""
    if s == 0.0 or mobile == 0.0:
        return 0.0
    rate = mobile * (abs(s) if m == 1.0 else abs(s) ** m)
    return rate if s > 0.0 else -rate


@compiled
def energy(stretch: float, rate: float, x: float, stiffness_ratio: float) -> float:
    """Energy of the oscillation in units of (8π/15) R³ G∞: kinetic, lasting and relaxing part.

    H = ½ (λ² + 2λ⁻⁴)(λ̇/λ)² + (5/4)(I₁ − 3) + (5/4) γ (I₁ᵉ − 3); dH/dt* = −5 γ s λ̇_p/λ_p.
    """
    square = stretch * stretch
    excess = (stretch - 1.0) * (stretch + 1.0)
    elastic = (excess - x) / (1.0 + x)
    kinetic = 0.5 * (1.0 + 2.0 / (square * square * square)) * rate * rate
    return kinetic + 1.25 * (excess_invariant(excess) + stiffness_ratio * excess_invariant(elastic))


@compiled
def state_rates(a: float, v: float, x: float, mobile: float, groups: GroupValues) -> tuple[float, float, float, float]:
    """Time derivatives of dλ/dt*, x, the dissipated energy and A* cⁿ at λ = ``a`` > 0, dλ/dt* = ``v``, ``x`` > −1."""
    a2 = a * a
    a4 = a2 * a2
    a6 = a4 * a2
    p = 1.0 + x
    over_p = 1.0 / p
    w = p / a2
    s = ((a - 1.0) * (a + 1.0) - x) * over_p * (1.0 + w * (1.0 + w))
    rate = flow_rate(s, mobile, groups[3])
    flowing = 2.0 * p * rate
    force = 6.0 * v * v / a - 5.0 * a * (a6 - 1.0 + groups[0] * s * a4)
    hardening = groups[2] * mobile * hardening_slope(x, groups[4]) * flowing
    return force / (a6 + 2.0), flowing, 5.0 * groups[0] * s * rate, hardening


@compiled
def derivatives(state: FloatArray, groups: FloatArray, out: FloatArray) -> bool:
    """Time derivative of (λ, dλ/dt*, x, dissipated energy) into ``out``; False outside λ > 0, x > −1.

    For integrators that call it from Python; ``groups`` is an array of ``GroupValues``, which is the quicker to pass.
    """
    a, v, x = state[0], state[1], state[2]
    if not (a > 0.0 and x > -1.0):
        return False
    values = (groups[0], groups[1], groups[2], groups[3], groups[4])
    out[0] = v
    out[1], out[2], out[3], _ = state_rates(a, v, x, mobility(x, values), values)
    return True


@compiled
def sensitivity_derivatives(rows: FloatArray, at: int, to: int, groups: GroupValues) -> None:
    """Time derivative of the sensitivities that follow the state, five triples (λ, dλ/dt*, x): row ``at`` into ``to``.

    The order is that of ``SENSITIVITY_NAMES``: initial λ, ln A*, n, γ, initial x. Needs m ≥ 1, ξ > 0.
    """
    a, v, x = rows[at, 0], rows[at, 1], rows[at, 2]
    gamma, n, m = groups[0], groups[2], groups[3]
    p = 1.0 + x
    u = a * a / p
    s = elastic_stress(a, x)
    c = flow_hardening(x, groups[4])
    s_u = 1.0 + 2.0 / (u * u * u)
    s_a, s_x = s_u * 2.0 * a / p, -s_u * u / p
    slope = rows[at, MOBILITY] * (1.0 if m == 1.0 else m * abs(s) ** (m - 1.0))  # of the rate over s
    r = slope * s / m
    r_a, r_x = slope * s_a, slope * s_x + r * n * hardening_slope(x, groups[4])
    a5 = a * a * a * a * a
    density = a5 * a + 2.0
    force = 6.0 * v * v / a - 5.0 * (a * (a5 * a - 1.0) + gamma * s * a5)
    inner = 7.0 * a5 * a - 1.0 + gamma * (s_a * a5 + 5.0 * s * a5 / a)
    f_a = (-6.0 * v * v / (a * a) - 5.0 * inner - force * 6.0 * a5 / density) / density
    f_v = 12.0 * v / (a * density)
    f_x = -5.0 * gamma * s_x * a5 / density
    for j in range(5):
        k = STATE_SIZE + 3 * j
        sa, sv, sx = rows[at, k], rows[at, k + 1], rows[at, k + 2]
        rows[to, k] = sv
        rows[to, k + 1] = f_a * sa + f_v * sv + f_x * sx
        rows[to, k + 2] = 2.0 * p * (r_a * sa + r_x * sx) + 2.0 * r * sx
    rows[to, STATE_SIZE + 5] += 2.0 * p * r
    rows[to, STATE_SIZE + 8] += 2.0 * p * r * math.log(c)
    rows[to, STATE_SIZE + 10] += -5.0 * s * a5 / density
