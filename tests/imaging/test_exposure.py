"""Sums of grey levels against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.imaging.exposure import sum_and_clipped


@pytest.mark.parametrize(("kind", "scale"), [(np.uint8, 255), (np.uint16, 4095), (np.uint16, 65535)])
def test_sum_and_clipped(kind: type, scale: int) -> None:
    levels = np.random.default_rng(1).integers(scale // 2, scale + 1, (7, 300)).astype(kind)
    levels[2, :9] = scale
    assert sum_and_clipped(levels, scale) == (int(levels.sum(dtype=np.int64)), int((levels >= scale).sum()))


def test_the_brightest_row_does_not_overflow() -> None:
    levels = np.full((2, 65_535), 65_535, np.uint16)
    assert sum_and_clipped(levels, 65_535) == (2 * 65_535**2, 2 * 65_535)
