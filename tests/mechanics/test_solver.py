"""The oscillation: reference values, an independent solver, energy, limits, random parameters."""

import math

import numpy as np
import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from wentry_cli.errors import ConfigurationError
from wentry_cli.mechanics import events
from wentry_cli.mechanics.bergstrom_boyce import (
    Material,
    excess_invariant,
    find_groups,
    flow_hardening,
    hardening_slope,
    material_problems,
    mobility,
)
from wentry_cli.mechanics.solver import find_period, solve_oscillation

ROW_2 = Material(0.025, 1070.0, 6900.0, 6900.0, 0.0866, 1.0, 1.0, -0.1902, 0.021)
ELASTIC = Material(0.025, 1070.0, 6900.0, 0.0, 0.0866, 1.0, 1.0, -0.1902, 0.021)
UNIT = 0.05 * math.sqrt(1070.0 / 6900.0)


def changed(**values):
    return Material(**{**ROW_2.__dict__, **values})


def oracle(material, stretch_0, times_s):
    """λ(t) from the equations as printed in the theory notes, in seconds and pascals, by another integrator."""
    M = material

    def right_side(_t, y):
        a, v, p = y
        e = a / p
        s = e**2 - e**-4
        stress = 2 * M.g_inf_pa * (a - a**-5) + 2 * M.g_t_pa / a * s
        inertia = 8 * np.pi / 15 * M.density_kg_m3 * M.radius_m**5
        accel = (6 * v**2 / a**7 - 4 / 3 * np.pi * M.radius_m**3 * stress / inertia) / (1 + 2 / a**6)
        c = np.sqrt(2 * p**2 + p**-4) - np.sqrt(3) + M.xi
        tau = M.g_t_pa * abs(s)
        rate = 0.5 * M.eps0_dot_1_s * c**M.n * (tau / M.tau0_pa) ** M.m * np.sign(s)
        return [v, accel, p * rate]

    solution = solve_ivp(right_side, (0, times_s[-1]), [stretch_0, 0, 1], "DOP853", times_s, rtol=1e-11, atol=1e-12)
    return solution.y


@pytest.mark.parametrize(
    ("stretch_0", "period", "valley"),
    [
        (1.05, 0.9944128783, 0.953844065594),
        (1.5, 1.044997246, 0.723440917421),
        (2.0, 1.111619356, 0.607884437334),
    ],
)
def test_elastic_reference_values(stretch_0, period, valley):
    trajectory = solve_oscillation(ELASTIC, stretch_0, np.array([3 * UNIT]), tolerance=1e-12)
    assert trajectory.period_s / UNIT == pytest.approx(period, abs=1e-9)
    assert trajectory.stretches_of(events.VALLEY)[0] == pytest.approx(valley, abs=1e-10)
    assert trajectory.stretches_of(events.PEAK)[-1] == pytest.approx(stretch_0, abs=1e-10)


def test_viscoelastic_reference_values():
    trajectory = solve_oscillation(ROW_2, 1.5, np.array([0.06]), tolerance=1e-12)
    assert trajectory.period_s == pytest.approx(0.017605080849, abs=1e-12)
    assert trajectory.stretches_of(events.PEAK)[:3] == pytest.approx([1.16123865, 1.04248209, 1.01194019], abs=6e-9)
    kinds = [events.DOWNWARD, events.VALLEY, events.UPWARD, events.PEAK]
    assert trajectory.event_kind[:12].tolist() == kinds * 3
    crossings = np.isin(trajectory.event_kind, [events.UPWARD, events.DOWNWARD])
    assert trajectory.event_stretch[crossings] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("stretch_0", [0.5, 1.2, 2.2])
@pytest.mark.parametrize(("n", "eps0_dot", "m"), [(-1.0, 0.0056, 1.0), (0.5, 0.05, 1.0), (-0.2, 1e-5, 2.0)])
def test_agrees_with_another_integrator(stretch_0, n, eps0_dot, m):
    material = changed(n=n, eps0_dot_1_s=eps0_dot, m=m)
    times = np.linspace(0.0, 0.05, 60)
    expected = oracle(material, stretch_0, times)
    found = solve_oscillation(material, stretch_0, times, tolerance=1e-11)
    assert found.stretch == pytest.approx(expected[0], abs=2e-9)
    assert found.rate_1_s == pytest.approx(expected[1], abs=1e-6)
    assert found.stretch_viscous == pytest.approx(expected[2], abs=2e-9)


