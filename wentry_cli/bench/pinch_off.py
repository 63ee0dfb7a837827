"""When the neck closes: error of t_p in frames at 0.2 px, free exponent against what others would do."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.row import BenchRow
from wentry_cli.cavity.pinch_off import fit_closure

Floats = NDArray[np.float64]
Law = Callable[[Floats], Floats]
NOISE_PX, SMALLEST_PX, FRAMES, EXPOSURE = 0.2, 1.5, 45, 0.5
CLIPS = 200


def power(exponent: float, bend: float, amplitude: float) -> Law:
    """A power of the time that is left (frames), bent; px."""
    return lambda left: amplitude * left**exponent * (1.0 + bend * left)


def ring(pressure: float) -> Law:
    """A ring that collapses under constant pressure: the square of its radius is a parabola in time."""
    return lambda left: 7.0 * np.sqrt(np.maximum(left - pressure * left**2, 0.0))


def drifting(left: Floats) -> Floats:
    """The exponent of an axisymmetric neck, 1/2 + 1/(4 √−ln τ) (Eggers et al. 2007)."""
    share = np.clip(left / 60.0, 1e-12, 0.9)
    return np.asarray(70.0 * share ** (0.5 + 0.25 / np.sqrt(-np.log(share))) * (left > 0.0))


LAWS: dict[str, Law] = {
    "exponent 0.5": power(0.5, -0.005, 6.0),
    "exponent 0.55": power(0.55, 0.01, 6.0),
    "exponent 0.6": power(0.6, 0.0, 5.0),
    "ring under pressure": ring(0.012),
    "drifting exponent": drifting,
}


def run(quick: bool, seed: int) -> list[BenchRow]:
    """A row a law and method: t_p in frames from the radii of 45 frames, averaged over an exposure of half a frame."""
    rows = []
    for number, (name, law) in enumerate(LAWS.items()):
        rng = np.random.default_rng([seed, 32, number])
        clips = [_clip(law, rng) for _ in range(8 if quick else CLIPS)]
        for method, measure in METHODS.items():
            rows.append(_row(name, method, clips, measure))
    return rows


def _clip(law: Law, rng: np.random.Generator) -> tuple[Floats, Floats, float]:
    """Frame times, noisy radii (px) and the true closure time, in frames."""
    closure = 33.0 + rng.random()
    time_frames = np.arange(FRAMES, dtype=np.float64)
    within = np.linspace(-0.5, 0.5, 81) * EXPOSURE
    left = np.maximum(closure - time_frames[:, None] - within[None, :], 0.0)
    radius = law(left).mean(axis=1) + rng.normal(0.0, NOISE_PX, FRAMES)
    radius[time_frames - 0.5 * EXPOSURE > closure] = 0.0
    return time_frames, radius, closure


def free_exponent(frames: Floats, radius: Floats) -> tuple[float, float]:
    """Ours: amplitude, exponent, curvature and closure time free, priors on exponent and curvature."""
    fit = fit_closure(
        frames, radius, NOISE_PX, exposure_s=EXPOSURE, min_radius=SMALLEST_PX, last_time_s=float(frames[-1])
    )
    return fit.t_s, fit.t_unc_s


def square_line(frames: Floats, radius: Floats) -> tuple[float, float]:
    """A straight line through the squares of the last twelve radii, its zero (exponent fixed to ½)."""
    use = np.flatnonzero(radius > SMALLEST_PX)[-12:]
    slope, offset = np.polyfit(frames[use], radius[use] ** 2, 1)
    return float(-offset / slope), math.nan


def last_open_frame(frames: Floats, radius: Floats) -> tuple[float, float]:
    """The last frame with a radius, and a half."""
    return float(frames[np.flatnonzero(radius > 3.0 * NOISE_PX)[-1]] + 0.5), math.nan


METHODS = {
    "wentry": free_exponent,
    "line through radius²": square_line,
    "last open frame + ½": last_open_frame,
}


def _row(
    case: str,
    method: str,
    clips: list[tuple[Floats, Floats, float]],
    measure: Callable[[Floats, Floats], tuple[float, float]],
) -> BenchRow:
    start = time.thread_time_ns()
    found = np.array([measure(frames, radius) for frames, radius, _ in clips])
    spent = 1e-3 * (time.thread_time_ns() - start) / len(clips)
    error = found[:, 0] - np.array([closure for *_, closure in clips])
    seen = np.isfinite(error)
    kept, pull = error[seen], error[seen] / found[seen, 1]
    states = bool(np.isfinite(pull).all())
    return BenchRow(
        chapter="pinch_off",
        case=case,
        method=method,
        quantity="t_p",
        unit="frames",
        bias=float(kept.mean()),
        rmse=float(np.sqrt(np.mean(kept**2))),
        ratio_to_bound=math.nan,
        failures=1.0 - float(seen.mean()),
        time_us=spent,
        pull=float(np.std(pull)) if states else math.nan,
        beyond_3=float(np.mean(np.abs(pull) > 3.0)) if states else math.nan,
        measured=float(seen.mean()),
        items=len(clips),
    )
