"""ε̇₀ and n of a sphere from its drops on a rigid surface, all heights together.

The two are almost one parameter (their correlation is about .998): what the data know is the flow ε̇₀ cⁿ at the
hardening c ≈ .12 where these spheres spend their time. The fit runs in (ln[ε̇₀ c_refⁿ], n), in the initial stretch and
time of each drop and in what it has crept while it was loaded; it starts from a scan, so that nobody has to guess.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import stdtrit

from wentry_cli.errors import ConfigurationError
from wentry_cli.mechanics.bergstrom_boyce import FloatArray, Material, find_groups
from wentry_cli.mechanics.least_squares import Minimum, minimise
from wentry_cli.mechanics.ringing import Ringing
from wentry_cli.mechanics.solver import STRETCH_RANGE, solve_oscillation

REFERENCE_HARDENING = 0.12
SCAN_N = (-1.1, -0.4, 0.3)
SCAN_FLOW = np.geomspace(10**-2.5, 10**1.5, 12)  # A* c_refⁿ
SCAN: dict[str, Any] = {"tolerance": 1e-4, "most_steps": 4000}
FIT: dict[str, Any] = {"tolerance": 1e-8, "most_steps": 4000, "sensitivities": True}
SCAN_POINTS = 60  # of each drop, about
N_RANGE = (-3.0, 3.0)
LOG_FLOW_RANGE = (-14.0, 4.5)  # of A* c_refⁿ; beyond, the sphere is elastic for all that λ(t) can show
FEWEST_POINTS = 8
OUTLIER = 6.0  # robust standard deviations
OUTLIER_ROUNDS = 4
WIDEST_N = 0.5  # half-width of the 95 % interval beyond which n is not identified
LEAST_SPREAD, LEAST_SWINGS = 0.1, 1.5  # difference of the initial stretches and ratio of λ₀ − 1; one is enough for n
MOST_CORRELATION = 0.95  # of neighbouring residuals


@dataclass(frozen=True)
class Calibration:
    """The fitted flow of one sphere. Intervals are of 95 %; ``eps0_dot_unc_1_s`` follows from that of ln ε̇₀.

    ``flow_1_s`` is ε̇₀ c_refⁿ, the well-known combination; ``correlation`` is that of ln ε̇₀ and n; ``status`` is ``ok``,
    ``not_identified`` (the heights do not tell ε̇₀ from n, or there is no flow to see) or ``too_few``; ``warning`` says
    what to do, or is empty.
    """

    material: Material
    eps0_dot_unc_1_s: float
    eps0_dot_low_1_s: float
    eps0_dot_high_1_s: float
    n_unc: float
    n_low: float
    n_high: float
    flow_1_s: float
    flow_unc_1_s: float
    correlation: float
    stretch_0: FloatArray
    stretch_0_unc: FloatArray
    shift_s: FloatArray
    stretch_viscous_0: FloatArray
    residual_rms: float
    points: int
    status: str
    warning: str


def fit_flow(
    material: Material, drops: Sequence[Ringing], *, creep: bool = True, g_inf_unc_pa: float = 0.0
) -> Calibration:
    """Fit ε̇₀ and n jointly to all ``drops`` of a sphere; its other parameters are those of ``material``.

    Each drop has its own initial stretch, time shift and, with ``creep``, λ_p at the peak: the sphere has flowed while
    it was loaded. Without it λ_p = 1, the paper's choice, and the parameters absorb the creep. Weighted least squares
    with forward sensitivities from the best of a scan of 36 points; points beyond six robust standard deviations are
    left out. Uncertainties from the residuals (Student), enlarged where neighbours are alike, from what the frames of a
    drop share, and from that of G∞, ``g_inf_unc_pa``, by a second fit; intervals linear in (ln ε̇₀, n).

    ε̇₀ and n count as told apart (``ok``) where the fit converged inside its bounds, the 95 % interval of n is narrower
    than ± ``WIDEST_N`` and the drops are from different heights: their initial stretches differ by ``LEAST_SPREAD``, or
    their initial swings λ₀ − 1 by the factor ``LEAST_SWINGS``. The interval alone does not do: a single long clip makes
    it narrow, but only as far as the model is exact, since at one height an error of the shape of λ(t) passes into n
    unseen. The correlation does not do either: it is .997 to .999 from three heights, and .998 to 1 from one.

    Raises ``ConfigurationError`` where ``material`` makes no sense.
    """
    scaled = replace(material, eps0_dot_1_s=1.0, n=0.0)
    groups = find_groups(scaled)
    if groups.flow == 0.0:
        raise ConfigurationError("g_t_pa is 0: without a relaxing network there is no flow to calibrate")
    usable = [drop.clean() for drop in drops]
    if not usable or min(drop.times_s.size for drop in usable) < FEWEST_POINTS:
        few = f"fewer than {FEWEST_POINTS} frames after the first peak in one of the drops"
        return _unfitted(material, usable, few)
    problem = _Problem(scaled, math.log(groups.flow), usable, creep)
    start = problem.scan()
    if start is None:
        return _unfitted(material, usable, "no oscillation from the measured first peaks could be computed")
    minimum = minimise(problem.evaluate, start, problem.bounds, problem.scale)
    whole = problem
    for _ in range(OUTLIER_ROUNDS):
        kept = whole.without_outliers(minimum.x)
        if kept.points == problem.points:
            break
        problem = kept
        minimum = minimise(problem.evaluate, minimum.x, problem.bounds, problem.scale)
    return _result(material, problem, minimum, _shift_by_modulus(problem, minimum, g_inf_unc_pa))


def _shift_by_modulus(problem: _Problem, minimum: Minimum, g_inf_unc_pa: float) -> FloatArray:
    """By how much (ln flow, n) move where G∞ is larger by its uncertainty; 0 where that is not known."""
    if not g_inf_unc_pa > 0.0:
        return np.zeros(2)
    stiffer = replace(problem.material, g_inf_pa=problem.material.g_inf_pa + g_inf_unc_pa)
    other = _Problem(stiffer, math.log(find_groups(stiffer).flow), problem.drops, problem.creep)
    moved = minimise(other.evaluate, minimum.x, other.bounds, other.scale).x
    # The parameter is A* c_refⁿ, whose unit of time has changed with G∞.
    return np.array([moved[0] - other.log_unit - minimum.x[0] + problem.log_unit, moved[1] - minimum.x[1]])


class _Problem:
    """Residuals and Jacobian over all drops; parameters: ln flow, n, then of each drop λ₀, shift/t_c, ln λ_p(0)."""

    def __init__(self, material: Material, log_unit: float, drops: Sequence[Ringing], creep: bool) -> None:
        self.material, self.log_unit, self.drops, self.creep = material, log_unit, list(drops), creep
        self.time_unit = find_groups(material).time_scale_s
        self.points = sum(drop.times_s.size for drop in drops)
        count = len(self.drops)
        low, high = STRETCH_RANGE
        ranges = [LOG_FLOW_RANGE, N_RANGE, *[(max(low, 1.0005), min(high, 6.0))] * count, *[(-0.3, 0.3)] * count]
        ranges += [(-0.3, 0.7)] * (count if creep else 0)
        self.bounds = (np.array([r[0] for r in ranges]), np.array([r[1] for r in ranges]))
        self.scale = np.array([0.5, 0.3] + [0.05] * (len(ranges) - 2))

    def material_at(self, log_flow: float, n: float) -> Material:
        """The material with A* c_refⁿ = exp(log_flow)."""
        log_eps = log_flow - self.log_unit - n * math.log(REFERENCE_HARDENING)
        return replace(self.material, eps0_dot_1_s=math.exp(log_eps), n=n)

    def scan(self) -> FloatArray | None:
        """The best of 36 pairs with λ₀ from the data; None where nothing could be integrated."""
        peaks = [max(float(np.mean(np.sort(drop.stretch)[-3:])), 1.001) for drop in self.drops]
        rest = [*peaks, *[0.0] * len(peaks) * (2 if self.creep else 1)]
        found = [(self._cost(math.log(flow), n, peaks), math.log(flow), n) for n in SCAN_N for flow in SCAN_FLOW]
        cost, log_flow, n = min(found)
        return np.array([log_flow, n, *rest]) if math.isfinite(cost) else None

    def _cost(self, log_flow: float, n: float, peaks: list[float]) -> float:
        material = self.material_at(log_flow, n)
        total = 0.0
        for drop, peak in zip(self.drops, peaks, strict=True):
            some = slice(None, None, max(1, drop.times_s.size // SCAN_POINTS))
            try:
                model = solve_oscillation(material, peak, drop.times_s[some], **SCAN).stretch
            except ConfigurationError:
                return math.inf
            total += float(np.mean(((drop.stretch[some] - model) / drop.stretch_unc[some]) ** 2))
        return total

    def evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Weighted residuals model − data and their Jacobian; None where the model cannot be integrated."""
        count = len(self.drops)
        material = self.material_at(float(x[0]), float(x[1]))
        residuals, rows = [], []
        for k, drop in enumerate(self.drops):
            times = np.maximum(drop.times_s - x[2 + count + k] * self.time_unit, 0.0)
            crept = math.exp(x[2 + 2 * count + k]) if self.creep else 1.0
            try:
                model = solve_oscillation(material, float(x[2 + k]), times, viscous_0=crept, **FIT)
            except ConfigurationError:
                return None
            block = np.zeros((times.size, x.size))
            to_start, to_flow, to_n = model.sensitivities[:, :3].T
            block[:, 0] = to_flow
            block[:, 1] = to_n - to_flow * math.log(REFERENCE_HARDENING)
            block[:, 2 + k] = to_start
            block[:, 2 + count + k] = -model.rate_1_s * self.time_unit
            if self.creep:
                block[:, 2 + 2 * count + k] = model.sensitivities[:, 5]
            residuals.append((model.stretch - drop.stretch) / drop.stretch_unc)
            rows.append(block / drop.stretch_unc[:, None])
        return np.concatenate(residuals), np.concatenate(rows)

    def without_outliers(self, x: FloatArray) -> _Problem:
        """This problem without the points that lie far from the fit ``x``; itself where there are none."""
        found = self.evaluate(x)
        if found is None:
            return self
        sizes = np.cumsum([drop.times_s.size for drop in self.drops])[:-1]
        far = np.abs(found[0]) > OUTLIER * 1.4826 * float(np.median(np.abs(found[0])))
        if not far.any() or far.mean() > 0.1:
            return self
        kept = [
            Ringing(drop.times_s[~out], drop.stretch[~out], drop.stretch_unc[~out], drop.common)
            for drop, out in zip(self.drops, np.split(far, sizes), strict=True)
        ]
        return _Problem(self.material, self.log_unit, kept, self.creep)


