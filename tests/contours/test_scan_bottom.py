"""The bottom cap from rays: near its bound on rendered frames, honest, and silent where the cap cannot be seen."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.bounds import cap_bound
from wentry_cli.contours.scan_bottom import fit_scan_bottom
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch

SCENES = {
    # name: (scene, most that the error may be over the bound, where there is one)
    "clean": ({}, 1.7),
    "noisy": ({"noise": 0.05}, 1.7),
    "sphere": ({"stretch": 1.0}, 1.7),
    "small": ({"radius": 30.0}, 1.8),
    "large": ({"radius": 125.0}, 1.7),
    "oblate": ({"stretch": 1.8}, 1.8),
    "low contrast": ({"light": {"dark": 0.85}}, 1.7),
    "a fifth": ({"visible": 0.2}, 1.8),
    "no ellipse": ({"body": {"misfit": (0.0, 0.005)}}, 2.0),
    "moving": ({"body": {"motion_px": (0.0, 3.6)}}, 2.5),
}


def found(seed, **scene):
    """A frame, and the lowest point of it as the level "fast" measures it."""
    s = draw(seed, **scene)
    motion = scene.get("body", {}).get("motion_px", (0.0, 0.0))
    guess = nudged(s.shape, 1.0, seed)
    fit = fit_silhouette(s.patch, guess, top_y_px=s.top_y, level="fast", motion_px=motion)
    return s, fit_scan_bottom(s.patch, fit, motion_px=motion)


def bound(s, **scene):
    """That of `cap_bound`; shot noise makes the dark side quieter (Sensor's default share 0.6)."""
    noise, dark = scene.get("noise", 0.01), scene.get("light", {}).get("dark", 0.08)
    contrast = (1.0 - dark) / 0.92
    quiet = noise * math.sqrt(0.4 + 0.6 * dark)
    return cap_bound(s.shape, noise=noise / contrast, noise_dark=quiet / contrast)


@pytest.mark.parametrize("name", SCENES)
def test_the_error_is_near_the_bound_and_as_large_as_stated(name):
    scene, most = SCENES[name]
    ratios, pulls = [], []
    for seed in range(80):
        s, cap = found(seed, **scene)
        assert cap.status == "ok"
        ratios.append((cap.y_px - s.bottom_y) / bound(s, **scene))
        pulls.append((cap.y_px - s.bottom_y) / cap.y_unc_px)
    assert 0.9 < np.sqrt(np.mean(np.square(ratios))) < most
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 1.3  # 80 frames scatter by 8 %
    assert np.max(np.abs(pulls)) < 4.5


def test_droplets_on_the_cap_are_left_out_or_told():
    pulls = []
    for seed in range(60):
        s, cap = found(seed, visible=1.0, light={"droplets": 0.25})
        if cap.status == "ok":
            pulls.append((cap.y_px - s.bottom_y) / cap.y_unc_px)
    assert len(pulls) > 50
    assert np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_the_column_is_that_of_the_lowest_point_of_a_tilted_ellipse():
    s = draw(3, body={"tilt_deg": 5.0})
    fit = fit_silhouette(s.patch, s.shape, free="x y stretch tilt", top_y_px=s.top_y, level="fast")
    cap = fit_scan_bottom(s.patch, fit)
    angle = np.linspace(0.0, 2.0 * math.pi, 100_001)
    a, b, tilt = s.shape.semi_across, s.shape.semi_along, math.radians(5.0)
    rows = b * np.sin(angle) * math.cos(tilt) - a * np.cos(angle) * math.sin(tilt)
    columns = a * np.cos(angle) * math.cos(tilt) + b * np.sin(angle) * math.sin(tilt)
    assert cap.x_px == pytest.approx(s.shape.x + columns[np.argmax(rows)], abs=0.5)
    assert abs(cap.y_px - s.bottom_y) < 4.0 * cap.y_unc_px


def covered(s, half_width, left=0):
    """The patch with the lowest rows hidden, from ``left`` columns beside the middle on over two half-widths."""
    values = s.patch.values.copy()
    middle = int(s.shape.x - s.patch.x0) + left
    values[int(s.bottom_y - s.patch.y0) - 12 :, middle - half_width : middle + half_width] = 0.08
    return replace(s.patch, values=values)


def test_a_hidden_cap_has_no_number():
    s = draw(4)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")
    cap = fit_scan_bottom(covered(s, 45), fit)
    assert cap.status == "occluded"
    assert math.isnan(cap.y_px)
    assert math.isnan(cap.y_unc_px)


def test_a_cap_that_is_partly_hidden_is_measured_less_well():
    s = draw(4)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")
    whole, part = fit_scan_bottom(s.patch, fit), fit_scan_bottom(covered(s, 8, left=-16), fit)
    assert part.status == "ok"
    assert abs(part.y_px - s.bottom_y) < 4.0 * part.y_unc_px
    assert part.y_unc_px > whole.y_unc_px


def test_a_cap_that_the_picture_cuts_off_is_out_of_frame():
    s = draw(4)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")
    rows = int(s.bottom_y - s.patch.y0)
    below = Patch(np.ascontiguousarray(s.patch.values[: rows - 4]), s.patch.x0, s.patch.y0)
    assert fit_scan_bottom(below, fit).status == "out_of_frame"
    columns = int(s.shape.x - s.patch.x0)
    beside = Patch(np.ascontiguousarray(s.patch.values[:, : columns + 2]), s.patch.x0, s.patch.y0)
    assert fit_scan_bottom(beside, fit).status == "out_of_frame"


def test_plain_ground_has_no_bottom():
    s = draw(4)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")
    noise = np.random.default_rng(0).normal(1.0, 0.01, s.patch.values.shape).astype(np.float32)
    assert fit_scan_bottom(replace(s.patch, values=noise), fit).status != "ok"


def test_masked_pixels_are_left_out():
    s = draw(6)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")
    values = s.patch.values.copy()
    values[np.random.default_rng(0).uniform(size=values.shape) < 0.005] = math.nan
    cap = fit_scan_bottom(replace(s.patch, values=values), fit)
    assert cap.status == "ok"
    assert abs(cap.y_px - s.bottom_y) < 4.0 * cap.y_unc_px


def test_the_status_of_the_ellipse_is_handed_on():
    s = draw(5)
    lost = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y, level="fast")._replace(status="occluded")
    assert fit_scan_bottom(s.patch, lost).status == "occluded"
