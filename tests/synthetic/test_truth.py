from __future__ import annotations

import csv

import numpy as np
import pytest
import yaml

from tests.synthetic.drops import SOFT, VERY_SOFT, make_scene
from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.periods import PERIOD_DEFINITION, find_periods
from wentry_cli.synthetic.ring_cavity import find_contact
from wentry_cli.synthetic.side_view import see_instant
from wentry_cli.synthetic.stretch_dynamics import solve_oscillation
from wentry_cli.synthetic.truth import (
    NECK_COLUMNS,
    TRUTH_COLUMNS,
    find_separation,
    summarise_truth,
    tabulate_side,
    tabulate_top,
    write_truth,
)


def test_truth_files_have_the_columns_of_the_contract(tmp_path):
    course, times = plan_scene(make_scene())
    write_truth(course, tmp_path, times["side"], None)
    with (tmp_path / "truth.csv").open() as file:
        rows = list(csv.reader(file))
    assert tuple(rows[0]) == TRUTH_COLUMNS
    assert len(rows) == times["side"].size + 1
    assert rows[1][8] == ""
    with (tmp_path / "necks.csv").open() as file:
        assert tuple(next(csv.reader(file))) == NECK_COLUMNS
    summary = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    wanted = {
        "impact_time_s", "u0_m_s", "t_p_s", "y_p_m", "pinch_off_cavity", "seal_type", "periods", "peaks",
        "delta_u_over_u0", "scale_px_per_m", "surface_y_px",
    }  # fmt: skip
    assert wanted <= set(summary)
    assert summary["seal_type"] == "deep_seal"


def test_necks_of_the_table_shrink_to_the_pinch_off(soft_course, tmp_path):
    times = soft_course.times(2000.0)
    write_truth(soft_course, tmp_path, times, None)
    with (tmp_path / "necks.csv").open() as file:
        rows = list(csv.DictReader(file))
    t_p = soft_course.cavity.t_p_s
    assert all(float(r["t_s"]) < t_p for r in rows)
    last = [r for r in rows if float(r["t_s"]) > t_p - 0.003]
    closing = min(last, key=lambda r: float(r["radius_m"]))["neck"]
    t = np.array([float(r["t_s"]) for r in last if r["neck"] == closing])
    square = np.array([float(r["radius_m"]) ** 2 for r in last if r["neck"] == closing])
    slope, intercept = np.polyfit(t, square, 1)
    assert slope < 0.0
    assert -intercept / slope == pytest.approx(t_p, abs=1e-4)


def test_misfit_moves_the_lowest_point_and_the_half_width():
    plain = plan_scene(make_scene())[0]
    misfit = plan_scene(make_scene(switches={"misfit": [0.0, 0.01]}))[0]
    times = np.array([-0.004])
    (a,), (b,) = tabulate_side(plain, times), tabulate_side(misfit, times)
    assert b["stretch"] == pytest.approx(1.01, abs=1e-5)
    assert b["y_b_m"] == pytest.approx(a["y_b_m"], abs=1e-7)
    assert b["y_c_m"] - a["y_c_m"] == pytest.approx(0.01 * 0.0255, abs=1e-7)


def test_impact_falls_between_frames_and_clock_starts_at_the_first():
    course, times = plan_scene(make_scene())
    row = tabulate_side(course, times["side"])[0]
    impact = summarise_truth(course, times["side"])["impact_time_s"]
    assert row["time_s"] == 0.0
    assert impact == pytest.approx(-row["t_s"], rel=1e-8)
    phase = (impact * 2000.0) % 1.0
    assert 0.05 < phase < 0.95


def test_frames_before_impact_are_measurable_only_when_the_sphere_is_whole(soft_course):
    rows = tabulate_side(soft_course, np.array([-0.05, -0.003, 0.0005, 0.05]))
    assert [r["measurable"] for r in rows] == [0, 1, 0, 1]