def _covariance(problem: _Problem, minimum: Minimum, shift: FloatArray) -> FloatArray:
    """Covariance of the parameters: residuals, their likeness along each drop, what a drop's frames share, G∞."""
    residual = minimum.residual
    variance = float(residual @ residual) / max(residual.size - minimum.x.size, 1)
    sizes = np.cumsum([drop.times_s.size for drop in problem.drops])[:-1]
    products = sum(float(own[1:] @ own[:-1]) for own in np.split(residual, sizes))
    alike = min(products / max(float(residual @ residual), 1e-300), MOST_CORRELATION)
    if alike > 2.0 / math.sqrt(residual.size):  # less is what independent residuals show too
        variance *= (1.0 + alike) / (1.0 - alike)
    inverse = np.linalg.pinv(minimum.jacobian.T @ minimum.jacobian, hermitian=True)
    covariance = inverse * variance
    for drop, rows in zip(problem.drops, np.split(minimum.jacobian, sizes), strict=True):
        moved = inverse @ rows.T @ (drop.common * drop.stretch / drop.stretch_unc)
        covariance += np.outer(moved, moved)
    covariance[:2, :2] += np.outer(shift, shift)
    return np.asarray(covariance)


def _result(material: Material, problem: _Problem, minimum: Minimum, shift: FloatArray) -> Calibration:
    x, count, size = minimum.x, len(problem.drops), minimum.residual.size
    freedom = max(size - x.size, 1)
    covariance = _covariance(problem, minimum, shift)
    # to (ln ε̇₀, n): ln ε̇₀ = ln flow − n ln c_ref
    turn = np.array([[1.0, -math.log(REFERENCE_HARDENING)], [0.0, 1.0]])
    pair = turn @ covariance[:2, :2] @ turn.T
    log_unc, n_unc = np.sqrt(np.diag(pair))
    quantile = float(stdtrit(freedom, 0.975))
    fitted = problem.material_at(float(x[0]), float(x[1]))
    found = replace(material, eps0_dot_1_s=fitted.eps0_dot_1_s, n=fitted.n)
    flow = math.exp(x[0] - problem.log_unit)
    weights = np.concatenate([1.0 / drop.stretch_unc for drop in problem.drops])
    inside = np.all((x > problem.bounds[0] + 1e-6) & (x < problem.bounds[1] - 1e-6))
    stretch_0 = x[2 : 2 + count]
    spread = float(np.ptp(stretch_0))
    apart = spread >= LEAST_SPREAD or float(np.ptp(np.log(np.maximum(stretch_0 - 1.0, 1e-6)))) >= math.log(LEAST_SWINGS)
    narrow = bool(inside and minimum.converged and quantile * n_unc < WIDEST_N)
    return Calibration(
        material=found,
        eps0_dot_unc_1_s=found.eps0_dot_1_s * float(log_unc),
        eps0_dot_low_1_s=found.eps0_dot_1_s * math.exp(-min(quantile * log_unc, 300.0)),
        eps0_dot_high_1_s=found.eps0_dot_1_s * math.exp(min(quantile * log_unc, 300.0)),
        n_unc=float(n_unc),
        n_low=found.n - quantile * float(n_unc),
        n_high=found.n + quantile * float(n_unc),
        flow_1_s=flow,
        flow_unc_1_s=flow * math.sqrt(covariance[0, 0]),
        correlation=float(pair[0, 1] / (log_unc * n_unc)) if log_unc > 0.0 and n_unc > 0.0 else math.nan,
        stretch_0=stretch_0,
        stretch_0_unc=np.sqrt(np.diag(covariance)[2 : 2 + count]),
        shift_s=x[2 + count : 2 + 2 * count] * problem.time_unit,
        stretch_viscous_0=np.exp(x[2 + 2 * count :]) if problem.creep else np.ones(count),
        residual_rms=float(np.sqrt(np.mean((minimum.residual / weights) ** 2))),
        points=size,
        status="ok" if narrow and apart else "not_identified",
        warning=_warning(count, spread, narrow, apart),
    )


def _warning(count: int, spread: float, narrow: bool, apart: bool) -> str:
    if apart:
        return "" if narrow else "the stretch does not tell eps0_dot from n: longer or less noisy clips are needed"
    heights = "one drop" if count == 1 else f"{count} drops whose first peaks differ by {spread:.3f}"
    return f"{heights}: only the product eps0_dot c^n is known, not eps0_dot and n apart; add drops from other heights"


def _unfitted(material: Material, drops: Sequence[Ringing], warning: str) -> Calibration:
    nan, none = math.nan, np.full(len(drops), math.nan)
    return Calibration(
        material=replace(material, eps0_dot_1_s=nan, n=nan),
        eps0_dot_unc_1_s=nan,
        eps0_dot_low_1_s=nan,
        eps0_dot_high_1_s=nan,
        n_unc=nan,
        n_low=nan,
        n_high=nan,
        flow_1_s=nan,
        flow_unc_1_s=nan,
        correlation=nan,
        stretch_0=none,
        stretch_0_unc=none,
        shift_s=none,
        stretch_viscous_0=none,
        residual_rms=nan,
        points=sum(drop.times_s.size for drop in drops),
        status="too_few",
        warning=warning,
    )
