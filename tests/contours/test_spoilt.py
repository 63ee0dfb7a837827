"""Sectors that are hidden in part are measured by the pixels that are left."""

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from tests.contours.test_silhouette import bound
from wentry_cli.bench.contours import ours
from wentry_cli.bench.outline_cases import find_case
from wentry_cli.bench.outline_frames import bounds_left, draw_frame
from wentry_cli.contours.likelihood import INSIDE, INV_S, OUTSIDE, STATE, expect
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.contours.spoilt import leave_out_scraps, without_spoilt


def a_flat_band(rows: int, columns: int):
    """Every pixel of a patch in sectors of two lines each, expected to be 1 on either side of the edge."""
    places = np.arange(rows * columns)
    starts = np.arange(0, rows * columns + 1, 2 * columns)
    state = np.zeros((len(starts) - 1, STATE))
    state[:, [INV_S, INSIDE, OUTSIDE]] = 1.0
    return places, starts, state


def test_a_speck_is_masked_with_its_neighbours_and_nothing_else():
    values = np.ones((20, 30), np.float32)
    values[9, 12] = 0.5
    places, starts, state = a_flat_band(20, 30)
    pixels = np.vstack([np.full(600, 0.7), values.reshape(-1)[places]])
    room = expect(pixels, starts, state, np.full(2, 1e-4), np.inf)
    cleaned = without_spoilt(values, room, starts, places, state, np.full(2, 1e-6), np.full(10, 0.02))
    y, x = np.mgrid[:20, :30]
    assert np.array_equal(np.isnan(cleaned), np.maximum(abs(y - 9), abs(x - 12)) <= 1)
    assert not np.isnan(values).any()


def test_what_an_edge_that_is_off_would_explain_is_not_masked_where_it_may_be_off():
    values = np.full((20, 30), 0.5, np.float32)
    values[[5, 15], 12] = 0.6  # on the edge, which is 1 brighter outside: as if it lay .25 px farther inside
    places, starts, state = a_flat_band(20, 30)
    state[:, INSIDE] = 0.0
    room = expect(np.vstack([np.zeros(600), values.reshape(-1)]), starts, state, np.full(2, 1e-4), np.inf)
    off = np.where(np.arange(10) < 5, 0.15**2, 0.01**2)
    cleaned = without_spoilt(values, room, starts, places, state, np.full(2, 1e-6), off)
    assert not np.isnan(cleaned[:10]).any()
    assert np.isnan(cleaned[14:17, 11:14]).all()


def test_what_is_left_of_a_sector_counts_only_where_it_tells_of_the_edge():
    levels = np.ones(8, np.float32)
    levels[[0, 4]] = np.nan
    information = np.array([13.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    leave_out_scraps(levels, np.array([0, 4, 8]), np.arange(8), information)
    assert np.isnan(levels[:4]).all()
    assert np.isnan(levels[4:]).tolist() == [True, False, False, False]


def test_droplets_cost_no_more_than_what_they_hide():
    spread, pull = [], []
    for seed in range(40):
        s = draw(seed, visible=1.0, light={"droplets": 0.32})
        fit = fit_silhouette(s.patch, nudged(s.shape, 1.0, seed))
        assert fit.status == "ok"
        error = [fit.center_x_px - s.shape.x, fit.center_y_px - s.shape.y, fit.stretch - s.shape.stretch]
        unc = [fit.center_x_unc_px, fit.center_y_unc_px, fit.stretch_unc]
        spread.append(np.array(unc) / bound(visible=1.0)[:3])
        pull.append(np.array(error) / unc)
    assert np.all(np.median(spread, axis=0) < 1.6)
    assert np.all(np.sqrt(np.mean(np.square(pull), axis=0)) < 1.3)


@pytest.mark.parametrize(("stream", "number"), [(1, 863), (1, 987), (3, 274), (3, 376)])
def test_droplets_on_one_side_do_not_pull_the_outline_over(stream, number):
    # what is left lies on one side, or half of the sectors have droplets on their ground
    case = find_case("droplets on 42 %")
    frame = draw_frame(case, stream, number)
    values, unc = ours("accurate", case)(frame)
    bound = bounds_left(case, frame)[0, :4]
    assert np.all(np.abs(values[:4] - frame.truth) < 5.0 * bound)
    assert np.all(unc[:4] < 3.0 * bound)
