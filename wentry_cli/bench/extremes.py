"""The oscillation where it is hard: error, energy balance, steps and time, and what the program says."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench import extended_precision
from wentry_cli.bench.row import BenchRow
from wentry_cli.errors import ConfigurationError
from wentry_cli.mechanics.bergstrom_boyce import Groups, Material, find_groups
from wentry_cli.mechanics.plausibility import doubt_of_flow
from wentry_cli.mechanics.solver import Trajectory, solve_oscillation
from wentry_cli.mechanics.stepping import SMALL_PERIOD

FloatArray = NDArray[np.float64]

# Time unit 1 s: radius 1 m, density and G∞ 1, so that eps0_dot = 2 A* where G_T = τ₀. The base is near Table 1's row 2.
BASE = Material(1.0, 1.0, 1.0, 1.0, 0.0866, 1.0, 1.0, -0.19, 1.4)
TABLE = replace(BASE, radius_m=0.025, density_kg_m3=1070.0, g_inf_pa=6900.0, g_t_pa=6900.0, eps0_dot_1_s=0.021)
SAMPLES = 7


@dataclass(frozen=True)
class HardCase:
    """A name, a material, the stretch and its viscous part at the release, and for how many small periods to go on."""

    name: str
    material: Material
    stretch_0: float = 1.5
    viscous_0: float = 1.0
    periods: float = 9.0
    tolerance: float = 1e-10


CASES = (
    HardCase("released at .4", BASE, 0.4),
    HardCase("released at 5", BASE, 5.0),
    HardCase("released at 1 + 1e-6", BASE, 1.0 + 1e-6),
    HardCase("λ_p from 1 + 1e-9", BASE, 1.0 + 1e-6, 1.0 + 1e-9),
    HardCase("λ_p from 1.4, λ from 1", BASE, 1.0, 1.4),
    HardCase("n = −1.5", replace(BASE, n=-1.5)),
    HardCase("n = 1", replace(BASE, n=1.0)),
    HardCase("ξ = 1e-6, n = −.5", replace(BASE, xi=1e-6, n=-0.5)),
    HardCase("ξ = 1e-9, n = 1", replace(BASE, xi=1e-9, n=1.0)),
    HardCase("ξ = 0, n = 0", replace(BASE, xi=0.0, n=0.0)),
    HardCase("ξ = 0, n = −.2", replace(BASE, xi=0.0)),
    HardCase("m = .5", replace(BASE, m=0.5)),
    HardCase("m = .8", replace(BASE, m=0.8)),
    HardCase("m = 2", replace(BASE, m=2.0)),
    HardCase("A* = 1e-4", replace(BASE, eps0_dot_1_s=2e-4)),
    HardCase("A* = 10", replace(BASE, eps0_dot_1_s=20.0)),
    HardCase("A* = 100", replace(BASE, eps0_dot_1_s=200.0), periods=3.0),
    HardCase("A* = 1000", replace(BASE, eps0_dot_1_s=2e3), periods=1.0),
    HardCase("A* = 1e4", replace(BASE, eps0_dot_1_s=2e4), periods=0.2),
    HardCase("A* = 1e4, n = −1.5", replace(BASE, eps0_dot_1_s=2e4, n=-1.5)),
    HardCase("G_T = 0", replace(BASE, g_t_pa=0.0)),
    HardCase("G_T = 1e-9 G∞", replace(BASE, g_t_pa=1e-9)),
    HardCase("G_T = 100 G∞", replace(BASE, g_t_pa=100.0, tau0_pa=100.0)),
    HardCase("G_T = 1e6 G∞", replace(BASE, g_t_pa=1e6, tau0_pa=1e6), 1.1, periods=0.02),
    HardCase("Table 1, τ₀ meant as 1 kPa", replace(TABLE, tau0_pa=1e3)),
    HardCase("Table 1, τ₀ given in kPa, .001", replace(TABLE, tau0_pa=1e-3), periods=1.0),
    HardCase("Table 1, τ₀ meant as 1 Pa, m = 10", replace(TABLE, m=10.0)),
    HardCase("Table 1, m = 400", replace(TABLE, m=400.0)),
    HardCase("1000 periods, elastic", replace(BASE, g_t_pa=0.0), periods=1045.0, tolerance=1e-12),
    HardCase("1000 periods, A* = 1e-4", replace(BASE, eps0_dot_1_s=2e-4), periods=1045.0, tolerance=1e-12),
)
QUICK = ("released at .4", "ξ = 0, n = −.2", "m = .5", "Table 1, m = 400")


def run(quick: bool, seed: int) -> list[BenchRow]:
    """One row a case, against an integration in extended precision; ``seed`` is not used."""
    del seed
    return [_row(case) for case in CASES if not quick or case.name in QUICK]


def _row(case: HardCase) -> BenchRow:
    nan = float("nan")
    error, duration, says = np.array([nan]), nan, ""
    try:
        groups = find_groups(case.material)
        times = np.linspace(0.0, case.periods * SMALL_PERIOD, SAMPLES)
        found, duration = _timed(case, times * groups.time_scale_s)
        error = found.stretch - _reference(case, groups, times)
        says = f"energy {found.energy_error:.0e}, {found.steps} + {found.rejected_steps} steps, "
        says += f"largest error {np.max(np.abs(error)):.0e}" if np.isfinite(error).all() else "no reference in reach"
        doubt = doubt_of_flow(case.material)
        says += f"; warning: {doubt}" if doubt else ""
    except ConfigurationError as refusal:
        says = f"refused: {refusal}"
    return BenchRow(
        chapter="extremes",
        case=case.name,
        method=f"wentry, {case.tolerance:.0e}",
        quantity="stretch",
        unit="1",
        bias=float(np.mean(error)),
        rmse=float(np.sqrt(np.mean(error**2))),
        ratio_to_bound=nan,
        failures=float(says.startswith("refused")),
        time_us=duration,
        note=says,
    )


def _timed(case: HardCase, times_s: FloatArray) -> tuple[Trajectory, float]:
    """The trajectory, and its least time of five in µs."""
    least = float("inf")
    for _ in range(5):
        started = time.perf_counter()
        found = solve_oscillation(
            case.material, case.stretch_0, times_s, tolerance=case.tolerance, viscous_0=case.viscous_0
        )
        least = min(least, time.perf_counter() - started)
    return found, 1e6 * least


def _reference(case: HardCase, groups: Groups, times: FloatArray) -> FloatArray:
    return extended_precision.solve(groups, case.stretch_0, case.viscous_0, times)
