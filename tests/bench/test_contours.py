"""The comparison of contour methods: it compares what it says, and ours is nearer to the bound."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wentry_cli.bench.contours import TOLD, measure_case, run, told_what_is_hidden
from wentry_cli.bench.kept import Chapter
from wentry_cli.bench.outline_cases import CASES, QUICK, find_case
from wentry_cli.bench.outline_frames import bounds_left, bounds_of, draw_frame
from wentry_cli.bench.outline_peers import NOTHING, recipes
from wentry_cli.bench.page import write_page
from wentry_cli.bench.table import read_csv
from wentry_cli.bench.targets import OURS, list_targets

BOTTOM = 3
DOCS = Path(__file__).resolve().parents[2] / "docs"
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


def test_what_is_left_is_bounded_by_what_droplets_hide_and_by_what_they_dim(rows):
    case = find_case("droplets on 32 %")
    whole = bounds_of(case)[:4]
    frame = draw_frame(case, 3, 1)
    told, known = bounds_left(case, frame)[:, :4]
    assert (whole < known).all()
    assert (known < told).all()
    assert (frame.clear[frame.hidden].min(), frame.clear[~frame.hidden].max()) == pytest.approx((0.0, 1.0), abs=1e-3)
    assert bounds_left(case, replace(frame, hidden=np.zeros_like(frame.hidden)))[0, :4] == pytest.approx(
        whole, rel=0.01
    )
    row = pick(rows, "droplets on 20 %", "wentry accurate", "y")
    assert 1.0 < row.limit_known < row.limit < 2.0
    assert row.ratio_to_left == pytest.approx(row.ratio_to_bound / row.limit, rel=0.3)
    assert 0.1 < row.ratio_to_left_median < 3.0
    assert math.isnan(pick(rows, "noise 1 %", "wentry accurate", "y").limit)
    assert math.isnan(pick(rows, "droplets on 20 %", "wentry accurate", "local_bottom_y").ratio_to_left)


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


def test_without_peers_ours_is_the_same(rows):
    case = find_case("noise 1 %")
    alone = measure_case(case, seed=7, quick=True, peers=False)
    assert {row.method for row in alone} == {"wentry accurate", "wentry fast"}
    beside = [row for row in rows if row.case == case.name and row.method.startswith("wentry")]
    assert [replace(row, time_us=0.0) for row in alone] == [replace(row, time_us=0.0) for row in beside]


def test_the_page_tells_the_bound_of_what_is_left_where_it_was_looked_for(rows, tmp_path):
    one = "droplets on 20 %, y₀"
    page = write_page([Chapter("contours", rows)], tmp_path, ()).read_text("utf-8")
    row, told = (pick(rows, "droplets on 20 %", name, "y") for name in ("wentry accurate", TOLD))
    (line,) = (line for line in page.splitlines() if line.startswith(f"| {one} |"))
    assert f"| {row.limit:.2f} | {row.limit_known:.2f} | {row.ratio_to_bound:.2f} |" in line
    assert f"| {told.ratio_to_left:.2f} ({told.ratio_to_left_median:.2f}) |" in line
    without = [replace(row, limit=math.nan, ratio_to_left=math.nan) for row in rows]  # measured by an earlier version
    page = write_page([Chapter("contours", without)], tmp_path, ()).read_text("utf-8")
    assert "the bound of what is left\n" not in page
    assert one not in page


def test_targets_tell_the_limit_where_it_was_looked_for():
    rows = read_csv(DOCS / "accuracy_contours.csv")
    looked_for = [replace(row, limit=1.9, ratio_to_left=1.1) if row.method == OURS else row for row in rows]
    blind = [replace(row, limit=math.nan, ratio_to_left=math.nan) for row in rows]
    told, untold = (
        next(target.measured for target in list_targets(these) if target.what.startswith("droplets on 42 %"))
        for these in (looked_for, blind)
    )
    assert "; of what is left 1.10, whose limit is 1.90" in told
    assert told.replace("; of what is left 1.10, whose limit is 1.90", "") == untold