@pytest.mark.parametrize("stretch_0", [0.4, 1.05, 1.5, 5.0])
def test_energy_balance(stretch_0):
    assert solve_oscillation(ROW_2, stretch_0, np.array([0.17]), tolerance=1e-11).energy_error < 1e-9


def test_energy_is_kept_over_a_thousand_elastic_oscillations():
    trajectory = solve_oscillation(ELASTIC, 1.5, np.array([1000 * 1.045 * UNIT]), tolerance=1e-12)
    assert trajectory.times_of(events.PEAK).size == 1000
    assert trajectory.energy_error < 1e-9
    assert np.diff(trajectory.times_of(events.PEAK)) / UNIT == pytest.approx(1.044997246, abs=2e-9)


@pytest.mark.parametrize(("ratio", "expected"), [(0.0, 0.99346), (1.0, 0.70248)])
def test_small_amplitude_period(ratio, expected):
    slow = changed(g_t_pa=6900.0 * ratio, eps0_dot_1_s=0.0)
    assert find_period(slow, 1.0005) / UNIT == pytest.approx(expected, abs=2e-5)


def test_a_flow_without_limit_leaves_the_lasting_network():
    """Fast flow relaxes the second network at once: the period is that of G∞ alone."""
    fast = changed(eps0_dot_1_s=2.0, n=0.0)
    assert find_period(fast, 1.01) / UNIT == pytest.approx(0.9935, abs=2e-3)


@pytest.mark.parametrize("stretch_0", [0.7, 1.4])
def test_the_period_ends_with_an_extremum_of_the_same_sense(stretch_0):
    times = np.linspace(0.0, 0.03, 30_001)
    stretch = oracle(ROW_2, stretch_0, times)[0]
    outward = stretch if stretch_0 > 1.0 else -stretch
    turns = np.flatnonzero((outward[1:-1] > outward[:-2]) & (outward[1:-1] >= outward[2:])) + 1
    assert find_period(ROW_2, stretch_0) == pytest.approx(times[turns[0]], abs=1e-6)


def test_period_of_a_sphere_that_creeps_is_not_a_number():
    creeping = changed(g_t_pa=690_000.0, tau0_pa=690_000.0, eps0_dot_1_s=2000.0, n=0.0)
    assert math.isnan(find_period(creeping, 1.2))


@pytest.mark.parametrize("x", [1e-12, 1e-8, 1e-3, -1e-6])
def test_flow_hardening_does_not_cancel(x):
    """√(3 + e) − √3 = e/(2√3) − …, with e = 3x² − 4x³ + …, checked against its series."""
    excess = 3 * x**2 - 4 * x**3 + 5 * x**4
    series = excess / (2 * math.sqrt(3)) - excess**2 / (8 * 3**1.5)
    assert flow_hardening(x, 0.0) == pytest.approx(series, rel=1e-8)
    assert excess_invariant(x) == pytest.approx(excess, rel=1e-8)


@pytest.mark.parametrize(("x", "xi"), [(1e-6, 0.0866), (-0.4, 0.0866), (0.3, 1e-9), (5.0, 0.5), (0.2, 0.0)])
def test_hardening_slope_is_the_derivative_of_the_logarithm(x, xi):
    step = 1e-5 * max(abs(x), 1e-2)
    difference = math.log(flow_hardening(x + step, xi) / flow_hardening(x - step, xi)) / (2 * step)
    assert hardening_slope(x, xi) == pytest.approx(difference, rel=1e-7, abs=1e-9)


def test_mobility_and_slope_where_the_hardening_vanishes():
    assert hardening_slope(0.0, 0.0) == 0.0
    assert mobility(0.0, (1.0, 0.7, 0.0, 1.0, 0.0)) == 0.7
    assert mobility(0.0, (1.0, 0.0, -0.2, 1.0, 0.0)) == 0.0


@pytest.mark.parametrize(
    ("tolerance", "bound"), [(1e-3, 1.7e-4), (2e-4, 4.9e-5), (1e-6, 2.9e-7), (1e-8, 1.3e-9), (1e-10, 1.4e-11)]
)
def test_error_follows_the_tolerance(tolerance, bound):
    """Root mean square over releases from 1.1 to 2.2 and n from −1 to .2; bounds 1.5 times what was measured."""
    times, squares = np.linspace(0.0, 0.15, 200), []
    for n, eps0_dot in ((-1.0, 0.0056), (-0.1902, 0.021), (0.2, 0.05)):
        material = changed(n=n, eps0_dot_1_s=eps0_dot)
        for stretch_0 in np.linspace(1.1, 2.2, 12):
            exact = solve_oscillation(material, stretch_0, times, tolerance=1e-13).stretch
            found = solve_oscillation(material, stretch_0, times, tolerance=tolerance).stretch
            squares.append(np.mean((found - exact) ** 2))
    assert math.sqrt(np.mean(squares)) < bound


