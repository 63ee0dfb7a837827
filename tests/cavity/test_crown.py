"""Width of the crown's rim in drawn side views."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.crown import rim_width
from wentry_cli.imaging.patch import Patch


def crown(rim: float, *, height: int = 60, mouth: float = 80.0, droplet: bool = False) -> Patch:
    """A translucent film between a mouth at the last row and a rim ``height`` rows above it, axis at column 100."""
    rows, columns = 120, 200
    y, x = np.mgrid[:rows, :columns]
    share = (rows - 1 - y) / height
    half = 0.5 * (mouth + (rim - mouth) * share)
    image = np.where((np.abs(x - 100.0) < half) & (share <= 1.0), 0.5, 1.0)
    if droplet:
        image[(x - 103.0) ** 2 + (y - 30.0) ** 2 < 20.0] = 0.1
    noise = np.random.default_rng(0).normal(0.0, 0.02, image.shape)
    return Patch((image + noise).astype(np.float32), x0=40, y0=10, noise_floor=0.02)


@pytest.mark.parametrize("rim", [120.0, 60.0, 20.0])
@pytest.mark.parametrize("droplet", [False, True])
def test_width_at_the_rim(rim: float, droplet: bool) -> None:
    assert rim_width(crown(rim, droplet=droplet), 140.0) == pytest.approx(rim, abs=3.0)


def test_nothing_over_the_axis_is_nan() -> None:
    assert np.isnan(rim_width(Patch(np.ones((50, 80), np.float32)), 40.0))
    assert np.isnan(rim_width(crown(60.0), 45.0))
    assert np.isnan(rim_width(crown(60.0, height=2), 140.0))
