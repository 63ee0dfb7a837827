"""How much a frame blurs the walls of the cavity, from how steeply they darken."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.region import Region, transmission
from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]

EVERY = 4  # rows: enough of them for a median
STEEPEST_LEAN = 1.0  # px per row: where a wall leans more, hardly anything is left of its own blur
THICK_PX = 4.0  # a wall that darkens as far as it can
FEWEST_EDGES = 12
SHARPEST_PX, SOFTEST_PX = 0.25, 5.0
MOST_STEPS, CLOSE = 12, 1e-4  # of Newton's method, which at least doubles the right digits; relative
TYPICAL_PX = 1.0  # where no wall tells it


@compiled
def measure_blur(region: Region, edges: tuple[Floats, Floats, Floats], light: tuple[float, float]) -> float:
    """Standard deviation of the blur of lens and pixel, px: the median over the walls in ``region``.

    ``edges`` are the left and the right edge of every row, px, NaN where not seen, and the thickness of its thinner
    wall; ``light`` is the level of the ground and that of the dark. ``TYPICAL_PX`` where too few walls are thick.
    """
    left, right, wall = edges
    found, count = np.empty(2 * left.size), 0
    for row in range(1, left.size - 1, EVERY):
        if wall[row] < THICK_PX:
            continue
        for side in range(2):
            edge, step = (left, -1) if side == 0 else (right, 1)
            lean = 0.5 * (edge[row + 1] - edge[row - 1])
            if not abs(lean) <= STEEPEST_LEAN:
                continue
            blur = _blur_across(region, row, edge[row], step, light)
            if not math.isnan(blur):
                found[count] = blur / math.sqrt(1.0 + lean * lean)
                count += 1
    return median_of(found, count) if count >= FEWEST_EDGES else TYPICAL_PX


@compiled
def _blur_across(region: Region, row: int, edge: float, step: int, light: tuple[float, float]) -> float:
    """Blur of an edge along its row from the two pixels about it; outside lies towards ``step``."""
    inner = math.floor(edge) if step > 0 else math.ceil(edge)
    outer = inner + step
    if min(inner, outer) < 0 or max(inner, outer) >= region.columns:
        return math.nan
    rise = (transmission(region, row, outer) - transmission(region, row, inner)) / (light[0] - light[1])
    return _blur_of(rise, abs(edge - inner), abs(outer - edge)) if 0.0 < rise < 1.0 else math.nan


@compiled
def _blur_of(rise: float, within: float, beyond: float) -> float:
    """Blur with which an edge rises by ``rise`` between two points so far from it; NaN where it is out of bounds.

    Newton's method for the reciprocal of the blur: the rise is concave in it, so that each step falls short.
    """
    sharpness = rise * math.sqrt(2.0 * math.pi) / (within + beyond)
    for _ in range(MOST_STEPS):
        short = rise - _share(within * sharpness) - _share(beyond * sharpness)
        slope = within * _density(within * sharpness) + beyond * _density(beyond * sharpness)
        sharpness += short / slope
        if not short > CLOSE * slope * sharpness:
            break
    return 1.0 / sharpness if SHARPEST_PX < 1.0 / sharpness < SOFTEST_PX else math.nan


@compiled
def _density(distance: float) -> float:
    """Density of a standard normal deviate."""
    return math.exp(-0.5 * distance * distance) / math.sqrt(2.0 * math.pi)


@compiled
def _share(distance: float) -> float:
    """What a blurred edge rises from its middle to ``distance``, in standard deviations, as a share of its height."""
    return 0.5 * math.erf(distance / math.sqrt(2.0))
