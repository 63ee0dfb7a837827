"""Where the outline leaves the sphere: error of the separation line by stretch, place and flare of the cavity."""

from __future__ import annotations

import math
import time

import numpy as np

from wentry_cli.bench.row import BenchRow
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.separation import SeparationFit, find_separation
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch
from wentry_cli.synthetic.camera_noise import Sensor
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still

RADIUS, MARGIN_PX = 60.0, 40.0
STRETCHES = {"λ 0.85 to 1.2": (0.85, 1.0, 1.2), "λ 1.3 to 1.5": (1.3, 1.4, 1.5), "λ 1.8": (1.8,)}
# Heights of the contact above the centre, shares of the semi-axis (negative: below it), and flares of the wall.
HEIGHTS = (-0.2, 0.1, 0.3)
# Below the centre the wall must open faster than the sphere itself by this, else it lies behind the sphere.
LEAST_CORNER = 0.1
HIDDEN_HEIGHT = 0.6
FLARES = (0.15, 0.3, 0.5)
FRAMES = 12
# The contact line is told to lie somewhere below: the arc up to here is fitted.
HIGHEST_ARC = 0.3


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Rows by stretch for contacts that show, and one for a contact far above a flat sphere, which does not."""
    rows = []
    for name, stretches in STRETCHES.items():
        heights = (HIDDEN_HEIGHT,) if stretches == (1.8,) else HEIGHTS
        found = [
            _measure(seed, (stretch, height, flare), number)
            for stretch in stretches
            for height in heights
            for flare in FLARES
            if flare - _slope(stretch, height) > LEAST_CORNER
            for number in range(1 if quick else FRAMES)
        ]
        where = "contact far above the centre" if stretches == (1.8,) else "contact that shows"
        rows.append(_row(f"{name}, {where}", found))
    return rows


def _slope(stretch: float, height: float) -> float:
    """How fast the sphere itself widens upwards at a height (pixels across per pixel up)."""
    return -float(stretch**3) * height / math.sqrt(1.0 - height * height)


def _measure(seed: int, scene: tuple[float, float, float], number: int) -> tuple[float, float, float]:
    """Error (px, NaN where nothing was found), stated uncertainty and time (µs) of one frame."""
    stretch, height, flare = scene
    rng = np.random.default_rng(
        [seed, 31, round(1000 * stretch), round(1000 * (height + 1)), round(100 * flare), number]
    )
    across, along = RADIUS * stretch + MARGIN_PX, RADIUS / stretch**2 + MARGIN_PX
    x, y = across + rng.uniform(), along + rng.uniform()
    row = y - height * RADIUS / stretch**2
    body = StillBody(x, y, RADIUS, stretch, separation_y_px=row, cavity_flare=flare)
    light = StillLight(sensor=Sensor(12, 0.75, 0.01))
    still = draw_still(body, light, (int(2 * along + 1), int(2 * across + 1)), rng)
    patch = Patch(np.ascontiguousarray(still.flat))
    guess = EllipseShape(x + rng.uniform(-0.5, 0.5), y + rng.uniform(-0.5, 0.5), RADIUS, stretch + 0.005)
    fit = fit_silhouette(patch, guess, top_y_px=max(row, y - HIGHEST_ARC * RADIUS / stretch**2) + 3.0)
    start = time.thread_time_ns()
    found: SeparationFit = find_separation(patch, fit)
    return found.y_px - row, found.y_unc_px, 1e-3 * (time.thread_time_ns() - start)


def _row(case: str, found: list[tuple[float, float, float]]) -> BenchRow:
    error, unc, times = np.array(found).T
    seen = np.isfinite(error)
    kept, pull = error[seen], error[seen] / unc[seen]
    some = kept.size > 1
    return BenchRow(
        chapter="separation",
        case=case,
        method="wentry",
        quantity="separation_y",
        unit="px",
        bias=float(kept.mean()) if some else math.nan,
        rmse=float(np.sqrt(np.mean(kept**2))) if some else math.nan,
        ratio_to_bound=math.nan,
        failures=1.0 - float(seen.mean()),
        time_us=float(np.median(times)),
        pull=float(np.std(pull)) if some else math.nan,
        beyond_3=float(np.mean(np.abs(pull) > 3.0)) if some else math.nan,
        measured=float(seen.mean()),
        items=error.size,
    )
