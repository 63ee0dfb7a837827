"""The empty scene: what each pixel shows without the sphere, built from frames in which the sphere moves about."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled


def sample_indices(count: int, limit: int = 28) -> list[int]:
    """Choose at most ``limit`` of ``count`` frames, densest at the start where the sphere still flies."""
    if count <= limit:
        return list(range(count))
    spread = (count - 1) * np.linspace(0.0, 1.0, limit) ** 2
    chosen: list[int] = []
    for index in np.round(spread):
        chosen.append(max(int(index), chosen[-1] + 1) if chosen else 0)
    return chosen


def relative_noise(samples: NDArray[Any]) -> float:
    """Standard deviation of bright pixels from frame to frame over their level, from a coarse grid; 0 where clipped.

    The median of absolute differences of consecutive samples ignores the few pixels over which something moved.
    """
    grid = np.asarray(samples[:, ::9, ::9], dtype=np.float32)
    if len(grid) < 2:
        return 0.0
    level = np.max(grid, axis=0)
    bright = level >= 0.7 * np.percentile(level, 80)
    steps = np.abs(np.diff(grid, axis=0))[:, bright]
    return float(1.4826 * np.median(steps / level[bright]) / np.sqrt(2.0))


@compiled
def _clean_mean(samples: NDArray[Any], tolerance: float, level: NDArray[np.float32]) -> None:
    count, rows, columns = samples.shape
    values = np.empty(count, np.float32)
    for row in range(rows):
        for column in range(columns):
            known = 0
            first = second = third = np.float32(0.0)
            for index in range(count):
                value = np.float32(samples[index, row, column])
                if value > 0:
                    values[known] = value
                    known += 1
                    if value > first:
                        first, second, third = value, first, second
                    elif value > second:
                        second, third = value, second
                    elif value > third:
                        third = value
            if known == 0:
                level[row, column] = np.nan
                continue
            bound = first * (1.0 - tolerance)
            top = third if third >= bound else (second if second >= bound else first)
            bound = top * (1.0 - tolerance)
            total = 0.0
            used = 0
            for index in range(known):
                if values[index] >= bound:
                    total += values[index]
                    used += 1
            level[row, column] = total / used


def clean_level(samples: NDArray[Any], noise: float) -> NDArray[np.float32]:
    """Level of the empty scene: per pixel the mean of the samples that are as bright as the third brightest.

    ``samples`` is (frames, rows, columns) of grey levels, 0 where a sample is known to be covered; ``noise`` is
    relative. Samples darker than those by more than 4.5 standard deviations show something else (sphere, cavity,
    droplets) and are left out, so that one clean sample is enough and many give an unbiased mean. NaN where every
    sample is covered.
    """
    level = np.empty(samples.shape[1:], np.float32)
    _clean_mean(samples, max(4.5 * noise, 0.02), level)
    return level


def fill_holes(level: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fill the pixels that were never seen (NaN) with a quadratic surface fitted to their surroundings."""
    unknown = np.isnan(level)
    if not unknown.any() or unknown.all():
        return level
    filled = level.copy()
    count, labels, stats, _ = cv2.connectedComponentsWithStats(unknown.astype(np.uint8))
    for label in range(1, count):
        left, top, width, height = (int(value) for value in stats[label][:4])
        margin = max(6, width // 4, height // 4)
        rows = slice(max(0, top - margin), top + height + margin)
        columns = slice(max(0, left - margin), left + width + margin)
        block = level[rows, columns]
        filled[rows, columns] = np.where(labels[rows, columns] == label, _quadratic(block), filled[rows, columns])
    return filled


def _quadratic(block: NDArray[np.float32]) -> NDArray[np.float32]:
    y, x = np.mgrid[-1 : 1 : block.shape[0] * 1j, -1 : 1 : block.shape[1] * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    known = ~np.isnan(block)
    bright = known & (block > 0.7 * np.nanpercentile(block, 80)) if known.any() else known
    if np.count_nonzero(bright) < 30:
        return np.full(block.shape, np.nanmean(block) if known.any() else 1.0, np.float32)
    coefficients = np.linalg.lstsq(terms[bright], block[bright].astype(np.float64), rcond=None)[0]
    return np.asarray(terms @ coefficients, np.float32)
