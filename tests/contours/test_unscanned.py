"""An outline that leads on from the frames before is fitted without a scan, and what it says serves other questions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from tests.contours.scenes import Scene, draw, nudged
from wentry_cli.contours.arc import COLUMNS, J, X, Y, arc_rows
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.fitting import FitRequest, fit_shape, fit_with_bottom
from wentry_cli.contours.global_step import remains
from wentry_cli.imaging.patch import Patch

FREE, WITH_RADIUS = ("x", "y", "stretch"), ("x", "y", "R", "stretch", "tilt")
JUDGED = [0, 1, 3]


def fit(s: Scene, off_px: float, blur_px: float, seed: int = 0) -> SilhouetteFit:
    """The fit from a guess that is so far off, with the blur of the frames before."""
    return fit_shape(s.patch, nudged(s.shape, off_px, seed), FitRequest(FREE, s.top_y, blur_px=blur_px))


def apart(one: SilhouetteFit, other: SilhouetteFit, free: list[int]) -> np.ndarray:
    """How far two fits lie from each other, in uncertainties."""
    step = one.shape.vector() - other.shape.vector()
    return step[free] / np.sqrt(np.diag(other.covariance)[free])


@pytest.mark.parametrize("scene", [{}, {"noise": 0.05}, {"visible": 0.3}, {"light": {"gradient": (0.05, 0.05)}}])
def test_without_a_scan_the_outline_is_the_same(scene: dict) -> None:
    found, ratio = [], []
    for seed in range(12):
        s = draw(seed, **scene)
        near, scanned = fit(s, 0.05, 1.1, seed), fit(s, 0.05, math.nan, seed)
        assert near.status == scanned.status == "ok"
        assert near.center_x_px != scanned.center_x_px
        ratio.append(near.stretch_unc / scanned.stretch_unc)
        found.append(apart(near, scanned, JUDGED))
    assert np.sqrt(np.mean(np.square(found))) < 0.25
    # one of few outlines may by chance disagree by more than its noise, whose uncertainty is wider for that
    assert np.median(ratio) == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("off_px", [2.0, 6.0])
def test_a_guess_that_leads_astray_is_scanned_for(off_px: float) -> None:
    s = draw(1)
    near, scanned = fit(s, off_px, 1.1), fit(s, off_px, math.nan)
    assert near.status == "ok"
    assert near.shape == scanned.shape


@pytest.mark.parametrize("guessed", [0.7, 1.08, 2.5])
@pytest.mark.parametrize("psf_px", [0.8, 2.2])
def test_a_blur_that_was_guessed_wrong_costs_nothing(psf_px: float, guessed: float) -> None:
    found = []
    for seed in range(12):
        s = draw(seed, noise=0.003, light={"psf_px": psf_px})
        near = fit_with_bottom(s.patch, s.shape, FitRequest(FREE, s.top_y, blur_px=guessed))
        usual = fit_with_bottom(s.patch, s.shape, FitRequest(FREE, s.top_y, blur_px=psf_px))
        assert near.bottom is not None
        assert usual.bottom is not None
        assert near.fit.blur_px == pytest.approx(usual.fit.blur_px, rel=0.05)
        ratio = near.fit.center_y_unc_px / usual.fit.center_y_unc_px, near.bottom.y_unc_px / usual.bottom.y_unc_px
        found.append((*ratio, (near.bottom.y_px - s.bottom_y) / near.bottom.y_unc_px))
    assert np.median(found, axis=0)[:2] == pytest.approx([1.0, 1.0], abs=0.15)
    assert 0.6 < np.sqrt(np.mean(np.square(found)[:, 2])) < 1.6


@pytest.mark.parametrize("contrast", [-0.3, 0.01])
def test_what_is_brighter_or_hardly_darker_is_no_sphere(contrast: float) -> None:
    s = draw(4, noise=0.001)
    values = np.float32(1.0) - np.float32(contrast) * (1.0 - s.patch.values) / 0.92
    faint = Patch(values.astype(np.float32), s.patch.x0, s.patch.y0)
    assert fit_shape(faint, s.shape, FitRequest(FREE, s.top_y, blur_px=1.1)).status == "no_edge"


def test_nothing_is_found_without_a_scan_where_nothing_is() -> None:
    s = draw(2)
    empty = s.patch.values.copy()
    empty[:] = 1.0 + 0.01 * np.random.default_rng(3).normal(size=empty.shape)
    request = FitRequest(FREE, s.top_y, blur_px=1.1)
    assert fit_shape(Patch(empty, s.patch.x0, s.patch.y0), s.shape, request).status != "ok"


def test_a_second_fit_to_the_same_pixels_is_that_of_its_own() -> None:
    found = []
    for seed in range(12):
        s = draw(seed, visible=0.6)
        request = FitRequest(FREE, s.top_y, also=WITH_RADIUS)
        other = fit_with_bottom(s.patch, nudged(s.shape, 0.5, seed), request, bottom=False).other
        own = fit_shape(s.patch, s.shape, request._replace(free=WITH_RADIUS, also=()))
        assert other is not None
        assert other.status == own.status == "ok"
        assert other.radius_px != own.radius_px
        assert other.radius_unc_px == pytest.approx(own.radius_unc_px, rel=0.15)
        found.append(apart(other, own, [0, 1, 2, 3, 4]))
    assert np.sqrt(np.mean(np.square(found))) < 0.25


@pytest.mark.parametrize("moved", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("blur", [-0.1, 0.03])
def test_what_a_step_leaves_is_told(moved: float, blur: float) -> None:
    """One linear step in displacement and ln s of a straight edge, whose true answer is known."""
    at = np.linspace(-6.0, 6.0, 4001)
    straight = np.zeros((1, COLUMNS))
    straight[0, J] = 1.0

    def edge(shift: float, ln_s: float) -> np.ndarray:
        return ndtr((at - shift) / np.exp(ln_s))

    tiny = 1e-5
    slopes = np.column_stack([(edge(tiny, 0.0) - edge(0.0, 0.0)) / tiny, (edge(0.0, tiny) - edge(0.0, 0.0)) / tiny])
    step = np.linalg.lstsq(slopes, edge(moved, blur) - edge(0.0, 0.0), rcond=None)[0]
    told = remains(straight, np.array([step[0], 0.0, 0.0, 0.0, 0.0]), step[1])
    assert abs(step[0] - moved) < 1.5 * told + 1e-6


@pytest.mark.parametrize("radius", [5.0, 60.0])
def test_what_a_bent_outline_leaves_is_told(radius: float) -> None:
    """A circle that moves sideways: where it was seen upright it then lies off by the square over the diameter."""
    circle = np.array([0.0, 0.0, radius, 1.0, 0.0])
    rows = arc_rows(circle, np.array([0.25 * np.pi]), np.array([0.1]))
    moved = np.array([0.3, -0.3, 0.0, 0.0, 0.0])  # along the outline there
    aside = np.hypot(rows[0, X] - moved[0], rows[0, Y] - moved[1]) - radius
    across = np.array([0.3, 0.3, 0.0, 0.0, 0.0])
    assert remains(rows, across, 0.0) > aside > 0.0
