"""The fit of the side view against rendered truth and the Cramér–Rao bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.bounds import cramer_rao_bound
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch

FRAMES = 40


def errors(level: str, free: str = "x y stretch", frames: int = FRAMES, off: float = 1.0, **scene):
    """Errors over uncertainties (frames, 4) and errors of x, y, stretch and the lowest row; all frames are ok."""
    rows, pulls = [], []
    for seed in range(frames):
        s = draw(seed, **scene)
        motion = scene.get("body", {}).get("motion_px", (0.0, 0.0))
        fit = fit_silhouette(
            s.patch, nudged(s.shape, off, seed), free=free, top_y_px=s.top_y, level=level, motion_px=motion
        )
        assert fit.status == "ok"
        error = np.array(
            [
                fit.center_x_px - s.shape.x,
                fit.center_y_px - s.shape.y,
                fit.stretch - s.shape.stretch,
                fit.bottom_y_px - s.bottom_y,
            ]
        )
        unc = [fit.center_x_unc_px, fit.center_y_unc_px, fit.stretch_unc, fit.bottom_y_unc_px]
        rows.append(error)
        pulls.append(error / np.array(unc))
    return np.array(rows), np.array(pulls)


def bound(free: str = "x y stretch", **scene):
    """Bounds of the same four numbers; shot noise makes the dark side quieter (Sensor's default share 0.6)."""
    noise, dark = scene.get("noise", 0.01), scene.get("light", {}).get("dark", 0.08)
    b = cramer_rao_bound(
        EllipseShape(0, 0, scene.get("radius", 60.0), scene.get("stretch", 1.2)),
        free=free,
        noise=noise,
        noise_dark=noise * math.sqrt(0.4 + 0.6 * dark),
        contrast=1.0 - dark,
        visible=scene.get("visible", 0.5),
    )
    return np.array([b.x_px, b.y_px, b.stretch, b.bottom_y_px])


CASES = {
    # name: (scene, ratio to the bound of accurate, of fast); 40 frames scatter by a tenth
    "clean": ({}, 1.6, 1.9),
    "noisy": ({"noise": 0.1}, 1.6, 1.9),
    "sphere": ({"stretch": 1.0}, 1.5, 1.7),
    "prolate": ({"stretch": 0.85}, 1.6, 1.8),
    "large": ({"radius": 100.0, "stretch": 1.1}, 1.6, 1.9),
    "low contrast": ({"light": {"dark": 0.85}}, 1.6, 1.9),
    "a fifth": ({"visible": 0.2}, 1.7, 1.9),
    "moving": ({"body": {"motion_px": (0.0, 3.6)}}, 2.0, 2.4),
    "bright spots": ({"light": {"bright_spots": 6}}, 1.6, 1.9),
    "cavity above": ({"visible": 0.45, "body": {"separation_y_px": 55.0}}, 1.6, 1.9),
}


@pytest.mark.parametrize("name", CASES)
def test_scatter_is_near_the_bound(name):
    scene, accurate, fast = CASES[name]
    for level, most in (("accurate", accurate), ("fast", fast)):
        error, pull = errors(level, **scene)
        ratio = np.sqrt(np.mean(error**2, axis=0)) / bound(**scene)
        assert np.all(ratio < most), (level, ratio)
        assert np.all(ratio > 0.6), (level, ratio)
        assert np.all(np.sqrt(np.mean(pull**2, axis=0)) < 1.7), level


def test_bias_is_small_beside_the_bound():
    error, _ = errors("accurate", frames=120)
    assert np.all(np.abs(error.mean(axis=0)) < 0.35 * bound())


def test_pulls_are_those_of_honest_uncertainties():
    _, pull = errors("accurate", frames=120)
    spread = np.sqrt(np.mean(pull**2, axis=0))
    assert np.all(spread > 0.75)
    assert np.all(spread < 1.25)


@pytest.mark.parametrize("off", [4.0, 9.0])
@pytest.mark.parametrize("level", ["fast", "accurate"])
def test_a_guess_off_by_several_pixels_converges_to_the_same(off, level):
    s = draw(3)
    near = fit_silhouette(s.patch, nudged(s.shape, 0.3), top_y_px=s.top_y, level=level)
    far = fit_silhouette(s.patch, nudged(s.shape, off, 5), top_y_px=s.top_y, level=level)
    assert far.status == "ok"
    assert far.center_x_px == pytest.approx(near.center_x_px, abs=1.5 * near.center_x_unc_px)
    assert far.bottom_y_px == pytest.approx(near.bottom_y_px, abs=1.5 * near.bottom_y_unc_px)


@pytest.mark.parametrize("free", ["x y", "x y R", "x y stretch", "x y R stretch", "x y R stretch tilt"])
def test_every_free_set(free):
    s = draw(4, visible=1.0, body={"tilt_deg": 4.0})
    guess = s.shape._replace(x=s.shape.x + 1.0, y=s.shape.y - 1.0)
    fit = fit_silhouette(s.patch, guess, free=free)
    names = free.split()
    assert fit.status == "ok"
    for name, value, truth, unc in [
        ("R", fit.radius_px, s.shape.radius, fit.radius_unc_px),
        ("stretch", fit.stretch, s.shape.stretch, fit.stretch_unc),
        ("tilt", fit.tilt_deg, s.shape.tilt_deg, fit.tilt_unc_deg),
    ]:
        if name in names:
            assert abs(value - truth) < 4.5 * unc
        else:
            assert value == pytest.approx(truth, abs=1e-12)
            assert math.isnan(unc)
    held = [i for i, name in enumerate(("x", "y", "R", "stretch", "tilt")) if name not in names]
    assert np.all(fit.covariance[held] == 0.0)


def test_droplets_are_gated():
    gross = []
    for seed in range(20):
        s = draw(seed, visible=1.0, light={"droplets": 0.2})
        fit = fit_silhouette(s.patch, nudged(s.shape, 1.0, seed))
        assert fit.status == "ok"
        assert fit.gated_fraction > 0.1
        gross.append(abs(fit.bottom_y_px - s.bottom_y) / fit.bottom_y_unc_px)
    assert max(gross) < 4.0
    assert np.sqrt(np.mean(np.square(gross))) < 1.4


def test_an_outline_that_is_no_ellipse_widens_the_uncertainty():
    plain = draw(1)
    plain_fit = fit_silhouette(plain.patch, plain.shape, top_y_px=plain.top_y)
    for misfit in ((0.005, 0.0), (0.0, 0.005)):
        s = draw(1, body={"misfit": misfit})
        fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
        assert fit.status == "ok"
        assert fit.bottom_y_unc_px > 10.0 * plain_fit.bottom_y_unc_px
        assert abs(fit.bottom_y_px - s.bottom_y) < 3.0 * fit.bottom_y_unc_px


def test_a_third_out_of_the_patch_is_still_measured():
    s = draw(2, visible=1.0, crop=0.3)
    fit = fit_silhouette(s.patch, nudged(s.shape))
    assert fit.status == "ok"
    assert abs(fit.center_x_px - s.shape.x) < 4.0 * fit.center_x_unc_px
    assert fit.arc_fraction < 0.85


def test_masked_pixels_are_left_out():
    s = draw(6)
    values = s.patch.values.copy()
    values[np.random.default_rng(0).uniform(size=values.shape) < 0.01] = math.nan
    fit = fit_silhouette(replace(s.patch, values=values), nudged(s.shape), top_y_px=s.top_y)
    assert fit.status == "ok"
    assert abs(fit.bottom_y_px - s.bottom_y) < 4.0 * fit.bottom_y_unc_px


@pytest.mark.parametrize("masked", [False, True])
def test_a_clipped_ground(masked):
    s = draw(7, visible=1.0)
    ceiling = 0.9
    values = np.minimum(s.patch.values, ceiling)
    if masked:
        values = np.where(values >= ceiling, math.nan, values).astype(np.float32)
    fit = fit_silhouette(Patch(values, s.patch.x0, s.patch.y0, 0.0, math.inf if masked else ceiling), nudged(s.shape))
    assert fit.status == "ok"
    assert abs(fit.center_x_px - s.shape.x) < 0.05
    assert abs(fit.bottom_y_px - s.bottom_y) < 0.25


def test_status_says_why_there_is_nothing():
    s = draw(8)
    empty = Patch(np.random.default_rng(0).normal(1.0, 0.01, s.patch.values.shape).astype(np.float32), 40, 300)
    assert fit_silhouette(empty, s.shape).status == "no_edge"
    assert fit_silhouette(s.patch, s.shape, top_y_px=s.shape.bottom_y - 1.0).status == "short_arc"
    away = s.shape._replace(x=s.shape.x + 150.0)
    assert fit_silhouette(s.patch, away, top_y_px=s.top_y).status == "out_of_frame"
    clipped = replace(empty, values=np.full_like(empty.values, math.nan))
    assert fit_silhouette(clipped, s.shape).status == "saturated"


def test_what_is_not_measured_has_no_numbers():
    fit = fit_silhouette(Patch(np.ones((120, 150), np.float32)), EllipseShape(70, 60, 40))
    assert fit.status == "no_edge"
    assert all(math.isnan(v) for v in (fit.center_x_px, fit.stretch, fit.bottom_y_px, fit.bottom_y_unc_px))


def test_texture_is_no_silhouette():
    rng = np.random.default_rng(2)
    hits = 0
    for _ in range(20):
        rough = rng.uniform(0.1, 1.0, (24, 30)).astype(np.float32)
        patch = Patch(np.ascontiguousarray(np.kron(rough, np.ones((6, 6), np.float32))))
        hits += fit_silhouette(patch, EllipseShape(90, 70, 50, 1.1)).status == "ok"
    assert hits == 0


def test_the_same_patch_gives_the_same_bits():
    s = draw(9)
    one = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
    two = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
    assert one.bottom_y_px == two.bottom_y_px
    assert np.array_equal(one.covariance, two.covariance)


def test_wrong_requests_are_refused():
    s = draw(10)
    with pytest.raises(ValueError, match="level"):
        fit_silhouette(s.patch, s.shape, level="best")
    with pytest.raises(ValueError, match="colour"):
        fit_silhouette(s.patch, s.shape, free="x y colour")
    with pytest.raises(ValueError, match="centre"):
        fit_silhouette(s.patch, s.shape, free="x stretch")
