"""A ground at the ceiling of the sensor: the edge lies where nobody knows, and the fit says so."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.clipped import is_clipped
from wentry_cli.contours.local_bottom import fit_local_bottom
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.synthetic.camera_noise import Sensor


@pytest.mark.parametrize("level", ["accurate", "fast"])
@pytest.mark.parametrize("over", [1.03, 1.1])
def test_the_uncertainty_holds_the_truth_before_clipped_light(level, over):
    s = draw(2, light={"sensor": Sensor(12, over, 0.01)})
    patch = replace(s.patch, ceiling=1.0 / over)
    assert is_clipped(patch)
    fit = fit_silhouette(patch, nudged(s.shape), top_y_px=s.top_y, level=level)
    assert fit.status == "ok"
    assert abs(fit.center_y_px - s.shape.y) < 3.0 * fit.center_y_unc_px
    assert abs(fit.stretch - s.shape.stretch) < 3.0 * fit.stretch_unc
    assert abs(fit.bottom_y_px - s.bottom_y) < 3.0 * fit.bottom_y_unc_px
    bottom = fit_local_bottom(patch, fit)
    assert abs(bottom.y_px - s.bottom_y) < 3.0 * bottom.y_unc_px
    assert bottom.y_unc_px > 0.1


def test_a_few_clipped_pixels_are_no_clipped_ground():
    s = draw(2)
    sure = fit_silhouette(s.patch, nudged(s.shape), top_y_px=s.top_y)
    values = s.patch.values.copy()
    values[:3, :3] = 1.3
    spotted = replace(s.patch, values=values, ceiling=1.3)
    assert not is_clipped(spotted)
    assert fit_silhouette(spotted, nudged(s.shape), top_y_px=s.top_y).bottom_y_unc_px < 2.0 * sure.bottom_y_unc_px
    assert not is_clipped(replace(spotted, ceiling=math.inf))
    assert is_clipped(replace(spotted, values=np.full((4, 4), np.nan, np.float32)))
