from __future__ import annotations

import numpy as np
import pytest

from tests.synthetic.drops import SOFT, make_scene
from wentry_cli.synthetic.course import plan_course
from wentry_cli.synthetic.entry_dynamics import solve_entry
from wentry_cli.synthetic.scene import Material, Physics
from wentry_cli.synthetic.stretch_dynamics import Oscillation, solve_oscillation

QUIET = Physics(loading_rate=0.01, loading_time=0.01, period_factor=1.0)


def swing(material: dict, physics: Physics = QUIET, end_s: float = 0.1) -> Oscillation:
    return solve_oscillation(Material(**material), 0.025, 1070.0, 5.0, physics, end_s=end_s)


def first_period(oscillation: Oscillation, end_s: float) -> float:
    t = np.linspace(0.0, end_s, 200001)
    stretch, _ = oscillation.at(t)
    peaks = np.flatnonzero((stretch[1:-1] > stretch[:-2]) & (stretch[1:-1] >= stretch[2:])) + 1
    return float(t[peaks[1]] - t[peaks[0]])


@pytest.mark.parametrize(("g_t", "factor"), [(0.0, 0.99346), (6900.0, 0.70248)])
def test_small_oscillations_have_the_period_of_the_linear_theory(g_t, factor):
    material = {**SOFT, "g_t_pa": g_t, "eps0_dot_1_s": 0.0}
    expected = factor * 0.05 * np.sqrt(1070.0 / 6900.0)
    assert first_period(swing(material, end_s=0.08), 0.08) == pytest.approx(expected, rel=1e-3)


def test_elastic_oscillation_conserves_energy_and_flow_dissipates():
    t = np.linspace(0.02, 0.2, 2001)
    for rate, grows in ((0.0, False), (0.021, True)):
        physics = Physics(loading_rate=0.3, loading_time=0.05)
        oscillation = swing({**SOFT, "g_t_pa": 0.0 if not grows else 6900.0, "eps0_dot_1_s": rate}, physics, 0.2)
        stretch, speed = oscillation.at(t)
        kinetic = 0.5 * (4.0 * np.pi * 1070.0 * 0.025**5 / 15.0) * (2.0 + 4.0 / stretch**6) * speed**2
        elastic = 4.0 / 3.0 * np.pi * 0.025**3 * 0.5 * 6900.0 * (2.0 * stretch**2 + stretch**-4 - 3.0)
        energy = kinetic + elastic
        if grows:
            assert energy[-200:].max() < 0.2 * energy[:200].max()
        else:
            assert np.ptp(energy) < 1e-6 * energy.mean()


def test_period_factor_stretches_time_and_valleys_become_shallow():
    plain = swing(SOFT, Physics(loading_rate=0.4))
    shallow = swing(SOFT, Physics(loading_rate=0.4, shallow_valleys=0.3))
    t = np.linspace(0.0, 0.09, 5001)
    (a, _), (b, rate) = plain.at(t), shallow.at(t)
    assert a.max() == pytest.approx(b.max(), abs=1e-6)
    assert 1.0 - b.min() == pytest.approx(0.7 * (1.0 - a.min()), rel=0.02)
    np.testing.assert_allclose(np.gradient(b, t)[5:-5], rate[5:-5], atol=2e-3 * np.abs(rate).max())


def test_rigid_sphere_stays_round(rigid_course):
    stretch, rate = rigid_course.motion.stretch(np.linspace(-0.01, 0.1, 50))
    assert np.all(stretch == 1.0)
    assert np.all(rate == 0.0)


def test_the_stiffer_the_closer_to_rigid(rigid_course):
    t = np.linspace(0.0, 0.03, 40)
    away = []
    for modulus in (5e3, 5e4, 5e5):
        law = {**SOFT, "g_inf_pa": modulus, "g_t_pa": modulus}
        stiff = solve_entry(make_scene(sphere={"diameter_m": 0.051, "law": law}), end_s=0.03)
        away.append(np.abs(stiff.center(t)[0] - rigid_course.motion.center(t)[0]).max())
    assert away[0] > 2.0 * away[1] > 4.0 * away[2]
    assert away[2] < 2e-3


def test_free_fall_before_impact_is_ballistic_and_continuous(soft_course):
    motion = soft_course.motion
    t = np.linspace(-0.01, -1e-4, 20)
    y, v, a = motion.center(t)
    assert np.all(a == -9.81)
    np.testing.assert_allclose(np.diff(y), 0.5 * (v[1:] + v[:-1]) * np.diff(t), atol=1e-12)
    before, after = motion.center(np.array([-1e-9, 1e-9]))[:2]
    assert before[0] == pytest.approx(before[1], abs=1e-7)
    assert after[0] == pytest.approx(after[1], abs=1e-4)
    assert motion.bottom(np.array([0.0]))[0] == pytest.approx(0.0, abs=1e-9)


def test_acceleration_is_the_derivative_of_the_velocity(soft_course):
    t = np.linspace(0.001, 0.09, 20001)
    _, v, a = soft_course.motion.center(t)
    np.testing.assert_allclose(np.gradient(v, t)[2:-2], a[2:-2], atol=0.02 * np.abs(a).max())


def test_without_drag_and_slam_only_weight_and_buoyancy_act():
    physics = {"drag": 1e-9, "added_mass": 0.0}
    motion = solve_entry(make_scene(sphere={"diameter_m": 0.051}, physics=physics), end_s=0.1)
    _, _, a = motion.center(np.array([0.05, 0.1]))
    assert a == pytest.approx(-9.81 * (1.0 - 998.2 / 1070.0), rel=1e-6)


def test_softer_spheres_lose_more_speed(soft_course, rigid_course):
    assert soft_course.motion.center(0.03)[1] > rigid_course.motion.center(0.03)[1]


def test_free_flight_is_a_parabola():
    course = plan_course(make_scene(kind="free_flight", impact_speed_m_s=1.5, sphere={"diameter_m": 0.0025}), 0.0)
    t = np.linspace(0.0, 0.05, 7)
    np.testing.assert_allclose(course.motion.center(t)[0], -1.5 * t - 4.905 * t * t, atol=1e-12)
    assert course.cavity is None


def test_sphere_on_a_plate_rests_on_it_until_it_rebounds():
    course = plan_course(make_scene(kind="surface_impact", clip={"longest_s": 0.06}), 0.5)
    t = np.linspace(0.0, 0.05, 2001)
    bottom = course.motion.bottom(t)
    leaving = int(np.argmax(bottom > 1e-5))
    assert np.abs(bottom[:leaving]).max() < 1e-5
    assert np.all(np.diff(bottom[leaving:]) > -1e-3)
    assert course.motion.center(0.05)[1] > 0.0
    assert course.motion.stretch(np.array([0.005]))[0][0] > 1.3
