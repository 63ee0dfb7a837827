"""The tilt that an outline asks for when it was fitted with its tilt held: one linearised step from the residuals.

Left and right of an upright ellipse answer to a tilt with opposite signs, so a tilt that is not known does stretch and
lowest point little harm, and leaving it free in every frame would only widen the sideways position. One step at the
end of the fit says as much: the same normal equations with one column more.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import J
from wentry_cli.contours.discrepancy import concluded
from wentry_cli.contours.global_step import advance, step_from
from wentry_cli.contours.normal_equations import factorise, substitute
from wentry_cli.contours.nuisances import Belief
from wentry_cli.contours.ray_scatter import TUKEY, scan_covariance

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STRETCH, TILT = 3, 4
# Entries of a turn: the step and its standard uncertainty (rad), then how the five parameters answer to a tilt (per
# rad); NaN where the outline does not tell it.
STEP, UNC, ANSWER, TURN = 0, 1, 2, 7


@compiled
def no_turn() -> Floats:
    """A turn that is not identified."""
    turn = np.full(TURN, math.nan)
    turn[ANSWER:] = 0.0
    return turn


@compiled
def with_tilt(free: Ints) -> Ints:
    """The free parameters and the tilt, which is the last of all."""
    longer = np.empty(free.size + 1, dtype=np.int64)
    longer[: free.size] = free
    longer[free.size] = TILT
    return longer


@compiled
def wants_tilt(free: Ints) -> bool:
    """Whether the tilt was held in a fit that knows a stretch: a circle has none."""
    stretched, held = False, True
    for index in free:
        stretched = stretched or index == STRETCH
        held = held and index != TILT
    return stretched and held


@compiled
def turn_of(step: float, covariance: Floats, free: Ints) -> Floats:
    """Gather a turn from the step and the covariance of the free parameters with the tilt behind them."""
    turn = no_turn()
    size = free.size
    variance = covariance[size, size]
    if not (variance > 0.0 and math.isfinite(variance) and math.isfinite(step)):
        return turn
    turn[STEP], turn[UNC] = step, math.sqrt(variance)
    for i in range(size):
        turn[ANSWER + free[i]] = covariance[i, size] / variance
    turn[ANSWER + TILT] = 1.0
    return turn


@compiled
def pixel_turn(verdict: Floats, rows: Floats, scene: Floats, free: Ints, moved: Floats, belief: Belief) -> Floats:
    """The turn of a fit to pixels, from its verdict on the sectors."""
    longer = with_tilt(free)
    step, factor = step_from(verdict, rows, longer, scene, moved, belief)
    if factor.size == 0:
        return no_turn()
    after = verdict.copy()
    advance(after, rows, longer, scene, step)
    return turn_of(step[longer.size - 1], concluded(after, factor, rows, longer, scene)[0], free)


@compiled
def ray_turn(off: Floats, rays: Floats, free: Ints, scale: float) -> Floats:
    """The turn of a fit to edges along rays, from its residuals ``off[:, 0]`` (px) and their robust scale."""
    longer = with_tilt(free)
    size, number = longer.size, rays.shape[0]
    normal, right, weight = np.zeros((size, size)), np.zeros(size), np.zeros(number)
    for k in range(number):
        z = off[k, 0] / (TUKEY * scale)
        weight[k] = (1.0 - z * z) ** 2 if abs(z) < 1.0 else 0.0
        for i in range(size):
            row = weight[k] * rays[k, J + longer[i]]
            right[i] += row * off[k, 0] if weight[k] > 0.0 else 0.0
            for j in range(i + 1):
                normal[i, j] += row * rays[k, J + longer[j]]
    if not factorise(normal):
        return no_turn()
    substitute(normal, right)
    after = off[:, :1].copy()
    before, left = 0.0, 0.0
    for k in range(number):
        for i in range(size):
            after[k, 0] -= rays[k, J + longer[i]] * right[i]
        if weight[k] > 0.0:
            before += weight[k] * off[k, 0] ** 2
            left += weight[k] * after[k, 0] ** 2
    scale *= math.sqrt(left / max(before, 1e-12))
    return turn_of(right[size - 1], scan_covariance(after, rays, longer, normal, scale), free)
