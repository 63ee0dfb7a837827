from __future__ import annotations

import numpy as np
import pytest

from tests.synthetic.drops import VERY_SOFT, make_scene
from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.side_view import find_core_share, see_instant
from wentry_cli.synthetic.truth import find_necks, find_separation

LEDGE_SOFT = {"g_inf_pa": 1235.0, "g_t_pa": 1235.0, "eps0_dot_1_s": 0.0042}


def test_every_ring_obeys_the_collapse_law(soft_course):
    cavity = soft_course.cavity
    k = cavity.depth.size // 2
    s = 0.3 * (cavity.closes()[k] - cavity.born[k])
    expected = cavity.radius[k] ** 2 + 2 * cavity.radius[k] * cavity.speed[k] * s - 9.81 * cavity.depth[k] * s**2
    assert cavity.wall(cavity.born[k] + s)[k] ** 2 == pytest.approx(expected, rel=1e-12)


def test_a_ring_closes_when_its_radius_is_zero(soft_course):
    cavity = soft_course.cavity
    closes = cavity.closes()
    k = int(np.argmin(closes))
    assert cavity.wall(closes[k] - 1e-7)[k] < 2e-4
    assert cavity.wall(closes[k] + 1e-9)[k] == 0.0


def test_rings_grow_from_the_sphere_and_sink_in_order(soft_course):
    cavity = soft_course.cavity
    assert np.all(np.diff(cavity.born) >= 0.0)
    assert np.all(cavity.radius <= soft_course.motion.radius_m * soft_course.motion.stretch(cavity.born)[0] * 1.0001)
    assert np.all(np.isnan(cavity.wall(-0.001)))


def test_seals_emerge(soft_course, rigid_course, sealed_course):
    assert soft_course.cavity.seal_type == "deep_seal"
    assert soft_course.cavity.pinch_off_cavity == 2
    assert rigid_course.cavity.seal_type == "deep_seal"
    assert sealed_course.cavity.seal_type == "sphere_seal"


def test_soft_cavity_is_shallower_and_wider_than_the_rigid_one(soft_course, rigid_course):
    assert soft_course.cavity.y_p_m > rigid_course.cavity.y_p_m
    assert np.nanmax(soft_course.cavity.wall(0.05)) > np.nanmax(rigid_course.cavity.wall(0.05))


def test_rigid_pinch_off_lies_in_the_published_band(rigid_course):
    speed, diameter = rigid_course.motion.speed_m_s, 0.051
    froude = speed / np.sqrt(9.81 * diameter)
    slope = (rigid_course.cavity.t_p_s * speed / diameter - 0.5) / froude
    assert 1.1 < slope < 1.6


def test_pinch_off_is_the_first_neck_to_close(soft_course):
    cavity = soft_course.cavity
    necks = find_necks(soft_course, cavity.t_p_s - 1e-5)
    y, radius = min(necks, key=lambda neck: neck[1])
    assert y == pytest.approx(cavity.y_p_m, abs=2e-3)
    assert radius < 1.5e-3
    assert all(r > 2e-3 for at, r in necks if abs(at - cavity.y_p_m) > 5e-3)


def test_radius_before_pinch_off_is_a_square_root_that_ends_at_t_p(soft_course):
    cavity = soft_course.cavity
    t = cavity.t_p_s - np.linspace(0.0005, 0.004, 15)
    radius = np.array([min(r for _, r in find_necks(soft_course, float(s))) for s in t])
    slope, intercept = np.polyfit(t[:6], radius[:6] ** 2, 1)
    assert -intercept / slope == pytest.approx(cavity.t_p_s, abs=3e-5)


def test_contact_line_recedes_up_the_sphere_that_seals(sealed_course):
    course, t_p = sealed_course, sealed_course.cavity.t_p_s
    now = see_instant(course, t_p - 1e-5)
    separation = find_separation(course, now)
    top = now.y_c_m + course.motion.radius_m / now.stretch**2
    assert separation == pytest.approx(top, abs=0.2 * course.motion.radius_m)


