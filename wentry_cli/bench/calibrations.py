"""Calibrations against what was put in: flow from three drops, ratio of periods, modulus by compression, added mass.

Spheres, heights, lengths of the clips and noise are drawn from a seed. Beside ours stand the recipes that do without
its care: Levenberg–Marquardt from one start with differences, least squares of all points, Hertz.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import curve_fit, least_squares

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.solvers import SPHERES, table_1_sphere
from wentry_cli.mechanics.added_mass import added_mass_coefficient
from wentry_cli.mechanics.bergstrom_boyce import Material, find_groups
from wentry_cli.mechanics.calibration import REFERENCE_HARDENING, fit_flow
from wentry_cli.mechanics.compression import compression_force, fit_compression
from wentry_cli.mechanics.ringing import Ringing
from wentry_cli.mechanics.solver import find_period, solve_oscillation
from wentry_cli.mechanics.time_scaling import Measured, fit_time_scale

FloatArray = NDArray[np.float64]
FLOW, RATIO, COMPRESSION, ADDED_MASS = (
    "flow from three drops", "ratio of periods, valleys 30 % too shallow", "modulus by compression", "added mass",
)  # fmt: skip
NOISE = 0.005  # of λ
PEAKS = (1.2, 1.45, 1.7)
SOLVED = 6.0  # uncertainties of the flow within which a fit counts as solved
DIAMETER_M = 0.05
STRETCHES = np.concatenate([np.linspace(0.5, 2.0, 61), 1.0 + np.geomspace(1e-8, 1e-2, 20)])
Draws = list[tuple[float, float, float, float]]  # error, uncertainty, whether the 95 % interval holds the truth, s


def run(quick: bool, seed: int) -> list[BenchRow]:
    """2000 flows, 300 ratios and 300 moduli (``quick``: 6 each), the recipes beside ours on 30 of each."""
    rng = np.random.default_rng(seed)
    many, some, few = (6, 6, 2) if quick else (2000, 300, 30)
    return [*_flows(rng, many, few), *_ratios(rng, some), *_moduli(rng, some), _added_mass()]


def _flows(rng: np.random.Generator, count: int, few: int) -> list[BenchRow]:
    """ln ε̇₀ and n, and the product ε̇₀ c_refⁿ that the data know well; a fit is a failure where that is far off."""
    found: dict[str, Draws] = {"ln ε̇₀": [], "n": [], "ln flow": []}
    naive: Draws = []
    for k in range(count):
        truth = _random_sphere(rng)
        drops = [_drop(truth, peak, rng) for peak in PEAKS]
        started = time.process_time()
        fit = fit_flow(truth, drops)
        spent = time.process_time() - started
        low, high = math.log(fit.eps0_dot_low_1_s), math.log(fit.eps0_dot_high_1_s)
        log, true = math.log(fit.material.eps0_dot_1_s), math.log(truth.eps0_dot_1_s)
        found["ln ε̇₀"].append(
            (log - true, fit.eps0_dot_unc_1_s / fit.material.eps0_dot_1_s, low <= true <= high, spent)
        )
        found["n"].append((fit.material.n - truth.n, fit.n_unc, fit.n_low <= truth.n <= fit.n_high, spent))
        off = math.log(fit.flow_1_s) - _log_flow(truth)
        found["ln flow"].append((off, fit.flow_unc_1_s / fit.flow_1_s, math.nan, spent))
        if k < few:
            naive.append(_one_start(truth, drops, fit.flow_unc_1_s / fit.flow_1_s))
    rows = [_row(FLOW, "wentry", quantity, "1", draws) for quantity, draws in found.items()]
    return [*rows, _row(FLOW, "scipy least_squares (lm), one start, differences", "ln flow", "1", naive)]


def _random_sphere(rng: np.random.Generator) -> Material:
    """One of Table 1's sizes and moduli, n between −1.2 and .5, a flow that damps within a few periods."""
    base, n = table_1_sphere(int(rng.integers(len(SPHERES)))), float(rng.uniform(-1.2, 0.5))
    unit = find_groups(replace(base, n=n, eps0_dot_1_s=1.0)).flow * REFERENCE_HARDENING**n
    return replace(base, n=n, eps0_dot_1_s=float(10.0 ** rng.uniform(-1.0, 0.5) / unit))


