"""The dark wedge between a sphere that lets light through and the wall of the cavity, and what it does to their edge.

Along a ray from the sphere outwards the light falls from the level of the sphere to that of the wall, and rises to that
of the ground where the wall ends. As long as the wedge is no wider than the matched filter, its inner step pulls the
peak of the outer one outwards. Both are blurred steps, whose responses are known; so the inner one can be taken away.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.edges import KERNEL_SIGMA_PX

Floats = NDArray[np.float64]

# The sphere's own level is read this far inside of its edge along a ray, clear of blur.
INSIDE_PX = 6.0
# A ray leaves the sphere half-way between normal and tangent: along it the edge of the sphere is less steep.
SLANTED = math.sqrt(2.0)
# Nobody knows exactly how light falls off in a wedge: of what is taken away so much may be wrong.
DOUBT = 0.25
ROUNDS, SETTLED_PX = 12, 0.001


@compiled
def level_on(values: NDArray[np.float32], ray: Floats, at: float) -> float:
    """Grey level between pixels, ``at`` px along a ray (x, y, direction); NaN outside of the picture."""
    x, y = ray[0] + at * ray[2], ray[1] + at * ray[3]
    if not (0.0 <= x < values.shape[1] - 1.0 and 0.0 <= y < values.shape[0] - 1.0):
        return math.nan
    i, j = int(y), int(x)
    fy, fx = y - i, x - j
    upper = values[i, j] + fx * (values[i, j + 1] - values[i, j])
    lower = values[i + 1, j] + fx * (values[i + 1, j + 1] - values[i + 1, j])
    return float(upper + fy * (lower - upper))


@compiled
def wedge_step(values: NDArray[np.float32], rays: Floats, inner: float, outer: Floats, blur: float) -> float:
    """By how much the sphere is lighter than the wall, as a share of the step from the wall to the ground.

    On each ray (x, y, direction) the sphere ends at ``inner`` and the wall at ``outer`` (px, NaN where not seen).
    The wall's level is that in the middle of the widest wedges, freed from what ``blur`` lets in from both sides.
    0 where neither level is seen.
    """
    widest = 0.0
    for n in range(outer.size):
        widest = max(widest, outer[n] - inner)
    sphere, number = 0.0, 0
    for n in range(outer.size):
        if outer[n] - inner > 0.5 * widest:
            level = level_on(values, rays[n], inner - INSIDE_PX)
            if not math.isnan(level):
                sphere, number = sphere + level, number + 1
    if number == 0:
        return 0.0
    sphere /= number
    wall, weight = 0.0, 0.0
    for n in range(outer.size):
        wide = outer[n] - inner
        if not wide > 0.5 * widest:
            continue
        level = level_on(values, rays[n], inner + 0.5 * wide)
        if not math.isnan(level):
            by_ground = 0.5 * math.erfc(0.5 * wide / (blur * math.sqrt(2.0)))
            by_sphere = 0.5 * math.erfc(0.5 * wide / (SLANTED * blur * math.sqrt(2.0)))
            clear = 1.0 - by_ground - by_sphere
            wall += clear * (level - by_ground - by_sphere * sphere)
            weight += clear * clear
    if not weight > 0.0:
        return 0.0
    dark = max(0.0, wall / weight)
    return (sphere - dark) / max(0.1, 1.0 - dark)


@compiled
def most_shift(step: float) -> float:
    """The farthest that a wedge with a ``step`` (see `wedge_step`) can pull an edge outwards, px."""
    return step * KERNEL_SIGMA_PX * math.exp(-0.5)


@compiled
def wedge_shift(step: float, away: float, blur: float) -> float:
    """How far outwards an edge seen ``away`` px from that of the sphere has been pulled by a wedge.

    Where the responses to the two steps have opposite slopes: the peak, with both of them Gaussian.
    """
    one = math.hypot(KERNEL_SIGMA_PX, blur)
    other = math.hypot(KERNEL_SIGMA_PX, SLANTED * blur)
    lower = step * away * (one / other) ** 3 * math.exp(-0.5 * (away / other) ** 2)
    shift = 0.0
    for _ in range(ROUNDS):
        before, shift = shift, lower * math.exp(0.5 * (shift / one) ** 2)
        if not shift < away:
            return max(0.0, away)
        if abs(shift - before) < SETTLED_PX:
            break
    return max(0.0, shift)
