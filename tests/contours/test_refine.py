"""The band of pixels about an outline: its sectors, and what is known of its noise before the first step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.contours.scenes import draw
from wentry_cli.contours.band import Band, gather_band, reach_of
from wentry_cli.contours.nuisances import PRIOR_LN_S, first_noise
from wentry_cli.contours.refine import first_belief, solve_band
from wentry_cli.contours.sectors import LEAST_PIXELS

FREE = np.array([0, 1, 3])


def band_of(seed: int, *, hidden: bool = False, **scene: float) -> Band:
    """The band about the true outline of a drawn sphere that is seen all round."""
    s = draw(seed, visible=1.0, **scene)
    settings = np.array([-math.inf, 0.0, 0.0, math.inf, 0.0, float(hidden)])
    vector = s.shape.vector(s.patch.x0, s.patch.y0)
    return gather_band(s.patch.values, vector, settings, reach_of(PRIOR_LN_S), math.nan, LEAST_PIXELS)


def test_an_outline_that_is_hidden_in_part_has_smaller_sectors_of_the_same_pixels() -> None:
    plain, crowded = band_of(0), band_of(0, hidden=True)
    assert len(crowded.rows) > 1.2 * len(plain.rows)
    assert np.array_equal(np.sort(plain.places), np.sort(crowded.places))


@pytest.mark.parametrize("noise", [0.005, 0.02, 0.08])
def test_the_noise_is_known_before_the_first_step(noise: float) -> None:
    told = np.sqrt([first_noise(band_of(seed, noise=noise).plateaus) for seed in range(8)])
    assert np.mean(told[:, 1]) == pytest.approx(noise, rel=0.05)  # of the ground; the sphere is darker
    assert np.all(np.ptp(told[:, 1]) < 0.3 * noise)


def test_where_little_is_seen_beyond_the_edge_the_noise_is_not_told() -> None:
    band = band_of(0)
    assert not first_noise(band.plateaus[:3]).any()


def test_a_noise_known_beforehand_leads_to_the_same_outline() -> None:
    band = band_of(1)
    known, unknown = first_belief(band, PRIOR_LN_S, 1.0), first_belief(band, PRIOR_LN_S, 1.0)
    unknown.noise[:] = 0.0
    step = solve_band(band, known, FREE, 0)[0]
    other = solve_band(band, unknown, FREE, 0)[0]
    assert np.abs(step - other)[[0, 1]].max() < 0.002  # a fraction of the bound, px
    assert np.allclose(known.noise, unknown.noise, rtol=0.05)
