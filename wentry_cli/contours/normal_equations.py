"""Small symmetric systems, solved where the loops are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]


@compiled
def factorise(matrix: Floats) -> bool:
    """Cholesky factor in the lower triangle, in place; False where the matrix is not positive definite."""
    size = matrix.shape[0]
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for m in range(j):
                total -= matrix[i, m] * matrix[j, m]
            if i == j:
                if not total > 1e-14 * abs(matrix[i, i]):
                    return False
                matrix[i, i] = math.sqrt(total)
            else:
                matrix[i, j] = total / matrix[j, j]
    return True


@compiled
def substitute(factor: Floats, right: Floats) -> None:
    """Solve in place for one right-hand side with the factor from `factorise`."""
    size = factor.shape[0]
    for i in range(size):
        total = right[i]
        for m in range(i):
            total -= factor[i, m] * right[m]
        right[i] = total / factor[i, i]
    for i in range(size - 1, -1, -1):
        total = right[i]
        for m in range(i + 1, size):
            total -= factor[m, i] * right[m]
        right[i] = total / factor[i, i]


@compiled
def solve(matrix: Floats, right: Floats) -> bool:
    """Solve matrix @ x = right in place of both; False where the matrix is not positive definite."""
    if not factorise(matrix):
        return False
    substitute(matrix, right)
    return True


@compiled
def invert_block(factor: Floats, size: int, inflation: float) -> Floats:
    """First ``size`` rows and columns of the inverse, from the Cholesky factor, times ``inflation``."""
    covariance = np.empty((size, size))
    unit = np.empty(factor.shape[0])
    for j in range(size):
        unit[:] = 0.0
        unit[j] = 1.0
        substitute(factor, unit)
        for i in range(size):
            covariance[i, j] = inflation * unit[i]
    return covariance
