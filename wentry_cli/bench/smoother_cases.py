"""Hard cases of the smoother: outliers, gaps, correlated and uneven noise, a second event, no noise, long records."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.falls import FPS, GRAVITY, PX_PER_M, Truth
from wentry_cli.bench.row import BenchRow
from wentry_cli.kinematics.smoother import SmoothTrack, smooth_track
from wentry_cli.kinematics.state_pass import Ballistic

Array = NDArray[np.float64]
NOISE = 0.1 / PX_PER_M
JOLT_S, JOLT = 0.07, 80.0
LONG = 100_000
FALL = Ballistic(-GRAVITY, 0.0)


@dataclass(frozen=True)
class Case:
    """What is seen of a truth: positions and their stated uncertainties, events told, and what is true."""

    truth: Truth
    y: Array
    unc: Array
    events: tuple[float, ...] = (0.0,)


def plain(truth: Truth, random: np.random.Generator) -> Case:
    """White noise of 0.1 px, told rightly: what the other cases are compared with."""
    return Case(truth, truth.y + NOISE * random.normal(size=truth.t.size), np.full(truth.t.size, NOISE))


def outliers(truth: Truth, random: np.random.Generator) -> Case:
    """One frame in twenty off by 20 px."""
    case = plain(truth, random)
    wrong = random.choice(truth.t.size, truth.t.size // 20, replace=False)
    case.y[wrong] += 20.0 / PX_PER_M * random.choice([-1.0, 1.0], wrong.size)
    return case


def small_outliers(truth: Truth, random: np.random.Generator) -> Case:
    """One frame in a hundred off by 2 px."""
    case = plain(truth, random)
    wrong = random.choice(truth.t.size, truth.t.size // 100, replace=False)
    case.y[wrong] += 2.0 / PX_PER_M * random.choice([-1.0, 1.0], wrong.size)
    return case


def missing(truth: Truth, random: np.random.Generator) -> Case:
    """A third of the frames missing at random and 8 ms in a row."""
    case = plain(truth, random)
    case.y[random.random(truth.t.size) < 1.0 / 3.0] = np.nan
    case.y[(truth.t > 0.060) & (truth.t < 0.068)] = np.nan
    return case


def correlated(share: float) -> Callable[[Truth, np.random.Generator], Case]:
    """Noise of which each frame keeps ``share`` from the frame before, told as white."""

    def make(truth: Truth, random: np.random.Generator) -> Case:
        noise = random.normal(size=truth.t.size)
        for i in range(1, noise.size):
            noise[i] = share * noise[i - 1] + np.sqrt(1.0 - share**2) * noise[i]
        return Case(truth, truth.y + NOISE * noise, np.full(noise.size, NOISE))

    return make


def uneven(truth: Truth, random: np.random.Generator) -> Case:
    """Uncertainties between 0.03 and 0.5 px that differ from frame to frame, told rightly."""
    unc = np.exp(random.uniform(np.log(0.03), np.log(0.5), truth.t.size)) / PX_PER_M
    return Case(truth, truth.y + unc * random.normal(size=unc.size), unc)


def second_event(truth: Truth, random: np.random.Generator) -> Case:
    """A step of the acceleration by 80 m/s² at 70 ms, told as a second event."""
    late = np.maximum(truth.t - JOLT_S, 0.0)
    jolted = Truth(truth.t, truth.y + 0.5 * JOLT * late**2, truth.v + JOLT * late, truth.a + JOLT * (truth.t > JOLT_S))
    case = plain(jolted, random)
    return Case(jolted, case.y, case.unc, (0.0, JOLT_S))


def tiny_noise(truth: Truth, random: np.random.Generator) -> Case:
    """Noise of 1e-6 px: variances sixteen decades below the square of the path."""
    return Case(truth, truth.y + 1e-5 * NOISE * random.normal(size=truth.t.size), np.full(truth.t.size, 1e-5 * NOISE))


def free_fall(truth: Truth, random: np.random.Generator) -> Case:
    """A fall that nothing disturbs: the process noise is 0 throughout."""
    t = truth.t
    falling = Truth(t, -4.0 * t - 0.5 * GRAVITY * t**2, -4.0 - GRAVITY * t, np.full(t.size, -GRAVITY))
    return plain(falling, random)


CASES: dict[str, Callable[[Truth, np.random.Generator], Case]] = {
    "0.1 px, white": plain,
    "5 % outliers of 20 px": outliers,
    "1 % outliers of 2 px": small_outliers,
    "a third missing, and 8 ms": missing,
    "correlated noise, 0.3 a frame": correlated(0.3),
    "correlated noise, 0.6 a frame": correlated(0.6),
    "uncertainty 0.03–0.5 px by frame": uneven,
    "second event": second_event,
    "noise 1e-6 px": tiny_noise,
    "free fall, no process noise": free_fall,
}


def hard_cases(truths: list[Truth], seed: int) -> list[BenchRow]:
    """Rows of ours, one case after the other, pooled over ``truths``, and a record of 100 000 frames."""
    rows: list[BenchRow] = []
    for name, make in CASES.items():
        found: list[tuple[Case, SmoothTrack, float]] = []
        for k, truth in enumerate(truths):
            case = make(truth, np.random.default_rng([seed, k]))  # the same noise in every case
            started = time.perf_counter()
            track = smooth_track(truth.t, case.y, case.unc, events_s=case.events, ballistic=FALL)
            found.append((case, track, time.perf_counter() - started))
        rows += _rows(name, found)
    return [*rows, *_rows("100 000 frames", [_long(seed)])]


def _long(seed: int) -> tuple[Case, SmoothTrack, float]:
    t = np.arange(LONG) / FPS - 0.0201
    after = np.maximum(t, 0.0)
    truth = Truth(
        t,
        np.where(t < 0.0, 0.3 * t, 0.1 * np.sin(3.0 * after)),
        np.where(t < 0.0, 0.3, 0.3 * np.cos(3.0 * after)),
        np.where(t < 0.0, 0.0, -0.9 * np.sin(3.0 * after)),
    )
    case = plain(truth, np.random.default_rng([seed, LONG]))
    started = time.perf_counter()
    track = smooth_track(t, case.y, case.unc, events_s=(0.0,), ballistic=Ballistic(0.0, 0.0))
    return case, track, time.perf_counter() - started


def _rows(name: str, found: list[tuple[Case, SmoothTrack, float]]) -> list[BenchRow]:
    rows = []
    for quantity, unit in (("velocity", "m/s"), ("acceleration", "m/s²")):
        off, held = [], []
        for case, track, _ in found:
            inside, frames, truth = case.truth.inside, track.frames, case.truth
            fast = quantity == "velocity"
            value, true = (frames.velocity, truth.v) if fast else (frames.acceleration, truth.a)
            unc = frames.velocity_unc if fast else frames.acceleration_unc
            off.append((value - true)[inside])
            held.append(np.abs(value - true)[inside] < 1.96 * unc[inside])
        error = np.concatenate(off)
        rows.append(
            BenchRow(
                chapter="smoothers",
                case=f"hard: {name}, inside",
                method="wentry, impact_aware",
                quantity=quantity,
                unit=unit,
                bias=float(np.mean(error)),
                rmse=float(np.sqrt(np.mean(error**2))),
                ratio_to_bound=float("nan"),
                failures=float(np.mean(~np.isfinite(error))),
                time_us=1e6 * float(np.median([seconds for _, _, seconds in found])),
                note=told(held),
                items=len(held),
                held=float(np.mean(np.concatenate(held))),
            )
        )
    return rows


def told(held: list[NDArray[np.bool_]]) -> str:
    """How often the band holds, and how well as many drops tell that (frames of one drop are off together)."""
    by_drop = [float(np.mean(drop)) for drop in held]
    error = float(np.std(by_drop, ddof=1)) / np.sqrt(len(by_drop)) if len(by_drop) > 1 else float("nan")
    return f"95 % band holds {np.mean(np.concatenate(held)):.1%}, ± {error:.1%} by {len(by_drop)} drops"
