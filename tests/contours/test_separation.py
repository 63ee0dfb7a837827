"""The separation line: where it shows, and where it does not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.separation import find_separation
from wentry_cli.contours.silhouette import fit_silhouette


def scene(seed, stretch, relative, flare, *, noise=0.01, light=None, **body):
    """Frame, row of the corner in the patch and fit: a cavity leaves at ``relative`` half-heights below the centre."""
    along = 60.0 / stretch**2
    probe = draw(seed, stretch=stretch, margin=40)
    row = probe.shape.y - probe.patch.y0 + relative * along
    body |= {"separation_y_px": row, "cavity_flare": flare}
    s = draw(seed, stretch=stretch, margin=40, noise=noise, body=body, light=light)
    top = s.patch.y0 + max(row, s.shape.y - s.patch.y0 - 0.3 * along) + 3.0
    return s, row, fit_silhouette(s.patch, nudged(s.shape, 0.5, seed), top_y_px=top)


def separation(seed, stretch, relative, flare, **light):
    """Error (px) and what was found."""
    s, row, fit = scene(seed, stretch, relative, flare, **light)
    found = find_separation(s.patch, fit)
    return found.y_px - (row + s.patch.y0), found


@pytest.mark.parametrize("stretch", [0.85, 1.0, 1.2])
@pytest.mark.parametrize(("relative", "flare"), [(-0.1, 0.15), (-0.3, 0.15), (-0.3, 0.5), (-0.2, 1.5), (-0.2, 5.0)])
def test_a_corner_that_shows_is_found(stretch, relative, flare):
    errors, pulls = [], []
    for seed in range(6):
        error, found = separation(seed, stretch, relative, flare)
        assert found.status == "ok"
        assert abs(found.left_y_px - found.right_y_px) < 2.0
        errors.append(error)
        pulls.append(error / found.y_unc_px)
    assert np.sqrt(np.mean(np.square(errors))) < 0.35
    assert np.max(np.abs(pulls)) < 3.0


@pytest.mark.parametrize("stretch", [0.85, 1.0, 1.2])
@pytest.mark.parametrize(("relative", "flare"), [(-0.1, 0.3), (-0.1, 0.5), (0.1, 0.5), (-0.3, 0.3)])
def test_a_sphere_that_lets_light_through_leaves_the_corner_where_it_is(stretch, relative, flare):
    """Its wall is darker than itself: as far as the wedge between wall and ground is thin, its inner edge is felt."""
    for seed in range(6):
        error, found = separation(seed, stretch, relative, flare, light={"sphere": 0.25, "dark": 0.06})
        assert found.status == "ok"
        assert abs(error) < 0.35
        assert abs(error) < 2.5 * found.y_unc_px


@pytest.mark.parametrize(
    ("stretch", "relative", "flare"), [(1.0, -0.1, 0.1), (1.0, 0.1, 0.3), (1.2, 0.1, 0.3), (0.85, 0.1, 0.3)]
)
def test_a_wall_that_bends_off_the_sphere_is_known_less_well(stretch, relative, flare):
    """No parabola with the curvature of a usual wall follows it, so the corner depends on how far it is followed."""
    pulls = []
    for seed in range(8):
        error, found = separation(seed, stretch, relative, flare, cavity_bend=1 / 30)
        pulls += [error / found.y_unc_px] if found.status == "ok" else []
    assert len(pulls) >= 5
    assert np.max(np.abs(pulls)) < 2.5


def test_no_cavity_no_line():
    s = draw(1, visible=1.0, margin=30)
    found = find_separation(s.patch, fit_silhouette(s.patch, s.shape))
    assert found.status == "no_edge"
    assert math.isnan(found.y_px)


def test_a_contact_far_above_a_flat_sphere_is_not_seen():
    for seed in range(4):
        for stretch, relative in ((1.8, -0.6), (1.6, 0.1)):
            _, found = separation(seed, stretch, relative, 0.5)
            assert found.status != "ok"
            assert math.isnan(found.y_px)


def pulls_of(seeds, stretch, relative, flare, noise=0.01):
    """Errors over their uncertainties of the frames in which the line was seen, and the uncertainties (px)."""
    seen = [separation(seed, stretch, relative, flare, noise=noise) for seed in range(seeds)]
    unc = np.array([found.y_unc_px for _, found in seen if found.status == "ok"])
    return np.array([error for error, found in seen if found.status == "ok"]) / unc, unc


def test_a_wall_that_leaves_at_a_small_angle_is_known_less_well_or_not_at_all():
    pulls, unc = pulls_of(12, 1.2, 0.2, 0.5)
    assert pulls.size >= 6
    assert np.max(np.abs(pulls)) < 3.0
    assert np.median(unc) > 2.0 * np.median(pulls_of(6, 1.2, -0.2, 0.5)[1])


@pytest.mark.parametrize("noise", [0.05, 0.1])
def test_noise_widens_the_uncertainty(noise):
    pulls, unc = pulls_of(12, 1.0, -0.2, 0.4, noise)
    assert pulls.size >= 8
    assert np.max(np.abs(pulls)) < 3.0
    assert np.median(unc) > 1.3 * np.median(pulls_of(6, 1.0, -0.2, 0.4)[1])


def test_a_drop_on_one_side_is_no_cavity():
    for seed in range(4):
        s, row, fit = scene(seed, 1.0, -0.2, 0.4)
        values = s.patch.values.copy()
        rows, columns = np.indices(values.shape)
        x, y = s.shape.x - s.patch.x0 - 58.0, s.shape.y - s.patch.y0 + 18.0
        values[np.hypot(columns - x, rows - y) < 9.0] = 0.2
        found = find_separation(replace(s.patch, values=values), fit)
        assert found.status == "ok"
        assert abs(found.y_px - row - s.patch.y0) < 3.0 * found.y_unc_px


def test_the_line_moves_with_the_frame():
    error, found = separation(2, 1.1, -0.2, 0.3)
    assert found.y_px == pytest.approx(0.5 * (found.left_y_px + found.right_y_px), abs=1.0)
    assert abs(error) < 1.0