def test_periods_join_and_peaks_lie_inside(soft_course):
    periods = find_periods(soft_course)
    assert periods.starts_s[0] == 0.0
    assert periods.starts_s[1:] == periods.ends_s[:-1]
    for start, end, peak in zip(periods.starts_s, periods.ends_s, periods.peak_times_s, strict=False):
        assert start < peak < end
    stretch, rate = soft_course.motion.stretch(np.array(periods.peak_times_s))
    np.testing.assert_allclose(stretch, periods.peaks, atol=1e-6)
    assert np.abs(rate).max() < 0.1


def test_peaks_are_those_of_the_stretch_in_the_table_of_frames():
    course, times = plan_scene(make_scene(switches={"misfit": [0.0, 0.01]}))
    truth = summarise_truth(course, times["side"])
    rows = tabulate_side(course, np.array(truth["peak_times_s"]))
    np.testing.assert_allclose([row["stretch"] for row in rows], truth["peaks"], rtol=1e-6)
    assert truth["stretch_peak_n"] in truth["peaks"]


def test_speed_lost_in_the_first_period_is_a_difference_of_velocities(soft_course):
    truth = summarise_truth(soft_course, np.array([-0.005]))
    end = truth["periods"][0]["end_s"]
    v = float(soft_course.motion.center(end)[1])
    assert truth["delta_u_over_u0"] == pytest.approx((truth["u0_m_s"] + v) / truth["u0_m_s"], rel=1e-6)


def test_top_view_recedes_and_is_hidden_after_dome_over():
    top = {"width": 200, "height": 200, "scale_px_per_m": 1500.0, "camera_distance_m": 1.5}
    course, _ = plan_scene(make_scene(top=top))
    early, late, over = tabulate_top(course, np.array([-0.002, 0.02, course.dome_over_s + 0.002]))
    assert early["magnification"] > 1.0 > late["magnification"]
    assert early["measurable"] == 1
    assert over["measurable"] == 0


def test_separation_is_where_the_drawn_wall_meets_the_sphere(soft_course):
    for t in (0.012, 0.04, 0.08):
        now = see_instant(soft_course, t)
        separation = find_separation(soft_course, now)
        contact = float(find_contact(soft_course.motion, soft_course.scene.physics, np.array([t]))[0][0])
        assert separation == pytest.approx(-contact, abs=1e-9)
        assert now.depth[-1] == pytest.approx(contact, abs=1e-9)


@pytest.mark.parametrize("misfit", [[0.0, 0.0], [0.003, 0.004], [-0.004, 0.003], [0.0, -0.01]])
def test_the_wall_leaves_the_outline_as_it_is_drawn(misfit):
    course, _ = plan_scene(make_scene(switches={"misfit": misfit}))
    for t in (0.012, 0.04, 0.06):
        now = see_instant(course, t)
        separation = find_separation(course, now)
        right = now.outline[:721]  # from the lowest point over the right side to the highest
        drawn = np.interp(separation, right[:, 1], right[:, 0])
        assert separation == pytest.approx(-now.depth[-1], abs=1e-9)
        assert now.wall[-1] == pytest.approx(drawn, abs=1e-6)


@pytest.mark.parametrize("kind", ["water_entry", "surface_impact"])
@pytest.mark.parametrize(
    "switches",
    [
        {},
        {"misfit": [0.003, 0.004]},
        {"misfit": [-0.01, 0.01]},
        {"tilt_deg": 8.0},
        {"tilt_deg": -5.0, "misfit": [0.01, 0.0]},
    ],
)
def test_impact_is_the_contact_of_the_lowest_point(kind, switches):
    course, _ = plan_scene(make_scene(kind=kind, switches=switches))
    before, impact, after = tabulate_side(course, np.array([-1e-4, 0.0, 1e-4]))
    assert impact["y_b_m"] == pytest.approx(0.0, abs=1e-8)
    assert before["y_b_m"] > 1e-4
    assert after["y_b_m"] < 1e-8
    times = np.array([0.002, 0.012, 0.03])
    bottom = [row["y_b_m"] for row in tabulate_side(course, times)]
    np.testing.assert_allclose(course.motion.bottom(times), bottom, atol=2e-8)


