"""Finite elements of a sphere between two frictionless plates: where the curve of ``mechanics/compression.py`` is from.

Incompressible neo-Hookean, axisymmetric, displacement in P2 and pressure in P1 on a curved mesh that is finer towards
the pole; contact by a stiff penalty at the points of quadrature, those that touch being found anew in every step of
Newton's method. Lengths in diameters, stresses in G∞. Needs the extra ``fem`` (scikit-fem).

``python -m wentry_cli.bench.compression_fem`` prints force, ratio to Hertz, the closed form and their difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

RADIUS = 0.5
PENALTY = 1e5  # stress over depth: the plates sink in by 1e-5 diameters where the pressure is 1
STILL = 1e-9  # of the displacement
MOST_NEWTON = 40
LONGEST_PART = 0.05  # of the depth in one step of the load


@dataclass(frozen=True)
class Discretisation:
    """Bases of displacement, pressure and contact, and the degrees of freedom that stay 0."""

    displacement: Any
    pressure: Any
    contact: Any
    fixed: NDArray[np.int64]


def solve_compression(depths: FloatArray, *, refinements: int = 3, local: int = 4) -> FloatArray:
    """f(x) = F/(G∞ D²) at the rising relative depths ``depths`` = d/D, d being the approach of the plates.

    ``refinements`` is how often the elements are halved everywhere, ``local`` how often more about the pole. Raises
    ``ImportError`` without scikit-fem and ``ArithmeticError`` where Newton's method does not converge.
    """
    grid = discretise(refinements, local)
    state = np.zeros(grid.displacement.N + grid.pressure.N)
    state[grid.displacement.N :] = 1.0  # pressure of the unloaded sphere, where P = F − p cof F
    forces, reached, force = [], 0.0, 0.0
    for depth in depths:
        parts = max(1, int(np.ceil((depth - reached) / LONGEST_PART)))
        for part in np.linspace(reached, depth, parts + 1)[1:]:
            state, force = _balance(grid, state, float(part))
        forces.append(force)
        reached = float(depth)
    return np.array(forces)


def discretise(refinements: int, local: int) -> Discretisation:
    """A quarter of the disc (r, z ≥ 0) whose edges lie on the circle, finer about its pole at (0, ½)."""
    import skfem

    mesh = skfem.MeshTri.init_circle(refinements)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.flatnonzero((middle[0] > 0.0) & (middle[1] > 0.0)))
    for level in range(local):
        middle = mesh.p[:, mesh.t].mean(axis=1)
        mesh = mesh.refined(np.flatnonzero(np.hypot(middle[0], middle[1] - 1.0) < 1.1 * 0.6**level))
        points = mesh.p.copy()
        rim = np.unique(mesh.facets[:, _arc(mesh)])
        points[:, rim] /= np.hypot(*points[:, rim])
        mesh = skfem.MeshTri(points, mesh.t)
    mesh = skfem.MeshTri2.from_mesh(skfem.MeshTri(RADIUS * mesh.p, mesh.t))
    nodes = mesh.doflocs.copy()
    rim = mesh.dofs.facet_dofs[0, _arc(mesh)]
    nodes[:, rim] *= RADIUS / np.hypot(*nodes[:, rim])
    mesh = skfem.MeshTri2(nodes, mesh.t)
    element = skfem.ElementVector(skfem.ElementTriP2())
    displacement = skfem.Basis(mesh, element, intorder=6)
    axis = displacement.get_dofs(lambda x: x[0] < 1e-9).all(["u^1"])
    floor = displacement.get_dofs(lambda x: x[1] < 1e-9).all(["u^2"])
    return Discretisation(
        displacement,
        displacement.with_element(skfem.ElementTriP1()),
        skfem.FacetBasis(mesh, element, facets=_arc(mesh), intorder=8),
        np.unique(np.concatenate([axis, floor])),
    )


def _arc(mesh: Any) -> NDArray[np.int64]:
    """Facets of the boundary that lie on neither axis."""
    facets = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, facets]].mean(axis=1)
    return np.asarray(facets[(middle[0] > 1e-9) & (middle[1] > 1e-9)])


def _balance(grid: Discretisation, state: FloatArray, depth: float) -> tuple[FloatArray, float]:
    """Newton's method at one depth of the plates; the new state and the force on a plate."""
    import skfem

    size = grid.displacement.N
    for _ in range(MOST_NEWTON):
        tangent, residual, force = _assemble(grid, state, depth)
        move = skfem.solve(*skfem.condense(tangent, -residual, D=grid.fixed))
        state = state + move
        if np.max(np.abs(move[:size])) < STILL:
            return state, force
    raise ArithmeticError(f"no balance of forces was found at the relative depth {depth:g}")


