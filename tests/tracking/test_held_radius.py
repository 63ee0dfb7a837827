"""A fit whose radius and tilt are put in afterwards is as good as one that had them from the beginning."""

from __future__ import annotations

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.tracking.held_radius import radius_slope, with_radius, with_tilt


def told(fit: SilhouetteFit) -> list[float]:
    return [fit.center_x_px, fit.center_y_px, fit.stretch, fit.bottom_y_px]


def uncs(fit: SilhouetteFit) -> list[float]:
    return [fit.center_x_unc_px, fit.center_y_unc_px, fit.stretch_unc, fit.bottom_y_unc_px]


@pytest.mark.parametrize(("tilt", "tilt_unc"), [(0.0, 0.0), (4.0, 0.5)])
def test_radius_and_tilt_put_in_afterwards(tilt: float, tilt_unc: float) -> None:
    errors, spreads = np.empty((2, 40, 4)), np.empty((2, 40, 4))
    for seed in range(40):
        s = draw(seed, stretch=1.15, body={"tilt_deg": tilt})
        truth = [s.shape.x, s.shape.y, s.shape.stretch, s.bottom_y]
        guess = nudged(s.shape, 0.5, seed)._replace(tilt_deg=tilt)
        held = fit_silhouette(s.patch, guess, top_y_px=s.top_y, tilt_unc_deg=tilt_unc)
        free = fit_silhouette(s.patch, guess, free="x y R stretch tilt", top_y_px=s.top_y)
        put_in = with_tilt(with_radius([free], s.shape.radius, np.array([radius_slope(free)]))[0], tilt, tilt_unc)
        assert (put_in.tilt_deg, put_in.tilt_unc_deg) == (tilt, pytest.approx(tilt_unc))
        for way, fit in enumerate((held, put_in)):
            errors[way, seed], spreads[way, seed] = np.subtract(told(fit), truth), uncs(fit)
    rms = np.sqrt(np.mean(errors**2, axis=1))
    # the step to a tilt is linear; what that leaves is small against what the tilt is not known to
    assert (rms[1] < 1.05 * rms[0] + 0.03 * tilt_unc * np.median(spreads[0], axis=0)).all()
    assert np.median(spreads[1] / spreads[0], axis=0) == pytest.approx(1.0, abs=0.03)


def test_a_fit_that_does_not_say_how_it_answers_to_its_tilt_keeps_it() -> None:
    s = draw(1, stretch=1.15)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
    assert with_tilt(fit, 3.0, 1.0) is fit
