"""The oscillation in extended precision: Gragg's extrapolated midpoint rule, independent of the solver that it judges.

State (λ, dλ/dt*, ln λ_p) in ``numpy.longdouble``, 18 digits where the machine has them; no event, no interpolation:
the integration stops at each time that is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.mechanics.bergstrom_boyce import Groups

Extended = np.longdouble
State = NDArray[Any]

COLUMNS = 8  # of the extrapolation: order 16
TOLERANCE = max(1e-16, 50.0 * float(np.finfo(np.longdouble).eps))
MOST_STEPS = 60_000


def right_side(groups: Groups) -> Callable[[State], State]:
    """Time derivative of (λ, dλ/dt*, ln λ_p); the equations of docs/theory.md in another form than the solver's."""
    ratio, flow, n, m, xi = (Extended(value) for value in groups.values)
    one, root = Extended(1), np.sqrt(Extended(3))

    def derivative(y: State) -> State:
        stretch, rate, creep = y
        x = np.expm1(2 * creep)
        excess = x * x * (2 * x + 3) / (1 + x) ** 2
        elastic = np.log(stretch) - creep
        s = np.exp(-4 * elastic) * np.expm1(6 * elastic)
        c = excess / (np.sqrt(3 + excess) + root) + xi
        slip = flow * c**n * np.abs(s) ** m * np.sign(s) if flow > 0 and s != 0 else 0 * one
        force = 6 * rate * rate / stretch**7 - 5 * (stretch - stretch**-5 + ratio * s / stretch)
        return np.array([rate, force / (1 + 2 / stretch**6), slip])

    return derivative


def solve(groups: Groups, stretch_0: float, viscous_0: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """λ at the rising dimensionless ``times``; NaN from where ``MOST_STEPS`` were spent."""
    derivative = right_side(groups)
    y = np.array([Extended(stretch_0), Extended(0), np.log(Extended(viscous_0))])
    t, step, spent, found = Extended(0), Extended(0.05 / math.sqrt(1.0 + groups.stiffness_ratio)), 0, []
    for end in times:
        while t < end and spent < MOST_STEPS:
            spent += 1
            h = min(step, Extended(end) - t)
            new, error = _extrapolate(derivative, y, h)
            if error <= 1.0:
                t, y = t + h, new
            factor = 0.9 * max(error, 1e-12) ** (-1.0 / (2 * COLUMNS - 1)) if math.isfinite(error) else 0.25
            if error > 1.0 or h == step:
                step = h * Extended(min(max(factor, 0.1), 3.0))
        found.append(float(y[0]) if t >= end else math.nan)
    return np.array(found)


def _extrapolate(derivative: Callable[[State], State], y: State, h: np.longdouble) -> tuple[State, float]:
    """One step by the midpoint rule with 2, 4, … parts, extrapolated in h²; and its error, 1 at the tolerance."""
    slope = derivative(y)
    line: list[State] = []
    with np.errstate(all="ignore"):
        for k in range(1, COLUMNS + 1):
            parts = 2 * k
            part = h / parts
            before, now = y, y + part * slope
            for _ in range(parts - 1):
                before, now = now, before + 2 * part * derivative(now)
            fresh: list[State] = [(now + before + part * derivative(now)) / 2]
            for j in range(1, k):
                fresh.append(
                    fresh[j - 1] + (fresh[j - 1] - line[j - 1]) / (Extended(k) ** 2 / Extended(k - j) ** 2 - 1)
                )
            line, previous = fresh, line
        error = float(np.max(np.abs(line[-1] - previous[-1]) / (TOLERANCE * (1 + np.abs(line[-1])))))
    return line[-1], error if math.isfinite(error) else math.inf