def _assemble(grid: Discretisation, state: FloatArray, depth: float) -> tuple[Any, FloatArray, float]:
    """Tangent and residual of the energy ½ (F:F − 3) − p (J − 1) with the penalty, and the force on the plate."""
    from scipy import sparse

    size = grid.displacement.N
    u, p = grid.displacement.interpolate(state[:size]), grid.pressure.interpolate(state[size:])
    touching = grid.contact.interpolate(state[:size])
    gap = np.maximum(grid.contact.global_coordinates()[1] + touching[1] - (RADIUS - 0.5 * depth), 0.0)
    forms = _forms()
    stiffness = forms["stiffness"].assemble(grid.displacement, u=u, p=p)
    stiffness = stiffness + forms["contact_stiffness"].assemble(grid.contact, gap=gap)
    coupling = forms["coupling"].assemble(grid.displacement, grid.pressure, u=u)
    force = forms["force"].assemble(grid.displacement, u=u, p=p) + forms["contact"].assemble(grid.contact, gap=gap)
    volume = forms["volume"].assemble(grid.pressure, u=u)
    tangent = sparse.bmat([[stiffness, coupling.T], [coupling, None]], format="csr")
    return tangent, np.concatenate([force, volume]), float(forms["pressing"].assemble(grid.contact, gap=gap))


def _gradient(u: Any, x: FloatArray) -> tuple[FloatArray, ...]:
    """The five entries of a displacement gradient with axial symmetry: rr, rz, zr, zz and hoop."""
    (a, b), (c, e) = u.grad
    return a, b, c, e, u[0] / x[0]


def _cofactor(u: Any, x: FloatArray) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """F and ∂J/∂F, entry by entry, with J = (F_rr F_zz − F_rz F_zr) F_hoop."""
    a, b, c, e, t = _gradient(u, x)
    a, e, t = 1.0 + a, 1.0 + e, 1.0 + t
    return (a, b, c, e, t), (e * t, -c * t, -b * t, a * t, a * e - b * c)


def _second(u: Any, v: tuple[FloatArray, ...], w: tuple[FloatArray, ...], x: FloatArray) -> FloatArray:
    """Second variation of J in the directions ``v`` and ``w``."""
    (a, b, c, e, t), _ = _cofactor(u, x)
    mixed = v[0] * w[3] + w[0] * v[3] - v[1] * w[2] - w[1] * v[2]
    first = v[0] * e + a * v[3] - v[1] * c - b * v[2]
    other = w[0] * e + a * w[3] - w[1] * c - b * w[2]
    return np.asarray(mixed * t + first * w[4] + other * v[4])


def _forms() -> dict[str, Any]:
    """The integrals over the body and the surface, with the weight 2πr of the revolution."""
    import skfem

    def contract(left: tuple[FloatArray, ...], right: tuple[FloatArray, ...]) -> Any:
        return sum(one * other for one, other in zip(left, right, strict=True))

    def stiffness(v: Any, w: Any, at: Any) -> Any:
        dv, dw = _gradient(v, at.x), _gradient(w, at.x)
        return (contract(dv, dw) - at["p"] * _second(at["u"], dv, dw, at.x)) * 2.0 * np.pi * at.x[0]

    def coupling(v: Any, q: Any, at: Any) -> Any:
        return -q * contract(_cofactor(at["u"], at.x)[1], _gradient(v, at.x)) * 2.0 * np.pi * at.x[0]

    def force(v: Any, at: Any) -> Any:
        full, cofactor = _cofactor(at["u"], at.x)
        stress = tuple(f - at["p"] * c for f, c in zip(full, cofactor, strict=True))
        return contract(stress, _gradient(v, at.x)) * 2.0 * np.pi * at.x[0]

    def volume(q: Any, at: Any) -> Any:
        (_, _, _, _, t), cofactor = _cofactor(at["u"], at.x)
        return -q * (cofactor[4] * t - 1.0) * 2.0 * np.pi * at.x[0]

    def contact(v: Any, at: Any) -> Any:
        return PENALTY * at["gap"] * v[1] * 2.0 * np.pi * at.x[0]

    def contact_stiffness(v: Any, w: Any, at: Any) -> Any:
        return PENALTY * (at["gap"] > 0.0) * v[1] * w[1] * 2.0 * np.pi * at.x[0]

    def pressing(at: Any) -> Any:
        return PENALTY * at["gap"] * 2.0 * np.pi * at.x[0]

    return {
        "stiffness": skfem.BilinearForm(stiffness),
        "coupling": skfem.BilinearForm(coupling),
        "contact_stiffness": skfem.BilinearForm(contact_stiffness),
        "force": skfem.LinearForm(force),
        "volume": skfem.LinearForm(volume),
        "contact": skfem.LinearForm(contact),
        "pressing": skfem.Functional(pressing),
    }


def main() -> None:
    """Print the curve, its ratio to Hertz, the closed form and their difference."""
    from wentry_cli.mechanics.compression import HERTZ, compression_force

    depths = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5])
    print("x        f_elements  f/Hertz  f_closed   difference")
    for x, f in zip(depths, solve_compression(depths), strict=True):
        closed = float(compression_force(x))
        print(f"{x:<8g} {f:<11.6f} {f / (HERTZ * x**1.5):<8.4f} {closed:<10.6f} {closed / f - 1.0:+.5f}")


if __name__ == "__main__":
    main()
