"""The scan of an outline that was followed finds what the scan from far off finds."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.arc import arc_geometry, perimeter_of
from wentry_cli.contours.fitting import FitRequest, fit_shape
from wentry_cli.contours.scan import visible_rays


def both(s, guess, free=("x", "y", "stretch")):
    """The fit from far off and that of the outline that was followed."""
    return [fit_shape(s.patch, guess, FitRequest(free, s.top_y, level="fast", followed=near)) for near in (False, True)]


@pytest.mark.parametrize("off", [0.0, 0.1, 0.4, 1.0, 3.0, 8.0])
def test_a_followed_outline_is_found_where_it_is(off):
    differences = []
    for seed in range(20):
        s = draw(seed)
        far, near = both(s, nudged(s.shape, off, seed))
        assert far.status == near.status == "ok"
        assert near.bottom_y_unc_px == pytest.approx(far.bottom_y_unc_px, rel=0.3)
        differences.append((near.bottom_y_px - far.bottom_y_px) / far.bottom_y_unc_px)
        differences.append((near.center_x_px - far.center_x_px) / far.center_x_unc_px)
    assert np.sqrt(np.mean(np.square(differences))) < 0.35


@pytest.mark.parametrize("scene", [{}, {"noise": 0.05}, {"stretch": 1.8}, {"radius": 125.0}, {"visible": 0.2}])
def test_a_followed_outline_is_as_good(scene):
    errors = []
    for seed in range(60):
        s = draw(seed, **scene)
        errors.append([fit.bottom_y_px - s.bottom_y for fit in both(s, nudged(s.shape, 0.15, seed))])
    far, near = np.sqrt(np.mean(np.square(errors), axis=0))
    assert near < 1.12 * far


def test_where_much_disagrees_it_is_looked_for_from_far_off():
    for seed in range(10):
        s = draw(seed, visible=1.0, light={"droplets": 0.3})
        far, near = both(s, nudged(s.shape, 0.2, seed))
        assert near.gated_fraction > 0.15
        assert near.bottom_y_px == far.bottom_y_px


def test_a_followed_outline_that_is_not_there_is_not_found():
    s = draw(1)
    plain = np.random.default_rng(0).normal(1.0, 0.01, s.patch.values.shape).astype(np.float32)
    request = FitRequest(("x", "y", "stretch"), s.top_y, level="fast", followed=True)
    assert fit_shape(replace(s.patch, values=plain), s.shape, request).status == "no_edge"


def test_rays_see_what_lies_below_the_row():
    s = draw(2, stretch=1.3, body={"tilt_deg": 12.0})
    shape, size = s.shape.vector(), (10_000, 10_000)
    everything = arc_geometry(shape, np.linspace(0.0, 2.0 * np.pi, 20_001)[:-1])
    for top in (-np.inf, s.shape.y - 20.0, s.shape.y, s.shape.y + 20.0):
        rays, below, seen = visible_rays(shape, top, 96, 3.0, size)
        assert np.all(rays[:, 1] >= top)
        lengths = everything[:, 10]
        assert below == pytest.approx(lengths[everything[:, 1] >= top].sum() / lengths.sum(), abs=0.015)
        assert seen == below
    assert lengths.sum() == pytest.approx(perimeter_of(s.shape.semi_across, s.shape.semi_along), rel=1e-6)
    _, below, seen = visible_rays(shape, -np.inf, 96, 3.0, (10_000, int(s.shape.x)))
    assert below == pytest.approx(1.0, abs=1e-3)
    assert 0.4 < seen < 0.6
