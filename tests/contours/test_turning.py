"""The tilt that an outline asks for beyond the one that was held in the fit."""

import math

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.silhouette import fit_silhouette


def fits(stretch, tilt, *, held, level="accurate", free="x y stretch", seeds=12):
    for seed in range(seeds):
        s = draw(seed, stretch=stretch, noise=0.02, body={"tilt_deg": tilt})
        guess = nudged(s.shape, 0.7, seed)._replace(tilt_deg=held)
        yield fit_silhouette(s.patch, guess, free=free, top_y_px=s.top_y, level=level)


@pytest.mark.parametrize("level", ["accurate", "fast"])
@pytest.mark.parametrize(("stretch", "tilt", "held"), [(1.2, 5.0, 4.5), (1.1, 1.0, 0.0), (0.88, -3.0, -2.5)])
def test_one_step_gives_the_tilt_back(stretch, tilt, held, level):
    found = list(fits(stretch, tilt, held=held, level=level, seeds=40))
    assert all(fit.status == "ok" and fit.tilt_deg == pytest.approx(held) for fit in found)
    error = np.array([fit.seen_tilt_deg - tilt for fit in found])
    unc = np.array([fit.seen_tilt_unc_deg for fit in found])
    assert np.all(np.abs(error) < 3.5 * np.hypot(unc, 0.02 * abs(tilt - held)))
    # rays are counted as fewer than they are where they share noise: the scan claims less than it knows
    assert (0.75 if level == "accurate" else 0.4) < np.sqrt(np.mean((error / unc) ** 2)) < 1.3
    assert np.median(unc) < 0.1


def test_the_rounder_the_less_is_known():
    spread = [np.median([fit.seen_tilt_unc_deg for fit in fits(s, 0.0, held=0.0)]) for s in (1.2, 1.06, 1.01)]
    assert spread[0] < spread[1] < spread[2]
    assert spread[2] > 0.15


def test_a_fit_without_a_stretch_tells_no_tilt():
    for fit in fits(1.2, 0.0, held=0.0, free="x y", seeds=2):
        assert math.isnan(fit.seen_tilt_deg)
        assert math.isnan(fit.seen_tilt_unc_deg)


def test_a_free_tilt_is_the_one_that_is_seen():
    for fit in fits(1.2, 5.0, held=4.0, free="x y stretch tilt", seeds=2):
        assert (fit.seen_tilt_deg, fit.seen_tilt_unc_deg) == pytest.approx((fit.tilt_deg, fit.tilt_unc_deg))


def test_what_is_not_known_of_the_tilt_counts_where_the_outline_is_tilted():
    def uncs(tilt, tilt_unc, seed=3):
        s = draw(seed, stretch=1.2, body={"tilt_deg": tilt})
        fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, tilt_unc_deg=tilt_unc)
        return np.array([fit.stretch_unc, fit.bottom_y_unc_px])

    assert (uncs(5.0, 1.0) > 3.0 * uncs(5.0, 0.0)).all()
    # an upright outline is symmetric but for its noise
    wider = np.median([uncs(0.0, 1.0, seed) / uncs(0.0, 0.0, seed) for seed in range(7)], axis=0)
    assert (wider < 1.5).all()
