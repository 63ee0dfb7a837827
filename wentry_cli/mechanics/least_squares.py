"""Levenberg–Marquardt within bounds for a model that sometimes cannot be evaluated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wentry_cli.mechanics.bergstrom_boyce import FloatArray

Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray] | None]
MOST_STEPS = 60
STILL = 1e-7  # step over scale at which the search has ended
FLAT = 1e-10  # relative gain of the cost at which it has ended


@dataclass(frozen=True)
class Minimum:
    """Parameters, residuals and Jacobian at the minimum; ``converged`` is False where the steps ran out."""

    x: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    steps: int
    converged: bool


def minimise(
    evaluate: Evaluate, start: FloatArray, bounds: tuple[FloatArray, FloatArray], scale: FloatArray
) -> Minimum:
    """Minimise the sum of squares of ``evaluate(x) = (residual, jacobian)`` from ``start`` (p) within ``bounds``.

    ``scale`` (p) is a natural step of each parameter; no step is longer than twelve of them. Where ``evaluate`` returns
    None the step is shortened. Raises ``ValueError`` if it returns None at the start.
    """
    x = np.clip(start, *bounds)
    found = evaluate(x)
    if found is None:
        raise ValueError("the model cannot be evaluated at the start")
    residual, jacobian = found
    damping = 1e-2
    for step in range(MOST_STEPS):
        weighted = jacobian * scale
        normal = weighted.T @ weighted
        limit = damping * np.maximum(np.diag(normal), 1e-12 * np.trace(normal))
        move = -np.linalg.solve(normal + np.diag(limit), weighted.T @ residual)
        move *= min(1.0, 12.0 / max(float(np.max(np.abs(move))), 1e-300))
        trial = np.clip(x + move * scale, *bounds)
        tried = evaluate(trial)
        cost = float(residual @ residual)
        new_cost = np.inf if tried is None else float(tried[0] @ tried[0])
        small = float(np.max(np.abs((trial - x) / scale))) < STILL
        if tried is not None and new_cost <= cost:
            x, (residual, jacobian) = trial, tried
            damping = max(damping * 0.1, 1e-12)
            if small or cost - new_cost <= FLAT * cost:
                return Minimum(x, residual, jacobian, step + 1, True)
        elif small or damping > 1e12:
            return Minimum(x, residual, jacobian, step + 1, True)
        else:
            damping = max(damping * 8.0, 1e-6)
    return Minimum(x, residual, jacobian, MOST_STEPS, False)