def test_sensitivities_equal_differences():
    times = np.linspace(0.0, 0.05, 40)
    found = solve_oscillation(ROW_2, 1.5, times, tolerance=1e-12, sensitivities=True).sensitivities
    step = 1e-5

    def difference(low, high, width):
        upper, lower = (solve_oscillation(m, s, times, tolerance=1e-13).stretch for m, s in (high, low))
        return (upper - lower) / width

    assert found[:, 0] == pytest.approx(difference((ROW_2, 1.5 - step), (ROW_2, 1.5 + step), 2 * step), abs=1e-7)
    for column, name in enumerate(("eps0_dot_1_s", "n", "g_inf_pa", "g_t_pa"), start=1):
        value = getattr(ROW_2, name)
        width = 2 * step if name == "n" else math.log((1 + step) / (1 - step))
        ends = [value + sign * step * (1.0 if name == "n" else value) for sign in (-1, 1)]
        low, high = ((changed(**{name: end}), 1.5) for end in ends)
        assert found[:, column] == pytest.approx(difference(low, high, width), abs=1e-7), name
    crept = [solve_oscillation(ROW_2, 1.5, times, tolerance=1e-13, viscous_0=1 + e).stretch for e in (step, -step)]
    assert found[:, 5] == pytest.approx((crept[0] - crept[1]) / (2 * step), abs=1e-7)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"g_inf_pa": -1.0}, "g_inf_pa"),
        ({"tau0_pa": 0.0}, "tau0_pa"),
        ({"n": math.nan}, "n is nan"),
        ({"xi": 0.0}, "infinite at the start"),
        ({"eps0_dot_1_s": 1e7}, "stiff"),
        ({"m": 400.0}, "without bound"),
    ],
)
def test_refuses_with_a_sentence(values, word):
    with pytest.raises(ConfigurationError, match=word):
        solve_oscillation(changed(**values), 1.5, np.array([0.1]))


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from([-1.0, 0.0, 1.0, math.nan, math.inf]), min_size=9, max_size=9))
def test_quick_check_agrees_with_the_list_of_problems(values):
    material = Material(*values)
    if material_problems(material):
        with pytest.raises(ConfigurationError, match="cannot be integrated"):
            find_groups(material)
    else:
        assert find_groups(material).time_scale_s == 1.0


def test_refuses_an_impossible_stretch():
    with pytest.raises(ConfigurationError, match="initial stretch"):
        solve_oscillation(ROW_2, -1.0, np.array([0.1]))


def test_refuses_times_that_fall():
    with pytest.raises(ValueError, match="rising"):
        solve_oscillation(ROW_2, 1.5, np.array([0.1, 0.05]))


@settings(max_examples=40, deadline=None)
@given(
    stretch_0=st.floats(0.4, 5.0),
    ratio=st.floats(0.0, 10.0),
    log_flow=st.floats(-6.0, 0.5),
    n=st.floats(-1.5, 1.0),
    m=st.floats(0.5, 2.0),
    xi=st.floats(0.01, 0.5),
)
@example(stretch_0=2.0, ratio=4.0, log_flow=0.0, n=0.0, m=1.125, xi=0.5)
def test_random_parameters_oscillate_and_lose_energy(stretch_0, ratio, log_flow, n, m, xi):
    material = changed(g_t_pa=6900.0 * ratio, tau0_pa=6900.0, eps0_dot_1_s=200.0 * 10**log_flow, n=n, m=m, xi=xi)
    try:
        found = solve_oscillation(material, stretch_0, np.linspace(0.0, 0.1, 50), tolerance=1e-9)
    except ConfigurationError as error:
        event("refused")
        if "stiff" not in str(error):
            raise
        return
    assert np.all(found.stretch > 0.0)
    if abs(stretch_0 - 1.0) > 1e-4:  # below, the energy itself is rounding
        assert found.energy_error < 1e-6
    turning = np.isin(found.event_kind, [events.PEAK, events.VALLEY])
    assert np.all(np.diff(found.event_kind[turning]) != 0)
    assert np.all(np.diff(found.event_kind[~turning]) != 0)
    assert np.all(np.diff(found.event_t_s) >= 0.0)


def test_same_input_same_bytes():
    times = np.linspace(0.0, 0.1, 200)
    first, second = (solve_oscillation(ROW_2, 1.4, times).stretch.tobytes() for _ in range(2))
    assert first == second