def _drop(truth: Material, peak: float, rng: np.random.Generator) -> Ringing:
    """λ after a peak near ``peak``, three to five periods in 25 frames or more each, at an unknown part of a frame."""
    unit = 2.0 * find_groups(truth).time_scale_s
    fps = max(2000.0, 25.0 / unit)
    times = np.arange(0.0, rng.uniform(3.0, 5.0) * unit, 1.0 / fps) + rng.uniform(0.0, 1.0 / fps)
    seen = np.maximum(times - rng.normal(0.0, 0.1 / fps), 0.0)
    clean = solve_oscillation(truth, peak + float(rng.uniform(-0.08, 0.08)), seen).stretch
    return Ringing(times, clean + NOISE * rng.standard_normal(times.size), np.full(times.size, NOISE))


def _log_flow(material: Material) -> float:
    return math.log(material.eps0_dot_1_s) + material.n * math.log(REFERENCE_HARDENING)


def _one_start(truth: Material, drops: list[Ringing], unc: float) -> tuple[float, float, float, float]:
    """(ln ε̇₀, n, λ₀ of each drop) from the middle of what is usual, derivatives by differences."""
    middle = table_1_sphere(4)

    def residual(x: FloatArray) -> FloatArray:
        material = replace(
            truth, eps0_dot_1_s=float(np.exp(np.clip(x[0], -30.0, 5.0))), n=float(np.clip(x[1], -3.0, 3.0))
        )
        starts = np.clip(x[2:], 1.0005, 6.0)
        models = [
            solve_oscillation(material, float(start), drop.times_s, tolerance=1e-6).stretch
            for start, drop in zip(starts, drops, strict=True)
        ]
        return np.concatenate([(model - drop.stretch) / NOISE for model, drop in zip(models, drops, strict=True)])

    start = np.array([math.log(middle.eps0_dot_1_s), middle.n, *(float(np.max(drop.stretch)) for drop in drops)])
    started = time.process_time()
    found = least_squares(residual, start, method="lm", max_nfev=400).x
    spent = time.process_time() - started
    off = found[0] + found[1] * math.log(REFERENCE_HARDENING) - _log_flow(truth)
    return float(off), unc, math.nan, spent


def _ratios(rng: np.random.Generator, count: int) -> list[BenchRow]:
    """T_exp/T_model where λ < 1 is nearer to 1 than the model's by 30 %."""
    ours: Draws = []
    plain: Draws = []
    for k in range(count):
        material, peak, truth = (
            table_1_sphere(k % len(SPHERES)),
            float(rng.uniform(1.2, 1.9)),
            float(rng.uniform(1.0, 1.6)),
        )
        period = find_period(material, peak)
        times = np.arange(0.0, 3.0 * truth * period, truth * period / 100.0) + rng.uniform(0.0, truth * period / 100.0)
        clean = solve_oscillation(material, peak, times / truth).stretch
        seen = np.where(clean < 1.0, 1.0 - 0.7 * (1.0 - clean), clean) + NOISE * rng.standard_normal(times.size)
        started = time.process_time()
        fit = fit_time_scale(material, Measured(peak, 0.0), times, seen, np.full(times.size, NOISE))
        ours.append((fit.ratio / truth - 1.0, fit.ratio_unc / truth, math.nan, time.process_time() - started))

        def model(t: FloatArray, ratio: float, of: Material = material, start: float = peak) -> FloatArray:
            return solve_oscillation(of, start, t / ratio).stretch

        started = time.process_time()
        (ratio,), cover = curve_fit(model, times, seen, p0=[truth])
        spent = time.process_time() - started
        plain.append((float(ratio) / truth - 1.0, float(np.sqrt(cover[0, 0])) / truth, math.nan, spent))
    name = "scipy curve_fit, all points, started at the truth"
    return [_row(RATIO, "wentry", "ratio", "1", ours), _row(RATIO, name, "ratio", "1", plain)]


