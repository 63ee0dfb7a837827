"""The bottom cap: independent of the ellipse, and near its own bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.fitting import FitRequest, fit_with_bottom
from wentry_cli.contours.local_bottom import fit_local_bottom
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch


def request(s):
    return FitRequest(("x", "y", "stretch"), s.top_y)


def bottoms(frames=30, **scene):
    errors, pulls = [], []
    for seed in range(frames):
        s = draw(seed, **scene)
        fit = fit_silhouette(s.patch, nudged(s.shape, 1.0, seed), top_y_px=s.top_y)
        cap = fit_local_bottom(s.patch, fit)
        assert cap.status == "ok"
        errors.append(cap.y_px - s.bottom_y)
        pulls.append(errors[-1] / cap.y_unc_px)
    return np.array(errors), np.array(pulls)


@pytest.mark.parametrize(
    ("scene", "most"),
    [({}, 0.009), ({"noise": 0.05}, 0.04), ({"stretch": 1.0}, 0.008), ({"visible": 0.25}, 0.009)],
)
def test_error_and_pull(scene, most):
    error, pull = bottoms(**scene)
    assert np.sqrt(np.mean(error**2)) < most
    assert 0.6 < np.sqrt(np.mean(pull**2)) < 1.5


@pytest.mark.parametrize("misfit", [(0.005, 0.0), (0.0, 0.005)])
def test_a_misfit_moves_the_ellipse_but_not_the_cap(misfit):
    error, pull = bottoms(frames=10, body={"misfit": misfit})
    assert np.max(np.abs(error)) < 0.02
    assert np.max(np.abs(pull)) < 4.0


def test_the_pixels_of_the_outline_tell_the_bottom_as_well_as_its_own():
    found = []
    for seed in range(24):
        s = draw(seed)
        fit, bottom, _ = fit_with_bottom(s.patch, nudged(s.shape, 1.0, seed), request(s))
        own = fit_local_bottom(s.patch, fit)
        assert bottom.status == own.status == "ok"
        assert bottom != own
        assert bottom.y_unc_px == pytest.approx(own.y_unc_px, rel=0.15)
        found.append(np.array([bottom.y_px - s.bottom_y, own.y_px - s.bottom_y, bottom.y_px - own.y_px]) / own.y_unc_px)
    error, by_itself, apart = np.sqrt(np.mean(np.square(found), axis=0))
    assert error < 1.05 * by_itself
    assert 0.7 < by_itself < 1.3
    assert np.max(np.abs(found)) < 4.0
    assert apart < 0.3


def test_a_cap_that_the_outline_does_not_hold_is_measured_by_itself():
    s = draw(7, visible=0.2)
    fit, bottom, _ = fit_with_bottom(s.patch, s.shape, request(s))
    assert bottom == fit_local_bottom(s.patch, fit)
    assert bottom.status == "ok"
    values = s.patch.values.copy()
    middle = int(s.shape.x - s.patch.x0)
    values[-25:, middle - 8 : middle + 8] = 0.3
    spoilt = replace(s.patch, values=values)
    fit, bottom, _ = fit_with_bottom(spoilt, s.shape, request(s))
    assert bottom == fit_local_bottom(spoilt, fit)


def test_the_column_is_that_of_the_lowest_point_of_a_tilted_ellipse():
    s = draw(3, body={"tilt_deg": 5.0})
    fit = fit_silhouette(s.patch, s.shape, free="x y stretch tilt", top_y_px=s.top_y)
    cap = fit_local_bottom(s.patch, fit)
    tilt = math.radians(5.0)
    a, b = s.shape.semi_across, s.shape.semi_along
    lowest = math.atan2(b * math.cos(tilt), -a * math.sin(tilt))
    column = s.shape.x + a * math.cos(lowest) * math.cos(tilt) + b * math.sin(lowest) * math.sin(tilt)
    assert cap.x_px == pytest.approx(column, abs=0.5)
    assert abs(cap.y_px - s.bottom_y) < 4.0 * cap.y_unc_px


def test_a_hidden_cap_has_no_number():
    s = draw(4)
    values = s.patch.values.copy()
    middle = int(s.shape.x - s.patch.x0)
    values[-25:, middle - 25 : middle + 25] = 0.3
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
    cap = fit_local_bottom(replace(s.patch, values=values), fit)
    assert cap.status in {"occluded", "poor_fit"}
    assert math.isnan(cap.y_px)
    cut = Patch(np.ascontiguousarray(s.patch.values[:-22]), s.patch.x0, s.patch.y0)
    assert fit_local_bottom(cut, fit).status == "out_of_frame"


def test_the_status_of_the_ellipse_is_handed_on():
    s = draw(5)
    lost = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)._replace(status="occluded")
    assert fit_local_bottom(s.patch, lost).status == "occluded"
