"""Speed against error of outlines: ours at both levels against ordinary recipes, on rendered frames.

One process a core, a case at a time; the time is that of the processor in the thread, so that neighbours count little.
"""

from __future__ import annotations

import math
import os
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.outline_cases import CASES, QUICK, Case
from wentry_cli.bench.outline_frames import QUANTITIES, Frame, bounds_left, bounds_of, draw_frame
from wentry_cli.bench.outline_peers import SLOW, Recipe, recipes
from wentry_cli.bench.row import BenchRow
from wentry_cli.contours.circle import Circle, fit_circle
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.fitting import FitRequest, fit_shape, fit_with_bottom, parse_free
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]
# Values and stated uncertainties of QUANTITIES; NaN where there is none.
Measured = tuple[Floats, Floats]
Method = Callable[[Frame], Measured]

LEVELS = ("accurate", "fast")
TOLD = "wentry accurate, told what is hidden"
FRAMES, PEER_FRAMES, SLOW_FRAMES, QUICK_FRAMES = 1000, 200, 40, 6
# An error beyond this (px, px of the half-width) is no measurement of the sphere.
GROSS_PX = 5.0
# Called good, but off by more than so many stated uncertainties and so many pixels.
FALSE_SIGMA, FALSE_PX = 5.0, 0.1
# Median of the absolute value of a normal deviate of unit variance.
NORMAL_MEDIAN = 0.6745


def run(quick: bool, seed: int, *, peers: bool = True) -> list[BenchRow]:
    """Place, stretch and lowest row of each method on each case; ``quick`` takes four cases of 6 frames.

    Without ``peers`` ours alone.
    """
    cases = [case for case in CASES if case.name in QUICK] if quick else list(CASES)
    measure = partial(measure_case, seed=seed, quick=quick, peers=peers)
    if quick:
        return [row for case in cases for row in measure(case)]
    measure(CASES[0], quick=True, peers=False)  # compiles, once
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        return [row for rows in pool.map(measure, cases) for row in rows]


def measure_case(case: Case, *, seed: int, quick: bool, peers: bool) -> list[BenchRow]:
    """Rows of every method on one case, without ``peers`` of ours."""
    count = QUICK_FRAMES if quick else FRAMES
    frames = [draw_frame(case, seed, number) for number in range(count)]
    left = np.stack([bounds_left(case, frame) for frame in frames]) if case.droplets else None
    rows: list[BenchRow] = []
    for level in LEVELS:
        rows += rows_of(case, f"wentry {level}", frames, ours(level, case), left)
    if case.droplets:
        rows += rows_of(case, TOLD, frames, told_what_is_hidden(case), left)
    for name, recipe in recipes().items() if peers else ():
        few = frames[: SLOW_FRAMES if name in SLOW else PEER_FRAMES]
        rows += rows_of(case, name, few, theirs(recipe))
    return rows


def ours(level: str, case: Case) -> Method:
    """Our fit at a level; NaN where the status is not ok. The local bottom is measured apart, see `_local_bottom`."""

    def measure(frame: Frame) -> Measured:
        return _told(_fit(frame, level, case), frame, case)

    return measure


def told_what_is_hidden(case: Case) -> Method:
    """Our accurate fit of the pixels that droplets leave as they are: who need not find them out can do no better."""
    measure = ours(LEVELS[0], case)

    def masked(frame: Frame) -> Measured:
        assert frame.hidden is not None
        return measure(replace(frame, region=np.where(frame.hidden, np.float32(math.nan), frame.region)))

    return masked


def _fit(frame: Frame, level: str, case: Case) -> SilhouetteFit:
    patch = Patch(frame.region, ceiling=frame.ceiling)
    if case.top_view:
        circle = Circle(frame.guess.x, frame.guess.y, frame.guess.radius)
        return fit_circle(patch, circle, one_sided=bool(case.ring), level=level)
    return fit_shape(patch, frame.guess, _request(frame, level, case))


def _request(frame: Frame, level: str, case: Case) -> FitRequest:
    return FitRequest(parse_free(case.free), frame.top_y, case.motion_px, level)


def _told(fit: SilhouetteFit, frame: Frame, case: Case) -> Measured:
    """What the fit says of QUANTITIES: the stretch of a circle is its radius over the one it was told."""
    nothing = np.full(len(QUANTITIES), math.nan)
    if fit.status != "ok":
        return nothing, nothing
    stretch, unc = fit.stretch, fit.stretch_unc
    if case.top_view:
        stretch, unc = fit.radius_px / frame.guess.radius, fit.radius_unc_px / frame.guess.radius
    values = np.array([fit.center_x_px, fit.center_y_px, stretch, fit.bottom_y_px, math.nan])
    return values, np.array([fit.center_x_unc_px, fit.center_y_unc_px, unc, fit.bottom_y_unc_px, math.nan])


