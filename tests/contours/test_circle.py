"""The circle of the top view, alone and beside a splash ring."""

import numpy as np
import pytest

from tests.contours.scenes import draw
from wentry_cli.contours.bounds import cramer_rao_bound
from wentry_cli.contours.circle import Circle, fit_circle
from wentry_cli.contours.ellipse import EllipseShape


def circle_scene(seed, **kwargs):
    return draw(seed, radius=72.0, stretch=1.0, visible=1.0, margin=30, **kwargs)


@pytest.mark.parametrize(("noise", "most"), [(0.01, 1.5), (0.1, 1.5)])
def test_a_clean_circle_is_near_the_bound(noise, most):
    rows, pulls = [], []
    for seed in range(40):
        s = circle_scene(seed, noise=noise)
        fit = fit_circle(s.patch, Circle(s.shape.x + 2.0, s.shape.y - 1.5, 71.0))
        assert fit.status == "ok"
        assert fit.stretch == 1.0
        error = [fit.center_x_px - s.shape.x, fit.center_y_px - s.shape.y, fit.radius_px - 72.0]
        rows.append(error)
        pulls.append(np.array(error) / [fit.center_x_unc_px, fit.center_y_unc_px, fit.radius_unc_px])
    b = cramer_rao_bound(EllipseShape(0, 0, 72.0), free="x y R", noise=noise, noise_dark=noise * np.sqrt(0.448))
    ratio = np.sqrt(np.mean(np.square(rows), axis=0)) / [b.x_px, b.y_px, b.radius_px]
    assert np.all(ratio < most)
    assert np.all(ratio > 0.6)
    assert np.all(np.sqrt(np.mean(np.square(pulls), axis=0)) < 1.4)


@pytest.mark.parametrize("level", ["fast", "accurate"])
@pytest.mark.parametrize("share", [0.2, 0.4])
def test_a_splash_ring_is_kept_out(share, level):
    for seed in range(6):
        s = circle_scene(seed, light={"splash_ring": share})
        guess = Circle(s.shape.x + 2.0, s.shape.y + 2.0, 71.5)
        fit = fit_circle(s.patch, guess, one_sided=True, level=level)
        assert fit.status == "ok"
        assert 0.5 * share < fit.gated_fraction < share + 0.25
        assert np.hypot(fit.center_x_px - s.shape.x, fit.center_y_px - s.shape.y) < 0.06
        assert abs(fit.radius_px - 72.0) < 0.06


def test_a_circle_that_is_nearly_swallowed_is_not_ok():
    s = circle_scene(0, light={"splash_ring": 0.85})
    fit = fit_circle(s.patch, Circle(s.shape.x + 1.0, s.shape.y, 72.0), one_sided=True)
    assert fit.status in {"occluded", "poor_fit", "no_edge"}
