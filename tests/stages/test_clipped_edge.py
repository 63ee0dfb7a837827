"""What a clipped ground leaves unknown of the edge is in the row of y = 0, and so in heights and impact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import pytest

from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.stages.track import _noise
from wentry_cli.stages.track.scales import with_clipped_edge
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius


@dataclass
class _Ground:
    ceiling: float
    noise: float = 0.0


def test_a_clipped_edge_widens_the_row_of_the_surface() -> None:
    row, radius = SurfaceRow(180.0, 0.02, 3.0, 0.5, "ok"), PooledRadius(46.0, 0.01, 9, 0.0)
    clipped, plain = cast("Any", _Ground(255.0)), cast("Any", _Ground(math.inf))
    assert with_clipped_edge(row, radius, clipped).unc_px == pytest.approx(math.hypot(0.02, 0.0045 * 46.0))
    assert with_clipped_edge(row, radius, plain) == row
    assert with_clipped_edge(row, NO_RADIUS, clipped) == row


def test_a_clipped_ground_has_no_noise_that_is_known() -> None:
    assert _noise(cast("Any", _Ground(math.inf, 0.01))) == {"ground_noise": 0.01}
    assert math.isnan(_noise(cast("Any", _Ground(0.995, 0.0)))["ground_noise"])