def _local_bottom(frame: Frame, level: str, case: Case) -> tuple[float, float]:
    """The lowest row from the cap alone at a level, and its uncertainty; NaN in the top view, which has none."""
    if case.top_view:
        return math.nan, math.nan
    patch = Patch(frame.region, ceiling=frame.ceiling)
    bottom = fit_with_bottom(patch, frame.guess, _request(frame, level, case)).bottom
    assert bottom is not None
    return bottom.y_px, bottom.y_unc_px


def theirs(recipe: Recipe) -> Method:
    """A peer's recipe as a method without uncertainties."""

    def measure(frame: Frame) -> Measured:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = recipe(frame.region, frame.guess.radius, frame.top_y)
        return np.array([*found, math.nan]), np.full(len(QUANTITIES), math.nan)

    return measure


def rows_of(case: Case, name: str, frames: list[Frame], method: Method, left: Floats | None = None) -> list[BenchRow]:
    """A row a quantity of one method on one case; the first call, which compiles, is not timed.

    ``left`` are the `bounds_left` of the frames where a part of them is hidden.
    """
    method(frames[0])
    level = name.removeprefix("wentry ")
    shape = (len(frames), len(QUANTITIES))
    values, unc, times = np.empty(shape), np.empty(shape), np.empty(len(frames))
    for index, frame in enumerate(frames):
        start = time.thread_time_ns()
        values[index], unc[index] = method(frame)
        times[index] = 1e-3 * (time.thread_time_ns() - start)
        if level in LEVELS:
            values[index, 4], unc[index, 4] = _local_bottom(frame, level, case)
    truth = np.array([[*frame.truth, frame.truth[3]] for frame in frames])
    error = values - truth
    scale = np.array([1.0, 1.0, case.radius, 1.0, 1.0])
    bounds = bounds_of(case)
    worst = np.nanmax(np.where(np.isnan(error), 0.0, np.abs(error * scale))[:, :4], axis=1)
    far = (np.abs(error) > FALSE_SIGMA * unc) & (np.abs(error * scale) > FALSE_PX)
    shares = (float(np.mean(far[:, :4].any(axis=1))), float(np.median(times)))
    rows = [
        _row(case, name, column, (error[:, column], unc[:, column], worst > GROSS_PX), (*shares, bounds[column]))
        for column in range(len(QUANTITIES))
        if np.isfinite(values[:, column]).any() or column < 4
    ]
    if left is None:
        return rows
    good = worst <= GROSS_PX
    return [_against_left(row, error[good, n], left[..., n], good, bounds[n]) for n, row in enumerate(rows)]


def _against_left(row: BenchRow, error: Floats, left: Floats, good: NDArray[np.bool_], bound: float) -> BenchRow:
    """The row with what is left of its frames: ``left`` (frames, 2) as in `bounds_left`, ``error`` of the good ones."""
    told, known = np.sqrt(np.mean(left**2, axis=0)) / bound
    pull = error / left[good, 0]
    pull = pull[np.isfinite(pull)]
    if not pull.size:
        return replace(row, limit=float(told), limit_known=float(known))
    return replace(
        row,
        limit=float(told),
        limit_known=float(known),
        ratio_to_left=float(np.sqrt(np.mean(pull**2))),
        ratio_to_left_median=float(np.median(np.abs(pull))) / NORMAL_MEDIAN,
    )


def _row(
    case: Case,
    name: str,
    column: int,
    found: tuple[Floats, Floats, NDArray[np.bool_]],
    shares: tuple[float, float, float],
) -> BenchRow:
    error, unc, gross = found
    false_ok, time_us, bound = shares
    quantity, unit = QUANTITIES[column]
    seen = np.isfinite(error)
    good = seen & ~gross
    kept = error[good]
    pull = kept / unc[good]
    states = kept.size > 1 and bool(np.isfinite(pull).all())
    rmse = float(np.sqrt(np.mean(kept**2))) if kept.size else math.nan
    return BenchRow(
        chapter="contours",
        case=case.name,
        method=name,
        quantity=quantity,
        unit=unit,
        bias=float(np.mean(kept)) if kept.size else math.nan,
        rmse=rmse,
        ratio_to_bound=rmse / bound,
        failures=1.0 - float(np.mean(good)),
        time_us=time_us,
        pull=float(np.std(pull)) if states else math.nan,
        beyond_3=float(np.mean(np.abs(pull) > 3.0)) if states else math.nan,
        measured=float(np.mean(seen)),
        false_ok=false_ok if np.isfinite(unc).any() else math.nan,
        items=len(error),
    )
