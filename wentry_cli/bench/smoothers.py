"""Speed against error of velocity and acceleration: ours, an oracle, SciPy, csaps, PyNumDiff, and ours in hard cases.

Errors are pooled over a soft, a rigid and a very soft sphere (``falls``), several drops each: 2000 fps, 340 frames,
4 px/mm.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.falls import FPS, GRAVITY, PX_PER_M, SPHERES, Truth, make_truth, slam_of
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_bounds import FALLS_KNOWN, find_bound
from wentry_cli.bench.smoother_cases import hard_cases, told
from wentry_cli.bench.smoother_peers import ORACLE, ORACLE_AT_IMPACT, PEERS, Method, find_oracle, installed_peers
from wentry_cli.kinematics.smoother import Mode, TrackState, smooth_track
from wentry_cli.kinematics.state_pass import Ballistic

Array = NDArray[np.float64]
NOISE_PX = (0.02, 0.1, 0.5)
OURS = "wentry, impact_aware"
MODES: tuple[Mode, ...] = ("impact_aware", "gcv", "epps")
QUANTITIES = (("velocity", "m/s"), ("acceleration", "m/s²"))
SLOW_PEER_DROPS = 1
FIRST_S = 0.001
PLACES = ("inside", "at impact", "first ms", "1 to 4 ms")


@dataclass
class _Found:
    """Errors of v and a of one method, one array a drop for each place, whether the band held, and seconds."""

    errors: dict[tuple[str, str], list[Array]] = field(default_factory=dict)
    held: dict[tuple[str, str], list[NDArray[np.bool_]]] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)


def run(quick: bool, seed: int, *, peers: bool = True) -> list[BenchRow]:
    """Velocity and acceleration away from impact and at it, every method at every noise, then the hard cases.

    ``quick``: three soft drops at 0.1 px, no oracle and none of the optional packages; none of these without ``peers``.
    """
    spheres, draws = (SPHERES[:1], 3) if quick else (SPHERES, 4)
    drops = [(sphere, seed + k) for sphere in spheres for k in range(draws)]
    truths = [make_truth(*drop) for drop in drops]
    rows: list[BenchRow] = []
    for pixels in (0.1,) if quick else NOISE_PX:
        others = installed_peers() if peers and not quick else {}
        found = _measure(truths, pixels / PX_PER_M, seed, peers=others, oracle=not quick)
        rows += _rows(f"{pixels:g} px", found)
    slams = _slams(drops)
    rows = [replace(row, note=slams) if row.method == FALLS_KNOWN else row for row in rows]
    rows.sort(key=lambda row: row.case.endswith(PLACES[2:]))  # the figure shows the first cases
    return rows + hard_cases(truths, seed)


def _slams(drops: list[tuple[str, int]]) -> str:
    peak, width = np.transpose([slam_of(*drop) for drop in drops])
    return (
        f"its greatest value is {np.min(peak):.0f} to {np.max(peak):.0f} m/s², "
        f"more than half of it lasts {1e3 * np.min(width):.1f} to {1e3 * np.max(width):.1f} ms "
        f"(median {np.median(width) * FPS:.1f} frames)"
    )


def _measure(
    truths: list[Truth], noise: float, seed: int, *, peers: Mapping[str, Method], oracle: bool
) -> dict[str, _Found]:
    found: dict[str, _Found] = {}
    for number, truth in enumerate(truths):
        random = np.random.default_rng([seed, number, int(noise * 1e9)])
        y = truth.y + noise * random.normal(size=truth.t.size)
        for mode in MODES:
            _ours(truth, y, noise, mode, found.setdefault(f"wentry, {mode}", _Found()))
        methods = dict(PEERS)
        if oracle:
            methods[ORACLE] = find_oracle(truth, noise, random, truth.inside)
            methods[ORACLE_AT_IMPACT] = find_oracle(truth, noise, random, truth.at_impact)
            methods[FALLS_KNOWN] = find_bound(seed)
        if number % 4 < SLOW_PEER_DROPS:
            methods |= peers
        for name, method in methods.items():
            _theirs(truth, y, noise, method, found.setdefault(name, _Found()))
    return found


def _ours(truth: Truth, y: Array, noise: float, mode: Mode, into: _Found) -> None:
    def smoothed() -> TrackState:
        events = (0.0,) if mode == "impact_aware" else ()
        return smooth_track(truth.t, y, noise, events_s=events, mode=mode, ballistic=Ballistic(-GRAVITY, 0.0)).frames

    if not into.seconds:
        smoothed()  # compiled once
    started = time.perf_counter()
    frames = smoothed()
    into.seconds.append(time.perf_counter() - started)
    _note(truth, (frames.velocity, frames.acceleration), into)
    for where, part in _places(truth):
        for (quantity, _), value, true, unc in (
            (QUANTITIES[0], frames.velocity, truth.v, frames.velocity_unc),
            (QUANTITIES[1], frames.acceleration, truth.a, frames.acceleration_unc),
        ):
            into.held.setdefault((where, quantity), []).append(np.abs(value - true)[part] < 1.96 * unc[part])


def _theirs(truth: Truth, y: Array, noise: float, method: Method, into: _Found) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # FITPACK complains of a tolerance that it cannot meet
        started = time.perf_counter()
        result = method(truth.t, y, noise)
        into.seconds.append(time.perf_counter() - started)
    _note(truth, result, into)


def _note(truth: Truth, result: tuple[Array, Array], into: _Found) -> None:
    for where, part in _places(truth):
        for (quantity, _), value, true in zip(QUANTITIES, result, (truth.v, truth.a), strict=True):
            into.errors.setdefault((where, quantity), []).append((value - true)[part])


def _places(truth: Truth) -> Iterable[tuple[str, NDArray[np.bool_]]]:
    first = truth.t <= FIRST_S
    return zip(
        PLACES,
        (truth.inside, truth.at_impact, truth.at_impact & first, truth.at_impact & ~first),
        strict=True,
    )


def _rows(case: str, found: dict[str, _Found]) -> list[BenchRow]:
    rows = []
    for where in PLACES:
        for quantity, unit in QUANTITIES:
            key = (where, quantity)
            floor = _rms(found[ORACLE].errors[key]) if ORACLE in found and where == "inside" else float("nan")
            for method, result in found.items():
                error = np.concatenate(result.errors[key])
                if not np.isfinite(error).any():  # of what it does not estimate
                    continue
                notes = [told(result.held[key])] if result.held else []
                if np.isfinite(floor) and method != ORACLE:
                    notes.append(f"{_rms(result.errors[key]) / floor:.2f} × oracle")
                rows.append(
                    BenchRow(
                        chapter="smoothers",
                        case=f"{case}, {where}",
                        method=method,
                        quantity=quantity,
                        unit=unit,
                        bias=float(np.mean(error)),
                        rmse=_rms(result.errors[key]),
                        ratio_to_bound=float("nan"),
                        failures=float(np.mean(~np.isfinite(error))),
                        time_us=1e6 * float(np.median(result.seconds)),
                        note="; ".join(notes),
                        items=len(result.errors[key]),
                        held=float(np.mean(np.concatenate(result.held[key]))) if result.held else float("nan"),
                    )
                )
    return rows


def _rms(errors: list[Array]) -> float:
    """Root of the mean over drops of the mean square."""
    return float(np.sqrt(np.mean([np.mean(np.square(e)) for e in errors])))
