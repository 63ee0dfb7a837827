"""How much slower a sphere rings in water than the model that was calibrated in air: the ratio T_exp/T_model.

The model is released at rest from the measured first peak λ_p1; measured times are t_peak + shift + ratio · t_model.
Only λ > 1 is compared: the valleys of a real sphere are shallower than the ellipsoid's, and would bias the ratio.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from wentry_cli.mechanics.bergstrom_boyce import FloatArray, Material
from wentry_cli.mechanics.least_squares import Minimum, minimise
from wentry_cli.mechanics.solver import Trajectory, find_period, solve_oscillation

STARTS = (0.85, 1.1, 1.4, 1.8)
RATIO_RANGE = (0.4, 4.0)
WINDOW = 1.3  # periods after the first peak that define the free period: both peaks and their flanks
SAMPLES_PER_PERIOD = 120  # a cubic through λ and λ̇ is then good to 1e-8
ROBUST_SCALE = 1.5  # in standard deviations
LEAST_SCALE = 1e-4
FIRST_SCALE = 0.02
FEWEST_POINTS = 6
MOST_SHIFT = 0.15  # of a period
STEPS = np.array([0.1, 0.02])

Data = tuple[FloatArray, FloatArray, FloatArray]  # times, stretches, weights


@dataclass(frozen=True)
class Measured:
    """A measured number with its standard uncertainty; both NaN where it was not measured."""

    value: float = math.nan
    unc: float = math.nan


NOT_MEASURED = Measured()


@dataclass(frozen=True)
class TimeScaling:
    """The ratio of free periods and how well it is known; times in s, ``shift_s`` after the given first peak.

    ``status``: ok; ``clip_ended`` where the measurement does not reach the second peak, so the ratio rests on the
    flank of the first alone; ``too_few`` and ``not_identified`` where there is no ratio (NaN).
    """

    ratio: float
    ratio_unc: float
    shift_s: float
    shift_unc_s: float
    period_model_s: float
    period_exp_s: float
    residual_rms: float
    points: int
    status: str


def model_curve(material: Material, stretch_0: float, duration_s: float) -> Trajectory:
    """The free oscillation from ``stretch_0``, sampled densely over ``duration_s``; raises as ``solve_oscillation``."""
    period = find_period(material, stretch_0)
    unit = period if math.isfinite(period) else duration_s
    count = int(np.clip(SAMPLES_PER_PERIOD * duration_s / unit, 50, 40_000)) + 1
    return solve_oscillation(material, stretch_0, np.linspace(0.0, duration_s, count))


def fit_time_scale(
    material: Material,
    first_peak: Measured,
    times_s: FloatArray,
    stretch: FloatArray,
    stretch_unc: FloatArray | float = 1.0,
    *,
    period: Measured = NOT_MEASURED,
) -> TimeScaling:
    """Fit ratio and shift to λ measured at ``times_s`` after the first peak (s; NaN = missing).

    ``first_peak`` is λ_p1, from which the model is released; ``stretch_unc`` weighs the points against each other.
    ``period``, the time in s between the first two measured peaks where known, limits the fit to those peaks (else a
    first fit of everything does) and is averaged with what the fit gives: where the two disagree by more than their
    uncertainties the shape is not the model's, and the peaks decide. Soft-L1 on λ > 1 from four starts or more. The
    uncertainty comes from the residuals, enlarged for their correlation in time, and from that of λ_p1.

    Raises ``ConfigurationError`` where the model cannot be integrated.
    """
    period_model = find_period(material, first_peak.value)
    times, values, weights = _usable(times_s, stretch, stretch_unc)
    if not math.isfinite(period_model) or first_peak.value <= 1.0:
        return _unfitted(period_model, times.size, "not_identified")
    if times.size < FEWEST_POINTS:
        return _unfitted(period_model, times.size, "too_few")
    end = float(times[-1]) / RATIO_RANGE[0] + period_model
    curve = _Curve(model_curve(material, first_peak.value, end), period_model)
    guess = period.value / period_model
    if not math.isfinite(guess):
        guess = math.exp(_best(curve, (times, values, weights), STARTS)[0])
    near = times <= WINDOW * guess * period_model
    if np.count_nonzero(near) < FEWEST_POINTS:
        return _unfitted(period_model, int(np.count_nonzero(near)), "too_few")
    data = (times[near], values[near], weights[near])
    fit = _best(curve, data, (guess, 0.9 * guess, 1.1 * guess))
    seen = np.isfinite(np.asarray(stretch, dtype=float))
    result = _result(curve, data, fit, float(np.max(np.asarray(times_s)[seen])))
    if result.status not in ("ok", "clip_ended"):
        return result
    if first_peak.unc > 0.0:
        higher = first_peak.value + first_peak.unc
        other = _Curve(model_curve(material, higher, end), find_period(material, higher))
        shifted = _best(other, data, (result.ratio,))
        result = replace(result, ratio_unc=math.hypot(result.ratio_unc, math.exp(shifted[0]) - result.ratio))
    return _with_peaks(result, period)


def _with_peaks(fit: TimeScaling, period: Measured) -> TimeScaling:
    """Average the fitted ratio with that of the measured peaks; a disagreement is charged to the fit."""
    peaks, peaks_unc = period.value / fit.period_model_s, period.unc / fit.period_model_s
    if not (math.isfinite(peaks) and peaks_unc > 0.0):
        return fit
    excess = (peaks - fit.ratio) ** 2 - fit.ratio_unc**2 - peaks_unc**2
    fit_variance = fit.ratio_unc**2 + max(excess, 0.0)
    share = peaks_unc**2 / (peaks_unc**2 + fit_variance)
    ratio = share * fit.ratio + (1.0 - share) * peaks
    unc = math.sqrt(share * fit_variance)
    return replace(fit, ratio=ratio, ratio_unc=unc, period_exp_s=ratio * fit.period_model_s)


def _usable(times_s: FloatArray, stretch: FloatArray, stretch_unc: FloatArray | float) -> Data:
    """Points after the first peak with λ > 1, and their weights with mean square 1."""
    times, values = np.asarray(times_s, dtype=float), np.asarray(stretch, dtype=float)
    unc = np.broadcast_to(np.asarray(stretch_unc, dtype=float), times.shape)
    with np.errstate(invalid="ignore"):
        good = np.isfinite(times) & np.isfinite(values) & (values > 1.0) & (times >= 0.0) & (unc > 0.0)
    # A peak that is known ten times better than another is not ten times more like the model.
    floor = np.maximum(unc[good], np.median(unc[good])) if good.any() else unc[good]
    weights = 1.0 / floor
    return times[good], values[good], weights / np.sqrt(np.mean(weights**2)) if weights.size else weights


class _Curve:
    """λ of the model as a function of model time, even about the release."""

    def __init__(self, trajectory: Trajectory, period_s: float) -> None:
        self.spline = CubicHermiteSpline(trajectory.t_s, trajectory.stretch, trajectory.rate_1_s)
        self.period_s = period_s

    def residual(self, x: FloatArray, data: Data) -> FloatArray:
        times, values, weights = data
        model = self.spline(np.abs((times - x[1] * self.period_s) * math.exp(-x[0])))
        return np.asarray((values - model) * weights)

    def jacobian(self, x: FloatArray, data: Data) -> FloatArray:
        times, _, weights = data
        own = (times - x[1] * self.period_s) * math.exp(-x[0])
        slope = np.sign(own) * self.spline(np.abs(own), 1) * weights
        return np.column_stack([slope * own, slope * self.period_s * math.exp(-x[0])])


def _best(curve: _Curve, data: Data, starts: tuple[float, ...]) -> FloatArray:
    """(ln ratio, shift/period) of the best of soft-L1 fits from several ratios, sharpened by their own residuals."""
    bounds = (np.array([math.log(RATIO_RANGE[0]), -MOST_SHIFT]), np.array([math.log(RATIO_RANGE[1]), MOST_SHIFT]))

    def run(start: FloatArray, scale: float) -> Minimum:
        return minimise(lambda x: _soft(curve.residual(x, data), curve.jacobian(x, data), scale), start, bounds, STEPS)

    fits = [run(np.array([math.log(start), 0.0]), FIRST_SCALE) for start in starts]
    rough = min(fits, key=lambda fit: float(fit.residual @ fit.residual)).x
    return run(rough, _robust_scale(curve.residual(rough, data))).x


def _soft(residual: FloatArray, jacobian: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """Residual and Jacobian whose sum of squares is the soft-L1 loss 2 Σ (√(1 + z²) − 1), z = residual/scale."""
    z = residual / scale
    root = np.sqrt(1.0 + z * z)
    shrink = np.sqrt(2.0 / (1.0 + root))
    return z * shrink, jacobian / (scale * root * shrink)[:, None]


def _robust_scale(residual: FloatArray) -> float:
    return ROBUST_SCALE * max(1.4826 * float(np.median(np.abs(residual))), LEAST_SCALE)


def _result(curve: _Curve, data: Data, x: FloatArray, reach_s: float) -> TimeScaling:
    residual, jacobian = curve.residual(x, data), curve.jacobian(x, data)
    freedom = max(residual.size - 2, 1)
    weight = 1.0 / np.sqrt(1.0 + (residual / _robust_scale(residual)) ** 2)
    normal = jacobian.T @ (weight[:, None] * jacobian)
    variance = float(np.sum(weight * residual**2)) / freedom * _correlation_factor(residual)
    ratio = math.exp(x[0])
    period_exp = ratio * curve.period_s
    try:
        unc = np.sqrt(np.diag(np.linalg.inv(normal)) * variance)
    except np.linalg.LinAlgError:
        return _unfitted(curve.period_s, residual.size, "not_identified")
    at_bound = not RATIO_RANGE[0] * 1.01 < ratio < RATIO_RANGE[1] / 1.01
    if at_bound or not np.all(np.isfinite(unc)) or unc[0] > 0.5:
        return _unfitted(curve.period_s, residual.size, "not_identified")
    return TimeScaling(
        ratio=ratio,
        ratio_unc=ratio * float(unc[0]),
        shift_s=float(x[1]) * curve.period_s,
        shift_unc_s=float(unc[1]) * curve.period_s,
        period_model_s=curve.period_s,
        period_exp_s=period_exp,
        residual_rms=float(np.sqrt(np.mean((residual / data[2]) ** 2))),
        points=int(residual.size),
        status="ok" if reach_s >= period_exp else "clip_ended",
    )


def _correlation_factor(residual: FloatArray) -> float:
    """By how much correlated residuals enlarge a variance: (1 + ρ)/(1 − ρ), ρ of neighbours, at least 1."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    rho = float(np.clip(residual[1:] @ residual[:-1] / power, 0.0, 0.95))
    return (1.0 + rho) / (1.0 - rho)


def _unfitted(period_model_s: float, points: int, status: str) -> TimeScaling:
    nan = math.nan
    return TimeScaling(nan, nan, nan, nan, period_model_s, nan, nan, points, status)
