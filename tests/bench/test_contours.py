"""The comparison of contour methods: it compares what it says, and ours is nearer to the bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from wentry_cli.bench.contours import TOLD, run, told_what_is_hidden
from wentry_cli.bench.outline_cases import CASES, QUICK, find_case
from wentry_cli.bench.outline_frames import bounds_of, draw_frame
from wentry_cli.bench.outline_peers import NOTHING, recipes

BOTTOM = 3
ROUGH = {"minEnclosingCircle", "HoughCircles", "lowest dark pixel"}


@pytest.fixture(scope="module")
def rows():
    return run(quick=True, seed=7)


def pick(rows, case, method, quantity):
    (row,) = (r for r in rows if (r.case, r.method, r.quantity) == (case, method, quantity))
    return row


def test_ours_is_near_the_bound_and_ordinary_recipes_are_not(rows):
    accurate = pick(rows, "noise 1 %", "wentry accurate", "bottom_y")
    ordinary = pick(rows, "noise 1 %", "fitEllipse", "bottom_y")
    half_pixel = pick(rows, "noise 1 %", "fitEllipse + ½ px", "bottom_y")
    assert accurate.ratio_to_bound < 2.0
    assert accurate.failures == 0.0
    assert ordinary.ratio_to_bound > 30.0
    assert ordinary.bias == pytest.approx(-0.5, abs=0.2)
    assert abs(half_pixel.bias) < abs(ordinary.bias)


def test_every_method_has_a_time_and_its_shares(rows):
    assert {r.chapter for r in rows} == {"contours"}
    assert {r.case for r in rows} == set(QUICK)
    for row in rows:
        assert row.time_us > 0.0
        assert 0.0 <= row.failures <= 1.0
        assert 0.0 <= row.measured <= 1.0
        assert math.isfinite(row.rmse) or row.failures == 1.0


def test_only_ours_states_uncertainties(rows):
    stated = {r.method for r in rows if math.isfinite(r.pull)}
    assert stated == {"wentry accurate", "wentry fast", TOLD}
    assert {r.case for r in rows if r.method == TOLD} == {"droplets on 20 %"}


def test_who_is_told_what_is_hidden_loses_the_pixels_that_droplets_change_and_no_others():
    case = find_case("droplets on 20 %")
    frame = draw_frame(case, 3, 0)
    assert 0.02 < frame.hidden.mean() < 0.6
    assert draw_frame(replace(case, droplets=0.0), 3, 0).hidden is None
    levels = frame.region[frame.hidden]
    assert levels.std() > 10.0 * case.noise  # droplets are darker or brighter than what they hide
    told, _ = told_what_is_hidden(case)(frame)
    assert told[:4] == pytest.approx(frame.truth, abs=0.05)
    masked = np.where(frame.hidden, 0.0, frame.region)
    blind, _ = told_what_is_hidden(case)(replace(frame, region=masked.astype(np.float32)))
    assert blind.tobytes() == told.tobytes()  # whatever was in these pixels


@pytest.mark.parametrize("name", recipes())
def test_a_recipe_sees_a_clean_sphere(name):
    frame = draw_frame(find_case("λ 1.0"), 3, 0)
    x, _, stretch, bottom = recipes()[name](frame.region, frame.guess.radius, 0.0)
    assert x == pytest.approx(frame.truth[0], abs=2.0)
    assert bottom == pytest.approx(frame.truth[BOTTOM], abs=1.5)
    if name not in ROUGH:
        assert stretch == pytest.approx(frame.truth[2], abs=0.02)


@pytest.mark.parametrize("name", sorted(set(recipes()) - {"lowest dark pixel"}))
def test_a_recipe_without_a_sphere_has_no_number(name):
    assert recipes()[name](np.ones((60, 60), np.float32), 20.0, 30.0) == pytest.approx(NOTHING, nan_ok=True)


def test_names_are_cases_of_their_own():
    assert len({case.name for case in CASES}) == len(CASES)


def test_the_bound_grows_with_what_hides_the_sphere():
    clean = bounds_of(find_case("noise 1 %"))
    assert bounds_of(find_case("motion 3.6 px"))[BOTTOM] > clean[BOTTOM]
    assert bounds_of(find_case("20 % of the arc"))[2] > clean[2]
    assert (bounds_of(find_case("noise 5 %"))[:4] > 3.0 * clean[:4]).all()
