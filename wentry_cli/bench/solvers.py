"""Speed against error of the oscillation: ours against SciPy's integrators with the same compiled right-hand side."""

from __future__ import annotations

import importlib.util
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import odeint, solve_ivp

from wentry_cli.bench.row import BenchRow
from wentry_cli.mechanics.bergstrom_boyce import Material, derivatives, find_groups
from wentry_cli.mechanics.solver import find_period, solve_oscillation

FloatArray = NDArray[np.float64]
PERIODS = 9.0
REPEATS = 9  # of which the quickest counts: the machine does other things too
SAMPLES = 200
# radius m, G∞ = G_T Pa, n, ε̇₀ 1/s of the six spheres of Table 1
SPHERES = (
    (0.025, 74690.0, -0.2481, 0.0049),
    (0.025, 6900.0, -0.1902, 0.021),
    (0.025, 1235.0, -1.0, 0.0056),
    (0.0487, 74690.0, -0.2402, 0.0024),
    (0.0487, 6900.0, -0.488, 0.0041),
    (0.0487, 1235.0, -0.50, 0.0066),
)
SCIPY = (("RK45", (1e-5, 1e-9)), ("DOP853", (1e-5, 1e-9)), ("LSODA", (1e-6, 1e-10)), ("Radau", (1e-5, 1e-8)))
OURS = (2e-4, 1e-6, 1e-8, 1e-10)
ODEINT = (1e-6, 1e-8, 1e-9)
CVODE = (1e-6, 1e-9)


@dataclass(frozen=True)
class _Case:
    material: Material
    stretch_0: float
    times_s: FloatArray
    truth: FloatArray


def run(quick: bool, seed: int) -> list[BenchRow]:
    """λ(t) over nine periods of Table 1's spheres, λ₀ between 1.05 and 2.2: error and time of each method.

    The reference is SciPy's DOP853 at 3e-14. CVODE is among the methods where scikit-sundae is installed. ``quick``
    runs two trajectories instead of twelve.
    """
    rng = np.random.default_rng(seed)
    cases = [_make_case(rng, k) for k in range(2 if quick else 12)]
    rows = [_row(cases, "wentry, all events", tolerance, _ours) for tolerance in OURS]
    rows += [_row(cases, "wentry, sensitivities too", tolerance, _with_sensitivities) for tolerance in OURS[1:3]]
    for name, tolerances in SCIPY:
        rows += [_row(cases, f"solve_ivp {name}", tolerance, _scipy(name)) for tolerance in tolerances]
    rows += [_row(cases, "odeint", tolerance, _odeint) for tolerance in ODEINT]
    if importlib.util.find_spec("sksundae") is not None:
        rows += [_row(cases, "CVODE (scikit-sundae)", tolerance, _cvode) for tolerance in CVODE]
    return rows


def table_1_sphere(row: int) -> Material:
    """One of ``SPHERES``, with G_T = G∞ as in the paper."""
    radius, modulus, n, eps0_dot = SPHERES[row]
    return Material(radius, 1070.0, modulus, modulus, 0.0866, 1.0, 1.0, n, eps0_dot)


def _make_case(rng: np.random.Generator, k: int) -> _Case:
    material = table_1_sphere(k % len(SPHERES))
    stretch_0 = float(rng.uniform(1.05, 2.2))
    times = np.linspace(0.0, PERIODS * find_period(material, stretch_0), SAMPLES)
    empty = _Case(material, stretch_0, times, np.empty(0))
    return _Case(material, stretch_0, times, _scipy("DOP853")(empty, 3e-14))


def _ours(case: _Case, tolerance: float) -> FloatArray:
    return solve_oscillation(case.material, case.stretch_0, case.times_s, tolerance=tolerance).stretch


def _with_sensitivities(case: _Case, tolerance: float) -> FloatArray:
    found = solve_oscillation(case.material, case.stretch_0, case.times_s, tolerance=tolerance, sensitivities=True)
    return found.stretch


def _right_side(case: _Case) -> Callable[[float, FloatArray], FloatArray]:
    groups = np.array(find_groups(case.material).values)

    def right_side(_time: float, state: FloatArray) -> FloatArray:
        out = np.zeros(4)
        derivatives(state, groups, out)
        return out

    return right_side


def _scipy(method: str) -> Callable[[_Case, float], FloatArray]:
    def solve(case: _Case, tolerance: float) -> FloatArray:
        times = case.times_s / find_groups(case.material).time_scale_s
        start = np.array([case.stretch_0, 0.0, 0.0, 0.0])
        span = (0.0, float(times[-1]))
        found = solve_ivp(_right_side(case), span, start, method, times, rtol=tolerance, atol=0.1 * tolerance)
        return np.asarray(found.y[0])

    return solve


def _odeint(case: _Case, tolerance: float) -> FloatArray:
    times = case.times_s / find_groups(case.material).time_scale_s
    start = np.array([case.stretch_0, 0.0, 0.0, 0.0])
    found = odeint(_right_side(case), start, times, tfirst=True, rtol=tolerance, atol=tolerance, mxstep=5000)
    return np.asarray(found[:, 0])


def _cvode(case: _Case, tolerance: float) -> FloatArray:
    from sksundae import cvode

    groups = find_groups(case.material)
    values = np.array(groups.values)

    def right_side(_time: float, state: FloatArray, out: FloatArray) -> None:
        derivatives(state.copy(), values, out)

    solver = cvode.CVODE(right_side, method="Adams", rtol=tolerance, atol=tolerance, max_num_steps=20_000)
    found = solver.solve(case.times_s / groups.time_scale_s, np.array([case.stretch_0, 0.0, 0.0, 0.0]))
    return np.asarray(found.y[:, 0])


def _row(cases: list[_Case], method: str, tolerance: float, solve: Callable[[_Case, float], FloatArray]) -> BenchRow:
    errors, durations = [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy raises a tolerance below its least and says so
        solve(cases[0], tolerance)
        for case in cases:
            repeats = []
            for _ in range(REPEATS):
                started = time.perf_counter()
                found = solve(case, tolerance)
                repeats.append(time.perf_counter() - started)
            durations.append(min(repeats))
            errors.append(found - case.truth)
    error = np.concatenate(errors)
    return BenchRow(
        chapter="solvers",
        case="Table 1, nine periods",
        method=f"{method}, {tolerance:.0e}",
        quantity="stretch",
        unit="1",
        bias=float(np.mean(error)),
        rmse=float(np.sqrt(np.mean(error**2))),
        ratio_to_bound=float("nan"),
        failures=float(np.mean([not np.all(np.isfinite(e)) for e in errors])),
        time_us=float(np.median(durations)) * 1e6,
        note=f"largest error {np.max(np.abs(error)):.1e}",
    )
