"""The mean of clean samples, against the same in plain words, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.imaging.clean_mean import BLOCK_PX, clean_mean

TOLERANCE = 0.05


def plain(values: NDArray[np.float64], clear: NDArray[np.bool_]) -> float:
    """Of one pixel."""
    ordered = np.sort(values)[::-1]
    bright = next(level for level in [*ordered[2::-1], 0.0] if level >= (1.0 - TOLERANCE) * ordered[0])
    good = (values >= (1.0 - TOLERANCE) * bright) & (values > 0.0)
    good = good & clear if (good & clear).any() else good
    return float(values[good].mean()) if good.any() else np.nan


@pytest.mark.parametrize("flickers", [False, True])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 9, 16])
def test_it_is_the_mean_of_what_is_neither_dark_nor_shaded(count: int, kind: type, flickers: bool) -> None:
    rng = np.random.default_rng(count)
    shape = (count, 70, 301)
    samples = (200.0 * (1.0 + 0.02 * rng.normal(size=shape))).astype(kind)
    samples[rng.random(shape) < 0.05] //= 2
    samples[:, 5, 7] = 0  # covered in all
    samples[0, 20:40, 60:90] = 0
    lit = np.ones((count, -(-shape[1] // BLOCK_PX), -(-shape[2] // BLOCK_PX)), np.float32)
    lit[rng.random(lit.shape) < 0.01] = 0.0
    lit[:, 3, 4] = 0.0  # shaded in all
    light = np.linspace(0.9, 1.1, count, dtype=np.float32) if flickers else np.ones(count, np.float32)
    level = clean_mean(samples, light, lit, TOLERANCE)
    clear = np.repeat(np.repeat(lit > 0.0, BLOCK_PX, 1), BLOCK_PX, 2)[:, : shape[1], : shape[2]]
    even = samples * (np.float32(1.0) / light)[:, None, None]
    rows, columns = np.indices(shape[1:]).reshape(2, -1)
    expected = [plain(even[:, row, column], clear[:, row, column]) for row, column in zip(rows, columns, strict=True)]
    np.testing.assert_allclose(level.ravel(), expected, rtol=3e-6)
