"""One step of a square-root Kalman filter and of a square-root information filter that comes from the other end.

Covariances and information matrices are carried as factors, so that no rounding makes a variance negative however far
apart the noise, the jumps and the path are (Potter's measurement update; time updates by orthogonalisation: Kaminski,
Bryson & Schmidt 1971). What the frames behind and those ahead know is joined as V = S (1 + Sᵀ Λ S)⁻¹ Sᵀ with P = S Sᵀ
and Λ = R Rᵀ, where nothing is subtracted. No covariance is inverted: q = 0 (ballistic flight) is allowed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.kinematics.state_space import LAG, LAG_SPREAD, add_noise

Array = NDArray[np.float64]
ORDER = 4  # of all states here, so that the loops are unrolled: of one of order 3 the last element is 0 and stays so


@compiled
def advance(x: Array, step: float) -> None:
    """Multiply the leading axis of ``x`` (m, n) by the transition matrix of ``step``, in place."""
    m = ORDER
    for i in range(m):
        c = 1.0
        for j in range(i + 1, m):
            c *= step / (j - i)
            for k in range(x.shape[1]):
                x[i, k] += c * x[j, k]


@compiled
def retreat(x: Array, step: float) -> None:
    """Multiply the leading axis of ``x`` (m, n) by the transposed transition matrix of ``step``, in place."""
    m = ORDER
    for i in range(m - 1, -1, -1):
        c = 1.0
        for j in range(i - 1, -1, -1):
            c *= step / (i - j)
            for k in range(x.shape[1]):
                x[i, k] += c * x[j, k]


@compiled
def triangular(wide: Array, S: Array) -> None:
    """Write into ``S`` the lower triangular root of A Aᵀ, A = ``wide`` (m, n ≥ m), which is spent."""
    m, n = ORDER, wide.shape[1]
    for i in range(m):
        for j in range(m):
            S[i, j] = 0.0
        for j in range(i):
            part = 0.0
            for k in range(n):
                part += wide[i, k] * wide[j, k]
            S[i, j] = part
            for k in range(n):
                wide[i, k] -= part * wide[j, k]
        size = 0.0
        for k in range(n):
            size += wide[i, k] ** 2
        S[i, i] = math.sqrt(size)
        if size > 0.0:
            for k in range(n):
                wide[i, k] /= S[i, i]


@compiled
def unit_root(m: int) -> Array:
    """Return the lower triangular root (4, 4) of the process noise of order ``m``, density 1, over a step of 1."""
    own, unit = np.zeros((m, m)), np.zeros((ORDER, ORDER))
    add_noise(own, 1.0, 1.0)
    unit[:m, :m] = np.linalg.cholesky(own)
    return unit


@compiled
def scale_noise(unit: Array, step: float, q: float, noise: Array) -> None:
    """Write into ``noise`` the root of the process noise of density ``q`` over ``step``: ``unit`` with scaled rows."""
    factor = math.sqrt(q * step)
    for i in range(ORDER - 1, -1, -1):
        for j in range(ORDER):
            noise[i, j] = unit[i, j] * factor
        if unit[i, i] > 0.0:  # the noise drives the last element that there is
            factor *= step


@compiled
def widen(S: Array, noise: Array, wide: Array) -> None:
    """Make ``S`` the root of S Sᵀ + noise noiseᵀ, in place; ``wide`` (m, 2m) is working space."""
    m = ORDER
    for i in range(m):
        for j in range(m):
            wide[i, j] = S[i, j]
            wide[i, m + j] = noise[i, j]
    triangular(wide, S)


@compiled
def take_in(x: Array, S: Array, value: float, variance: float) -> None:
    """Take one measurement of the position into mean ``x`` and root ``S``, in place (Potter)."""
    m = ORDER
    f = S[0].copy()
    total = variance
    for k in range(m):
        total += f[k] ** 2
    innovation = value - x[0]
    shrink = 1.0 / (total * (1.0 + math.sqrt(variance / total)))
    for i in range(m):
        gain = 0.0
        for k in range(m):
            gain += S[i, k] * f[k]
        x[i] += gain * innovation / total
        for k in range(m):
            S[i, k] -= shrink * gain * f[k]


@compiled
def jump_root(law: Array, strength: float, node: Array, m: int, root: Array) -> None:
    """Write into ``root`` that of what the jumps at an event (a row of ``nodes``) add to one of order ``m``."""
    root[:] = 0.0
    root[0, 0] = math.sqrt(node[2])
    root[2, 2] = strength * law[3]
    root[1, 2] = -LAG * law[6] * root[2, 2]
    root[1, 1] = math.sqrt(node[1] + (LAG_SPREAD * law[6] * root[2, 2]) ** 2)
    if m > 3:
        root[3, 3] = strength * law[4]


@compiled
def forget(z: Array, R: Array, noise: Array) -> None:
    """Take from the information (vector ``z``, root ``R``) what ``noise`` (root of its covariance) hides, in place."""
    m = ORDER
    f = np.empty(m)
    for c in range(m):
        total, seen = 1.0, 0.0
        for k in range(m):
            f[k] = 0.0
            for i in range(m):
                f[k] += R[i, k] * noise[i, c]
            total += f[k] ** 2
        for i in range(m):
            seen += noise[i, c] * z[i]
        shrink = 1.0 / (total * (1.0 + math.sqrt(1.0 / total)))
        for i in range(m):
            gain = 0.0
            for k in range(m):
                gain += R[i, k] * f[k]
            z[i] -= gain * seen / total
            for k in range(m):
                R[i, k] -= shrink * gain * f[k]


@compiled
def recall(z: Array, R: Array, step: float, noise: Array) -> None:
    """Carry information (``z`` (m, 1), ``R``) back over ``step`` with process noise of root ``noise``, in place."""
    if step > 0.0:
        if noise[0, 0] > 0.0:
            forget(z[:, 0], R, noise)
        retreat(z, step)
        retreat(R, step)


@compiled
def join(x: Array, S: Array, z: Array, R: Array, work: Array) -> None:
    """Make ``x`` the mean and ``S`` the covariance of what (``x``, ``S``) and information (``z``, ``R``) know.

    ``work`` (2, m, m) is working space.
    """
    m = ORDER
    W, M = work[0], work[1]
    for i in range(m):
        for j in range(m):
            W[i, j] = 0.0
            for k in range(m):
                W[i, j] += R[k, i] * S[k, j]
    for i in range(m):
        for j in range(i + 1):
            total = 1.0 if i == j else 0.0
            for k in range(m):
                total += W[k, i] * W[k, j]
            for k in range(j):
                total -= M[i, k] * M[j, k]
            M[i, j] = math.sqrt(total) if i == j else total / M[j, j]
    # rows of W become those of S M⁻ᵀ, so that V = W Wᵀ
    for i in range(m):
        for j in range(m):
            total = S[i, j]
            for k in range(j):
                total -= W[i, k] * M[j, k]
            W[i, j] = total / M[j, j]
    off = M[0]
    for i in range(m):
        off[i] = z[i]
        for k in range(m):
            seen = 0.0
            for j in range(m):
                seen += R[j, k] * x[j]
            off[i] -= R[i, k] * seen
    for i in range(m):
        for j in range(m):
            S[i, j] = 0.0
            for k in range(m):
                S[i, j] += W[i, k] * W[j, k]
    for i in range(m):
        for j in range(m):
            x[i] += S[i, j] * off[j]