def test_tilt_leaves_the_stretch_and_lowers_the_lowest_point(soft_course):
    tilted, _ = plan_scene(make_scene(switches={"tilt_deg": 10.0}))
    t = float(soft_course.motion.stretch(np.linspace(0.0, 0.02, 200))[0].argmax()) * 0.02 / 199
    (row,) = tabulate_side(tilted, np.array([t]))
    stretch = float(tilted.motion.stretch(t)[0])
    assert row["stretch"] == pytest.approx(stretch, rel=1e-12)
    c, s = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
    below = 0.0255 * np.hypot(c / stretch**2, s * stretch)
    assert row["y_c_m"] - row["y_b_m"] == pytest.approx(below, rel=1e-6)
    now = see_instant(tilted, t)
    # a wide body whose lower pole moves to the right has its lowest point on the left
    assert now.outline[int(np.argmin(now.outline[:, 1])), 0] < 0.0
    assert now.outline[0, 0] > 0.0


def test_top_view_shows_the_greatest_half_width():
    top = {"width": 200, "height": 200, "scale_px_per_m": 1500.0}
    course, _ = plan_scene(make_scene(top=top, switches={"misfit": [0.0, 0.01]}))
    (above,), (beside,) = (f(course, np.array([-0.002])) for f in (tabulate_top, tabulate_side))
    assert above["stretch"] == beside["stretch"] == pytest.approx(1.01, abs=1e-6)
    assert above["radius_px"] == pytest.approx(1.01 * 0.0255 * 1500.0, abs=1e-4)


def test_a_plate_flattens_the_sphere():
    view = {"width": 200, "height": 200, "scale_px_per_m": 1500.0}
    plain, flat = (
        plan_scene(make_scene(kind="surface_impact", side=view, physics={"contact_patch": c}))[0] for c in (0.0, 0.15)
    )
    t = np.linspace(0.0, 0.01, 60)
    row = tabulate_side(flat, t)[30]
    now = see_instant(flat, float(t[30]))
    patch = now.outline[now.outline[:, 1] <= 1e-12]
    assert row["stretch"] > 1.2
    assert row["y_b_m"] == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(patch[:, 0]) > 0.3 * 0.0255
    assert flat.motion.center(t[30])[0] < plain.motion.center(t[30])[0]
    y, v, _ = flat.motion.center(t[2:])
    np.testing.assert_allclose(np.gradient(y, t[2:])[2:-2], v[2:-2], atol=0.05 * np.abs(v).max())


@pytest.mark.parametrize(("law", "diameter"), [(SOFT, 0.051), (VERY_SOFT, 0.051), (VERY_SOFT, 0.1)])
def test_the_slow_part_of_the_stretch_is_gone_when_the_first_period_ends(law, diameter):
    """The linear equations about rest split a state into a damped swing and a part that only decays."""
    course, times = plan_scene(make_scene(sphere={"diameter_m": diameter, "law": law}, height_m=2.27))
    scene, ends = course.scene, np.array(find_periods(course).ends_s[:1])
    material, speed = scene.sphere.law, scene.speed_m_s
    tau = course.motion.state(ends)[2]
    state = solve_oscillation(material, diameter / 2, 1070.0, speed, scene.physics, end_s=tau[0] * 1.1).dense(tau)
    stiffness = 5.0 / (2.0 * 1070.0 * (diameter / 2) ** 2) / 3.0 * 12.0
    flow = 3.0 * material.eps0_dot_1_s * material.xi**material.n * material.g_t_pa
    total, second = stiffness * (material.g_inf_pa + material.g_t_pa), stiffness * material.g_t_pa
    values, modes = np.linalg.eig(np.array([[0.0, 1.0, 0.0], [-total, 0.0, second], [flow, 0.0, -flow]]))
    slow = int(np.argmin(np.abs(values.imag)))
    away = np.stack([np.log(state[0]), state[1] / state[0], np.log(state[2])])
    part = (modes[0, slow] * (np.linalg.inv(modes)[slow] @ away)).real
    assert values[slow].real < 0.0
    assert np.all(np.abs(part) < 0.005)
    assert summarise_truth(course, times["side"])["period_definition"] == PERIOD_DEFINITION
