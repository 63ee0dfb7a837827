"""The cavity's silhouette against drawn cavities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.neck import find_necks
from wentry_cli.cavity.profile import CavityProfile, measure_profile
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]


def waist(y: Floats) -> Floats:
    """Half-width with a neck of 16 px at row 135."""
    return 38.0 + 22.0 * np.cos((y - 60.0) / 75.0 * np.pi)


def measure(picture, seed: int = 0) -> CavityProfile:
    return measure_profile(picture.patch(seed), picture.outline(), surface_y_px=picture.surface)


def edge_errors(picture, profile: CavityProfile) -> tuple[Floats, Floats]:
    y = profile.y_px
    use = (y > picture.surface + 10) & (y < picture.outline().top_y_px)
    true = picture.half_width(y)
    return (picture.axis - profile.left_px - true)[use], (profile.right_px - picture.axis - true)[use]


SCENES = {
    "bright core": {},
    "wide core": {"core": 0.8},
    "black core": {"core_level": 0.06},
    "lamps in a black core": {"core_level": 0.06, "lamps": ((150, 120, 8, 0.9), (151, 160, 5, 0.9))},
    "dark spots in a bright core": {"lamps": ((147, 110, 5, 0.1), (152, 165, 6, 0.1))},
    "bubbles outside": {"bubbles": ((95.0, 130.0, 5.0), (201.0, 140.0, 6.0), (60, 100, 8.0), (183.0, 134.0, 4.0))},
}


@pytest.mark.parametrize("name", SCENES)
def test_edges_are_sub_pixel_whatever_the_core_shows(drawing, name: str) -> None:
    picture = drawing(waist, **SCENES[name])
    profile = measure(picture)
    assert profile.status == "ok"
    for error in edge_errors(picture, profile):
        assert np.mean(np.isfinite(error)) > 0.97
        assert abs(np.nanmean(error)) < 0.05
        assert np.nanstd(error) < 0.07
        assert np.nanmax(np.abs(error)) < 0.4


@pytest.mark.parametrize("name", SCENES)
def test_lamps_and_bubbles_draw_no_false_necks(drawing, name: str) -> None:
    profile = measure(drawing(waist, **SCENES[name]))
    necks = find_necks(profile.y_px, profile.width_px, edge_unc_px=profile.edge_unc_px)
    assert len(necks) == 1
    assert necks[0].y_px == pytest.approx(135.0, abs=0.4)
    assert necks[0].radius_px == pytest.approx(16.0, abs=0.08)


@pytest.mark.parametrize("contrast", [0.15, 0.3, 0.5])
def test_a_faint_cavity_beside_black_glare_is_as_good_as_a_black_one(drawing, contrast: float) -> None:
    picture = drawing(waist, noise=0.02, lamps=((150, 120, 3, 0.9),))
    patch = picture.patch()
    faint = 1.0 - contrast * (1.0 - patch.values)
    faint[118:122, 145:156] = 0.2  # a line of glare in the core
    profile = measure_profile(replace(patch, values=faint), picture.outline(), surface_y_px=picture.surface)
    assert profile.status == "ok"
    for error in edge_errors(picture, profile):
        assert np.mean(np.isfinite(error)) > 0.97
        assert abs(np.nanmean(error)) < 0.05
        assert np.nanstd(error) < 0.07


def test_stated_edge_uncertainty_is_the_scatter(drawing) -> None:
    scatter, stated = [], []
    for noise in (0.01, 0.05):
        for seed in range(4):
            picture = drawing(waist, noise=noise)
            profile = measure(picture, seed)
            error, _ = edge_errors(picture, profile)
            scatter.append(np.nanstd(error))
            stated.append(profile.edge_unc_px)
    ratio = np.array(scatter) / np.array(stated)
    assert 0.7 < np.mean(ratio) < 1.6


@pytest.mark.parametrize("radius", [1.5, 2.0, 3.0, 4.0, 6.0, 10.0])
def test_thin_necks_are_right_where_blur_hides_the_walls(drawing, radius: float) -> None:
    def neck(y: Floats) -> Floats:
        return np.sqrt(radius**2 + (y - 135.0) ** 2 * radius / 60.0)

    errors = []
    for seed in range(4):
        profile = measure(drawing(neck, axis=150.0 + seed / 4), seed)
        found = find_necks(profile.y_px, profile.width_px, edge_unc_px=profile.edge_unc_px)
        near = [item for item in found if abs(item.y_px - 135.0) < 5.0]
        assert len(near) == 1
        errors.append(near[0].radius_px - radius)
    assert abs(np.mean(errors)) < 0.1


@pytest.mark.parametrize("blur", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("radius", [4.0, 7.0, 12.0])
def test_blur_draws_no_curved_neck_outward(drawing, blur: float, radius: float) -> None:
    errors, blurs, doubts = [], [], []
    for seed in range(4):
        middle = 135.0 + 0.27 * seed
        picture = drawing(lambda y, at=middle: np.minimum(np.hypot(radius, y - at), 60.0), blur=blur, core_level=0.06)
        profile = measure(picture, seed)
        found = find_necks(profile.y_px, profile.width_px, edge_unc_px=profile.edge_unc_px, blur_px=profile.blur_px)
        (near,) = [item for item in found if abs(item.y_px - middle) < 5.0]
        errors.append(near.radius_px - radius)
        doubts.append(near.radius_unc_px)
        blurs.append(profile.blur_px)
    assert np.mean(blurs) == pytest.approx(np.hypot(blur, 12.0**-0.5), rel=0.06)
    assert abs(np.mean(errors)) < max(0.05, 2.0 * np.mean(doubts))


@pytest.mark.parametrize("blur", [0.8, 1.5, 2.0])
def test_walls_that_are_thin_for_their_blur_are_told_by_their_light(drawing, blur: float) -> None:
    errors = []
    for seed in range(4):
        picture = drawing(lambda y: np.hypot(8.0, 0.3 * (y - 135.0)), blur=blur, axis=150.0 + seed / 4)
        profile = measure(picture, seed)
        row = int(np.flatnonzero(profile.y_px == 135.0)[0])
        errors.append(0.5 * float(np.mean(profile.width_px[row - 2 : row + 3])) - 8.0)
    assert abs(np.mean(errors)) < 0.1


def test_rows_where_the_cavity_has_closed_have_no_width(drawing) -> None:
    def parted(y: Floats) -> Floats:
        return np.where((y > 120.0) & (y < 150.0), 0.0, waist(y))

    profile = measure(drawing(parted))
    inside = (profile.y_px > 124) & (profile.y_px < 146)
    np.testing.assert_array_equal(profile.width_px[inside], 0.0)
    assert np.all(profile.width_px[(profile.y_px > 60) & (profile.y_px < 116)] > 20.0)


def test_a_cavity_cut_by_the_patch_says_so(drawing) -> None:
    whole = drawing(waist).patch()
    outline = drawing(waist).outline()
    narrow = Patch(whole.values[:, 115:185], x0=115, y0=0)
    assert measure_profile(narrow, outline, surface_y_px=30.0).cut_off
    assert not measure_profile(whole, outline, surface_y_px=30.0).cut_off


def test_place_of_the_patch_does_not_matter(drawing) -> None:
    picture = drawing(waist)
    whole = picture.patch()
    part = Patch(np.ascontiguousarray(whole.values[20:280, 60:240]), x0=60, y0=20)
    one = measure_profile(whole, picture.outline(), surface_y_px=30.0)
    other = measure_profile(part, picture.outline(), surface_y_px=30.0)
    np.testing.assert_allclose(one.left_px, other.left_px, atol=0.05)
    np.testing.assert_array_equal(one.y_px, other.y_px)


def test_nothing_to_see_has_a_status(drawing) -> None:
    picture = drawing(waist)
    plain = Patch(np.ones((300, 300), np.float32))
    assert measure_profile(plain, picture.outline(), surface_y_px=30.0).status == "no_edge"
    high = replace(picture.outline(), y_px=33.0)
    assert measure_profile(picture.patch(), high, surface_y_px=30.0).status == "out_of_frame"


def nested(ledge: float, radius: float, flare: float):
    """Half-width of a wide cavity down to a ledge; below it the square of the half-width grows evenly."""
    return lambda y: np.where(y < ledge, 75.0, np.sqrt(radius**2 + flare * np.maximum(y - ledge, 0.0)))


@pytest.mark.parametrize("ledge", [120.1, 120.5, 120.9])
@pytest.mark.parametrize("radius", [4.0, 8.0, 14.0])
def test_a_neck_at_a_ledge_is_read_from_the_light_beside_it(drawing, ledge: float, radius: float) -> None:
    """The blur of the ledge darkens the first rows below it, where the wall is steep and the neck is narrowest."""
    picture = drawing(nested(ledge, radius, 40.0), noise=0.01, core=0.0)
    profile = measure(picture)
    assert profile.ledges_y_px == pytest.approx([ledge], abs=0.15)
    (neck,) = find_necks(
        profile.y_px, profile.width_px, edge_unc_px=profile.edge_unc_px, ledges_y_px=profile.ledges_y_px
    )
    assert neck.y_px == pytest.approx(ledge, abs=0.15)
    assert neck.radius_px == pytest.approx(radius, abs=0.6)
    assert abs(neck.radius_px - radius) < 3.0 * neck.radius_unc_px


def test_a_wall_without_a_ledge_has_none(drawing) -> None:
    assert measure(drawing(waist)).ledges_y_px.size == 0
