"""The separation line: where it shows, and where it does not."""

import math

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.separation import find_separation
from wentry_cli.contours.silhouette import fit_silhouette


def separation(seed, stretch, relative, flare):
    """Error (px) and fit for a cavity that leaves at ``relative`` of the half-height below the centre."""
    along = 60.0 / stretch**2
    probe = draw(seed, stretch=stretch, margin=40)
    row = probe.shape.y - probe.patch.y0 + relative * along
    s = draw(seed, stretch=stretch, margin=40, body={"separation_y_px": row, "cavity_flare": flare})
    top = s.patch.y0 + max(row, s.shape.y - s.patch.y0 - 0.3 * along) + 3.0
    fit = fit_silhouette(s.patch, nudged(s.shape, 0.5, seed), top_y_px=top)
    found = find_separation(s.patch, fit)
    return found.y_px - (row + s.patch.y0), found


@pytest.mark.parametrize("stretch", [0.85, 1.0, 1.2])
@pytest.mark.parametrize(("relative", "flare"), [(-0.1, 0.15), (-0.3, 0.15), (-0.3, 0.5), (0.2, 0.5)])
def test_a_corner_that_shows_is_found(stretch, relative, flare):
    errors = []
    for seed in range(6):
        error, found = separation(seed, stretch, relative, flare)
        assert found.status == "ok"
        assert abs(found.left_y_px - found.right_y_px) < 2.0
        assert abs(error) < 4.0 * found.y_unc_px
        errors.append(error)
    assert np.sqrt(np.mean(np.square(errors))) < 0.7


def test_no_cavity_no_line():
    s = draw(1, visible=1.0, margin=30)
    found = find_separation(s.patch, fit_silhouette(s.patch, s.shape))
    assert found.status == "no_edge"
    assert math.isnan(found.y_px)


def test_a_contact_far_above_a_flat_sphere_is_not_seen():
    for seed in range(4):
        _, found = separation(seed, 1.8, -0.6, 0.5)
        assert found.status != "ok"
        assert math.isnan(found.y_px)


def test_the_line_moves_with_the_frame():
    error, found = separation(2, 1.1, -0.2, 0.3)
    assert found.y_px == pytest.approx(0.5 * (found.left_y_px + found.right_y_px), abs=1.0)
    assert abs(error) < 1.0
