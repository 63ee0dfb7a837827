"""Grey levels of the ground, of the dark walls and of black in a region."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.region import Region, transmission, was_read
from wentry_cli.compiled import compiled
from wentry_cli.imaging.order_statistics import linear_quantile

SAMPLE = 2000  # pixels that tell the levels
GROUND_EVERY = 4  # of them: there is far more ground than is needed
# Between black (0) and the ground (1): what is brighter than the first is ground, darker than the second dark, and a
# wall brighter than the third is no wall. Where hardly anything is dark beside black, the sphere itself is black.
BRIGHT, DARK, DARKEST_USEFUL = 0.7, 0.6, 0.75
FAINTEST_SPHERE, HARDLY_ANY = 0.9, 0.05
FAINTEST = 0.25  # of the contrast: what is darker than that belongs to a wall, however thin


@compiled
def find_levels(region: Region, sphere: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return the level of the ground (its upper half), of the dark walls and of black, from some thousands of pixels.

    ``sphere`` as in `find_body`.
    """
    rows, columns = region.levels.shape[0], region.columns
    read = rows - (region.unread[1] - region.unread[0])
    apart = max(4, int(math.sqrt(read * columns / SAMPLE)))
    sample = np.empty(((rows + apart - 1) // apart) * ((columns + apart - 1) // apart), np.float32)
    seen = 0
    for row in range(0, rows, apart):
        if not was_read(region, row):
            continue
        for column in range(0, columns, apart):
            value = transmission(region, row, column)
            if np.isfinite(value):
                sample[seen] = value
                seen += 1
    if seen < 50:
        return 1.0, 1.0, 0.0
    ground, dark, share = _split(sample[:seen], 0.0)
    if share > HARDLY_ANY:
        return ground, dark, 0.0
    black = _level_within(region, sphere)
    if not black < FAINTEST_SPHERE:
        return ground, dark, 0.0
    ground, dark, _ = _split(sample[:seen], black)
    return ground, dark, black


@compiled
def _split(sample: NDArray[np.float32], black: float) -> tuple[float, float, float]:
    """Levels of ground and dark of a sample, equal where next to nothing is dark, and the share that is."""
    part, count = np.empty_like(sample), 0
    for value in sample[::GROUND_EVERY]:
        part[count] = value  # one that does not count is written over
        count += 1 if value > black + BRIGHT * (1.0 - black) else 0
    ground = linear_quantile(part, count, 0.5) if count else 1.0
    count = 0
    for value in sample:
        part[count] = value
        count += 1 if value < (black + DARK * (1.0 - black)) * ground else 0
    return ground, linear_quantile(part, count, 0.3) if count >= 8 else ground, count / sample.size


@compiled
def _level_within(region: Region, sphere: tuple[int, int, int]) -> float:
    """Mean level of the sphere about its centre; 1 where it is not in the region."""
    axis, reach, equator = sphere
    total, count = 0.0, 0
    for row in range(max(equator - reach, 0), min(equator + 1, region.levels.shape[0])):
        for column in range(max(axis - reach, 0), min(axis + reach + 1, region.columns)):
            value = transmission(region, row, column)
            if np.isfinite(value):
                total += value
                count += 1
    return total / count if count else 1.0


@compiled
def faint_level(ground: float, dark: float, noise: float) -> float:
    """Level below which a pixel counts as dark: a quarter of the contrast, or five standard deviations of noise."""
    return ground - min(max(FAINTEST * (ground - dark), 5.0 * noise), 0.5 * (ground - dark))