def test_second_expansion_starts_a_cavity_where_the_contact_line_is(soft_course):
    (start, depth), *_ = soft_course.cavity.starts
    k = int(np.argmin(np.abs(soft_course.cavity.depth - depth)))
    assert soft_course.cavity.born[k] == pytest.approx(start, abs=1e-4)
    assert soft_course.cavity.number[k + 2] == soft_course.cavity.number[k - 2] + 1


def test_a_narrow_lamp_leaves_the_core_nearly_black():
    assert find_core_share(5.0) < 0.2
    assert 0.6 < find_core_share(60.0) < 0.751


def test_period_growth_and_factor_slow_the_oscillation():
    slow = plan_scene(make_scene(physics={"period_factor": 1.4, "period_growth": 0.3}))[0]
    plain = plan_scene(make_scene(physics={"period_factor": 1.4}))[0]
    assert slow.cavity.starts[1][0] > plain.cavity.starts[1][0] * 1.02


def test_a_sucking_dome_pulls_the_cavity_off_the_surface():
    physics = {"dome_over_time": 1.5, "dome_suction": 0.1}
    course = plan_scene(make_scene(physics=physics, clip={"after_pinch_off_s": 0.02}))[0]
    cavity = course.cavity
    assert cavity.seal_type == "surface_seal"
    assert course.dome_over_s < cavity.t_p_s < plan_scene(make_scene())[0].cavity.t_p_s
    assert (cavity.y_p_m, cavity.pinch_off_cavity) == (0.0, 0)
    for k in (0, 20, 40, 100):
        before, after = (cavity.wall(cavity.closes()[k] + s)[k] for s in (-1e-7, 1e-7))
        assert after == 0.0 <= before < 2e-4
    tops = [float(cavity.depth[np.argmax(cavity.wall(cavity.t_p_s + s) > 0.0)]) for s in (0.001, 0.005, 0.01, 0.02)]
    assert np.all(np.diff(tops) > 1e-4)


@pytest.mark.parametrize(
    ("height_m", "physics", "seal"),
    [
        (1.53, {}, "deep_seal"),
        (1.53, {"dome_suction": 0.4}, "sphere_seal"),
        (2.27, {"dome_suction": 0.2}, "sphere_seal"),
        (2.27, {"loading_rate": 0.3, "drag": 1.6}, "sphere_seal"),
    ],
)
def test_the_seal_is_the_first_time_at_which_nothing_is_open_above_the_sphere(height_m, physics, seal):
    """A ring that closed on the sphere seals when the sphere has sunk out of it, not before and not later."""
    sphere = {"diameter_m": 0.051, "law": VERY_SOFT, "material": "very_soft"}
    course = plan_scene(make_scene(sphere=sphere, height_m=height_m, physics=physics))[0]
    cavity = course.cavity
    assert cavity.seal_type == seal

    def narrowest(t):
        now = see_instant(course, t)
        above = -now.depth > now.y_c_m + course.motion.radius_m / now.stretch**2
        return now.wall[above].min() if above.any() else np.inf

    before = [narrowest(t) for t in np.linspace(0.2 * cavity.t_p_s, cavity.t_p_s - 1e-4, 200)]
    assert min(before) > 0.0
    assert narrowest(cavity.t_p_s + 1e-4) == 0.0


@pytest.mark.parametrize("n", [-0.25, -0.5, -1.0])
def test_a_neck_at_a_ledge_closes_with_its_ring(n):
    """The ring above the ledge is older by many milliseconds and closes much later: between both nothing is known."""
    sphere = {"diameter_m": 0.1, "law": LEDGE_SOFT | {"n": n}, "material": "large"}
    cavity = plan_scene(make_scene(sphere=sphere, height_m=2.27))[0].cavity
    k = int(np.argmin(np.abs(cavity.depth + cavity.y_p_m)))
    assert cavity.seal_type == "deep_seal"
    assert cavity.born[k] - cavity.born[k - 1] > 5.0 * (cavity.born[k + 1] - cavity.born[k])
    assert cavity.wall(cavity.t_p_s - 1e-5)[k] > 0.0
    assert cavity.wall(cavity.t_p_s + 1e-9)[k] == 0.0
