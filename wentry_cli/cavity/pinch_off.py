"""When a neck closes: the power law of its radius, averaged over the exposure, extrapolated to zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.closure_law import EXPONENT_PRIOR, ClosureLaw, Solution, solve_closure

Floats = NDArray[np.float64]

MIN_SAMPLES = 6
LAW_UNC_FRAMES = 0.04  # a neck that follows another law (exponent 1/2, drifting) shifts the closure by about that
MAX_AFTERMATH = 8  # samples after the closure that may pass for a neck
SPOILED, STRAY, KEPT_SHARE = 3.0, 4.0, 0.6  # in standard uncertainties: a fit with strays, a stray; what must be left
CONCENTRATIONS, STARTS = 12, 3  # from all samples, and from those without one of three parts


@dataclass(frozen=True)
class ClosureFit:
    """One closure: ``radius = amplitude (t_s − t)^exponent √(1 + 2 curvature (t_s − t))``.

    ``t_s`` and ``t_unc_s`` are NaN unless ``status`` is ``ok``; ``poor_fit``, ``too_few`` and ``clip_ended`` (the
    extrapolated closure lies behind the last frame, kept in ``extrapolated_t_s``) say why.
    """

    t_s: float
    t_unc_s: float
    extrapolated_t_s: float
    amplitude: float
    exponent: float
    curvature_1_s: float
    residual_rms: float
    samples: int
    status: str


def fit_closure(
    time_s: Floats,
    radius: Floats,
    radius_unc: float,
    *,
    exposure_s: float = 0.0,
    min_radius: float = 0.0,
    last_time_s: float = np.inf,
    frames: int = 30,
) -> ClosureFit:
    """Fit the time at which a radius reaches zero.

    Parameters
    ----------
    time_s, radius : (n,) arrays
        Mid-exposure times in increasing order and the radius then, in any unit of length; NaN is left out.
    radius_unc : float
        Standard uncertainty of one radius, in the same unit.
    exposure_s : float
        Exposure; the law is averaged over it.
    min_radius : float
        Samples from the first one below this on are not used (half of three pixels: blur hides the gap).
    last_time_s : float
        Time of the last frame of the clip: a closure beyond it has not been seen.
    frames : int
        How many of the last usable samples enter.

    Notes
    -----
    Least squares over closure time, ln amplitude, exponent and curvature, with priors on the last two: the ring model
    has exponent 1/2, an axisymmetric neck drifts slowly towards it (Eggers et al., PRL 98, 094502, 2007). The
    uncertainty holds the fit's own (widened by its misfit), how far leaving the last sample out shifts it beyond
    noise, and ``LAW_UNC_FRAMES``. Samples that dust, a caustic or an edge behind the neck has spoiled are left out.
    """
    time, values = _usable_samples(time_s, radius, min_radius, frames + MAX_AFTERMATH)
    open_samples = _count_before_closure(time, values, radius_unc, exposure_s)
    time, values = time[:open_samples], values[:open_samples]
    time, values = time[-frames:], values[-frames:]
    if time.size < MIN_SAMPLES:
        return _no_fit("too_few", time.size)
    time, values = _without_strays(time, values, radius_unc, exposure_s)
    result, law, scaling = _solve(time, values, radius_unc, exposure_s)
    earlier, short, (origin, span, _) = _solve(time[:-1], values[:-1], radius_unc, exposure_s)
    shift = scaling[0] + result.x[0] * scaling[1] - (origin + earlier.x[0] * span)
    shift = max(abs(shift) - _closure_unc(earlier, short) * span, 0.0)
    step = float(np.median(np.diff(time)))
    return _as_fit(result, law, scaling, last_time_s, float(np.hypot(LAW_UNC_FRAMES * step, shift)))


def _count_before_closure(time: Floats, values: Floats, radius_unc: float, exposure_s: float) -> int:
    """Return how many samples precede the closure that the samples before them foretell.

    A jet, a bubble or mist shows a width after the closure; one such sample would pull the closure behind it.
    """
    if time.size <= MIN_SAMPLES or _trailing_misfit(time, values, radius_unc, exposure_s) < 1.5:
        return int(time.size)
    tolerance = 0.1 * float(np.median(np.diff(time)))
    for count in range(max(MIN_SAMPLES, time.size - MAX_AFTERMATH), time.size):
        result, law, (origin, span, _) = _solve(time[:count], values[:count], radius_unc, exposure_s)
        latest = origin + span * (result.x[0] + 3.0 * _closure_unc(result, law))
        if time[count] - 0.5 * exposure_s > latest + tolerance:
            return count
    return int(time.size)


def _trailing_misfit(time: Floats, values: Floats, radius_unc: float, exposure_s: float) -> float:
    """Root mean square misfit of the last samples in units of their uncertainty: where an aftermath shows."""
    result, law, _ = _solve(time, values, radius_unc, exposure_s)
    misfit = (law.predict(result.x) - law.radius)[-MAX_AFTERMATH:] / law.radius_unc
    return float(np.sqrt(np.mean(misfit**2)))


def _without_strays(time: Floats, values: Floats, radius_unc: float, exposure_s: float) -> tuple[Floats, Floats]:
    """The samples without those that lie off the law of the most; all where they agree, or where too few would be left.

    Least trimmed squares by concentration (Rousseeuw and Van Driessen, Technometrics 41, 212, 1999).
    """
    result, law, _ = _solve(time, values, radius_unc, exposure_s)
    fewest = max(MIN_SAMPLES, int(np.ceil(KEPT_SHARE * time.size)))
    if _scatter(result, law) < SPOILED or fewest >= time.size:
        return time, values
    thirds = np.arange(time.size) * STARTS // time.size
    starts = [np.flatnonzero(thirds != without) for without in range(-1, STARTS)]
    tried = [_concentrated(time, values, kept, fewest, radius_unc, exposure_s) for kept in starts]
    off = min(tried, key=lambda found: float(np.sum(np.sort(found)[:fewest] ** 2)))
    good = off < STRAY * max(1.0, float(np.median(off)) / 0.6745)
    return (time[good], values[good]) if np.count_nonzero(good) >= fewest else (time, values)


def _concentrated(
    time: Floats, values: Floats, kept: NDArray[np.int64], fewest: int, radius_unc: float, exposure_s: float
) -> Floats:
    """How far all samples (n,) lie off the law of the ``fewest`` that agree best, on the way from those ``kept``."""
    off = _misfit_of_all(time, values, kept, radius_unc, exposure_s)
    for _ in range(CONCENTRATIONS):
        before, kept = kept, np.sort(np.argsort(off, kind="stable")[:fewest])
        if np.array_equal(before, kept):
            break
        off = _misfit_of_all(time, values, kept, radius_unc, exposure_s)
    return off


def _misfit_of_all(
    time: Floats, values: Floats, kept: NDArray[np.int64], radius_unc: float, exposure_s: float
) -> Floats:
    """How far all samples (n,) lie off the law of those ``kept``, in standard uncertainties."""
    result, _, (origin, span, unit) = _solve(time[kept], values[kept], radius_unc, exposure_s)
    law = ClosureLaw((time - origin) / span, values / unit, radius_unc / unit, exposure_s / span)
    return np.abs(law.predict(result.x) - law.radius) / law.radius_unc


def _solve(
    time: Floats, values: Floats, radius_unc: float, exposure_s: float
) -> tuple[Solution, ClosureLaw, tuple[float, float, float]]:
    unit = float(values.max())
    origin, span = float(time[-1]), float(time[-1] - time[0])
    scaled = (time - origin) / span
    step = float(np.median(np.diff(scaled)))
    law = ClosureLaw(scaled, values / unit, radius_unc / unit, exposure_s / span)
    start = _start_values(scaled, values / unit, step)
    return solve_closure(law, start), law, (origin, span, unit)


def _usable_samples(time_s: Floats, radius: Floats, floor: float, frames: int) -> tuple[Floats, Floats]:
    """Return the last samples before the radius first falls below ``floor``, from their greatest radius on."""
    seen = np.isfinite(time_s) & np.isfinite(radius)
    time, values = time_s[seen], radius[seen]
    below = np.flatnonzero(values < floor)
    if below.size:
        time, values = time[: below[0]], values[: below[0]]
    time, values = time[-frames:], values[-frames:]
    # Only the collapse: a neck that still grows at the start of the window does not follow the law.
    if values.size:
        start = int(np.argmax(values))
        time, values = time[start:], values[start:]
    return time, values


def _start_values(time: Floats, radius: Floats, step: float) -> Floats:
    """Straight line through radius^(1/α) on time: its zero is the first guess of the closure."""
    slope, offset = np.polyfit(time, np.maximum(radius, 1e-6) ** (1.0 / EXPONENT_PRIOR), 1)
    closure = -offset / slope if slope < 0.0 else 10.0 * step
    closure = float(np.clip(closure, 0.02 * step, 3.0))
    amplitude = radius[0] / (closure - time[0]) ** EXPONENT_PRIOR
    return np.array([closure, np.log(amplitude), EXPONENT_PRIOR, 0.0])


def _scatter(result: Solution, law: ClosureLaw) -> float:
    """Root of the reduced chi-squared, at least 1: a misfit of the law widens the uncertainty."""
    misfit = (law.predict(result.x) - law.radius) / law.radius_unc
    return max(1.0, float(np.sqrt(np.sum(misfit**2) / max(law.time.size - 2, 1))))


def _closure_unc(result: Solution, law: ClosureLaw) -> float:
    covariance = np.linalg.pinv(result.jac.T @ result.jac)
    return float(np.sqrt(covariance[0, 0])) * _scatter(result, law)


def _as_fit(
    result: Solution, law: ClosureLaw, scaling: tuple[float, float, float], last_time_s: float, law_unc_s: float
) -> ClosureFit:
    origin, span, unit = scaling
    closure, log_amplitude, exponent, curvature = (float(value) for value in result.x)
    misfit = law.predict(result.x) - law.radius
    t_s = origin + closure * span
    t_unc_s = float(np.hypot(_closure_unc(result, law) * span, law_unc_s))
    status = _judge(t_s, t_unc_s, span, _scatter(result, law), last_time_s)
    seen = status == "ok"
    return ClosureFit(
        t_s=t_s if seen else np.nan,
        t_unc_s=t_unc_s if seen else np.nan,
        extrapolated_t_s=t_s,
        amplitude=float(np.exp(log_amplitude)) * unit / span**exponent,
        exponent=exponent,
        curvature_1_s=curvature / span,
        residual_rms=float(np.sqrt(np.mean(misfit**2))) * unit,
        samples=int(law.time.size),
        status=status,
    )


def _judge(t_s: float, t_unc_s: float, span: float, scatter: float, last_time_s: float) -> str:
    if t_s > last_time_s:
        return "clip_ended"
    return "poor_fit" if scatter > 6.0 or not t_unc_s < 0.25 * span else "ok"


def _no_fit(status: str, samples: int) -> ClosureFit:
    nan = float("nan")
    return ClosureFit(nan, nan, nan, nan, nan, nan, nan, samples, status)
