"""Least-squares polynomials through a few rows of a wall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.normal_equations import solve

Floats = NDArray[np.float64]


@compiled
def fit_polynomial(rows: Floats, values: Floats, degree: int) -> Floats:
    """Coefficients, constant first, of the least-squares polynomial; NaN where the rows do not determine it."""
    scale = max(np.abs(rows).max(), 1.0)
    normal, right = np.zeros((degree + 1, degree + 1)), np.zeros(degree + 1)
    powers = np.empty(degree + 1)
    for n in range(rows.size):
        powers[0] = 1.0
        for i in range(degree):
            powers[i + 1] = powers[i] * rows[n] / scale
        for i in range(degree + 1):
            right[i] += powers[i] * values[n]
            for j in range(degree + 1):
                normal[i, j] += powers[i] * powers[j]
    if not solve(normal, right):
        right[:] = np.nan
    for i in range(degree + 1):
        right[i] /= scale**i
    return right


@compiled
def value_of(coefficients: Floats, at: float) -> float:
    """Value of a polynomial, constant first."""
    total = 0.0
    for i in range(coefficients.size - 1, -1, -1):
        total = total * at + coefficients[i]
    return total


@compiled
def slope_of(coefficients: Floats, at: float) -> float:
    """Slope of a polynomial, constant first."""
    total = 0.0
    for i in range(coefficients.size - 1, 0, -1):
        total = total * at + i * coefficients[i]
    return total