def _moduli(rng: np.random.Generator, count: int) -> list[BenchRow]:
    """G∞ from loading curves with 1 % of noise and a zero that may be off by 1 mm; depths up to .3 D."""
    ours: Draws = []
    hertz: Draws = []
    depth = np.linspace(0.0, 0.3 * DIAMETER_M, 200)
    for _ in range(count):
        modulus, zero = float(10.0 ** rng.uniform(3.0, 5.0)), float(rng.uniform(-1e-3, 1e-3))
        clean = modulus * DIAMETER_M**2 * compression_force((depth - zero) / DIAMETER_M)
        seen = clean + 0.01 * clean.max() * rng.standard_normal(depth.size)
        started = time.process_time()
        fit = fit_compression(depth, seen, DIAMETER_M)
        held = fit.g_inf_low_pa <= modulus <= fit.g_inf_high_pa
        ours.append((fit.g_inf_pa / modulus - 1.0, fit.g_inf_pa_unc / modulus, held, time.process_time() - started))

        def force(d: FloatArray, g: float, at: float) -> FloatArray:
            return np.asarray(g * DIAMETER_M**2 * 4.0 / 3.0 * np.maximum((d - at) / DIAMETER_M, 0.0) ** 1.5)

        started = time.process_time()
        (g, _), cover = curve_fit(force, depth, seen, p0=[modulus, 0.0])
        spent = time.process_time() - started
        hertz.append((float(g) / modulus - 1.0, float(np.sqrt(cover[0, 0])) / modulus, math.nan, spent))
    return [_row(COMPRESSION, "wentry", "G∞", "relative", ours), _row(COMPRESSION, "Hertz", "G∞", "relative", hertz)]


def _added_mass() -> BenchRow:
    """C_m against Lamb's integral α₀ = ab² ∫ ds/((a² + s)^1.5 (b² + s)) by quadrature; relative."""

    def exact(stretch: float) -> float:
        # s = a² (1/u² − 1) makes it 2 (b/a)² ∫ u² du/(1 + ((b/a)² − 1) u²) over 0 to 1
        flat = stretch**6
        alpha = 2.0 * flat * quad(lambda u: u * u / (1.0 + (flat - 1.0) * u * u), 0.0, 1.0, epsabs=0.0, epsrel=2e-14)[0]
        return float(alpha / (2.0 - alpha))

    true = np.array([exact(float(s)) for s in STRETCHES])
    started = time.process_time()
    found = added_mass_coefficient(STRETCHES)
    spent = (time.process_time() - started) / STRETCHES.size
    draws: Draws = [(float(e), math.nan, math.nan, spent) for e in found / true - 1.0]
    return _row(ADDED_MASS, "wentry", "C_m", "relative", draws)


def _row(case: str, method: str, quantity: str, unit: str, draws: Draws) -> BenchRow:
    error, unc, held, spent = np.array(draws, dtype=float).T
    known = np.isfinite(error)
    pull = error[known] / unc[known]
    failed = ~known if case != FLOW else ~(np.abs(error) < SOLVED * unc)
    return BenchRow(
        chapter="calibrations",
        case=case,
        method=method,
        quantity=quantity,
        unit=unit,
        bias=float(np.mean(error[known])),
        rmse=float(np.sqrt(np.mean(error[known] ** 2))),
        ratio_to_bound=math.nan,
        failures=float(np.mean(failed)),
        time_us=1e6 * float(np.median(spent)),
        note=f"largest error {np.max(np.abs(error[known])):.1e}",
        pull=float(np.sqrt(np.mean(pull**2))),
        beyond_3=float(np.mean(np.abs(pull) > 3.0)) if np.isfinite(pull).all() else math.nan,
        measured=float(np.mean(known)),
        items=len(draws),
        held=float(np.mean(held)),
    )
