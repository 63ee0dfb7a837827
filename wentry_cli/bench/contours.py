"""Speed against error of the silhouette fit: ours at both levels against ordinary recipes, on rendered frames."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.contour_peers import Recipe, recipes
from wentry_cli.bench.row import BenchRow
from wentry_cli.contours.bounds import Bound, cramer_rao_bound, visible_top
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch
from wentry_cli.synthetic.camera_noise import Sensor
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still

MARGIN_PX = 18
DARK = 0.08
PIXEL_VARIANCE = 1.0 / 12.0
# An error beyond this counts as a failure and not into the RMSE.
GROSS_STRETCH, GROSS_BOTTOM_PX = 0.05, 5.0


@dataclass(frozen=True)
class Case:
    """A scene: what is rendered, and what is told to the recipes."""

    name: str
    radius: float = 60.0
    stretch: float = 1.2
    visible: float = 0.5
    noise: float = 0.01
    bits: int = 12
    motion_px: tuple[float, float] = (0.0, 0.0)
    light: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Frame:
    """A rendered region with its truth (pixels of the region) and a prediction that is off by about a pixel."""

    region: NDArray[np.float32]
    shape: EllipseShape
    guess: EllipseShape
    top_y: float
    bottom_y: float


CASES = (
    Case("clean, 1 % noise"),
    Case("2 % noise, 8 bit", noise=0.02, bits=8),
    Case("10 % noise", noise=0.1),
    Case("R 125 px", radius=125.0),
    Case("stretch 1.0", stretch=1.0),
    Case("stretch 1.8", stretch=1.8, radius=90.0),
    Case("a fifth of the arc", visible=0.2),
    Case("motion blur 3.6 px", motion_px=(0.0, 3.6)),
    Case("droplets on 20 % of the arc", light={"droplets": 0.2}),
    Case("bright spots inside", light={"bright_spots": 6}),
)
QUICK_CASES = (CASES[0], CASES[2], CASES[8])


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Stretch and lowest row of each method on each case: bias, RMSE, ratio to the bound, failures and time.

    ``quick`` takes three cases of 12 frames instead of ten of 60.
    """
    rows: list[BenchRow] = []
    for number, case in enumerate(QUICK_CASES if quick else CASES):
        frames = [draw_frame(case, seed + 1000 * number + i) for i in range(12 if quick else 60)]
        bound = bound_of(case)
        for level in ("accurate", "fast"):
            rows += rows_of(case, f"wentry {level}", frames, bound, ours(level, case))
        for name, recipe in recipes().items():
            rows += rows_of(case, name, frames, bound, theirs(recipe))
    return rows


def draw_frame(case: Case, seed: int) -> Frame:
    """Render one frame of a case at a random sub-pixel place."""
    rng = np.random.default_rng(seed)
    across, along = case.radius * case.stretch + MARGIN_PX, case.radius / case.stretch**2 + MARGIN_PX
    x, y = across + rng.uniform(), along + rng.uniform()
    body = StillBody(x, y, case.radius, case.stretch, motion_px=case.motion_px)
    light = StillLight(
        dark=DARK,
        sensor=Sensor(case.bits, 0.75, case.noise),
        droplets=case.light.get("droplets", 0.0),
        bright_spots=int(case.light.get("bright_spots", 0)),
    )
    still = draw_still(body, light, (int(2 * along + 1), int(2 * across + 1)), rng)
    shape = EllipseShape(x, y, case.radius, case.stretch)
    off = rng.uniform(-1.0, 1.0, 3)
    guess = EllipseShape(x + off[0], y + off[1], case.radius, case.stretch + 0.01 * off[2])
    return Frame(np.ascontiguousarray(still.flat), shape, guess, visible_top(shape, case.visible), still.bottom_y_px)


def bound_of(case: Case) -> Bound:
    """The Cramér–Rao bound of a case (as if nothing were hidden), shot noise included."""
    shot = Sensor().shot_share
    motion = math.hypot(*case.motion_px) ** 2 / 24.0
    return cramer_rao_bound(
        EllipseShape(0.0, 0.0, case.radius, case.stretch),
        noise=case.noise,
        noise_dark=case.noise * math.sqrt(1.0 - shot + shot * DARK),
        blur_px=math.sqrt(1.0 + PIXEL_VARIANCE + motion),
        contrast=1.0 - DARK,
        visible=case.visible,
    )


Method = Callable[[Frame], tuple[float, float]]


def ours(level: str, case: Case) -> Method:
    """Our fit at a level as a method: stretch and lowest row, NaN where the status is not ok."""

    def measure(frame: Frame) -> tuple[float, float]:
        fit = fit_silhouette(
            Patch(frame.region), frame.guess, top_y_px=frame.top_y, motion_px=case.motion_px, level=level
        )
        return (fit.stretch, fit.bottom_y_px) if fit.status == "ok" else (math.nan, math.nan)

    return measure


def theirs(recipe: Recipe) -> Method:
    """A peer's recipe as a method."""
    return lambda frame: recipe(frame.region, frame.shape.radius, frame.top_y)


def rows_of(case: Case, name: str, frames: list[Frame], bound: Bound, method: Method) -> list[BenchRow]:
    """The two rows (stretch, lowest row) of one method on one case; the first call, which compiles, is not timed."""
    method(frames[0])
    errors, times = np.empty((len(frames), 2)), np.empty(len(frames))
    for index, frame in enumerate(frames):
        start = time.perf_counter()
        stretch, bottom = method(frame)
        times[index] = time.perf_counter() - start
        errors[index] = stretch - frame.shape.stretch, bottom - frame.bottom_y
    good = (np.abs(errors[:, 0]) < GROSS_STRETCH) & (np.abs(errors[:, 1]) < GROSS_BOTTOM_PX)
    failures = 1.0 - float(np.mean(good))
    rows = []
    for column, (quantity, unit, least) in enumerate(
        (("stretch", "1", bound.stretch), ("bottom_y", "px", bound.bottom_y_px))
    ):
        kept = errors[good, column]
        bias = float(np.mean(kept)) if kept.size else math.nan
        rmse = float(np.sqrt(np.mean(kept**2))) if kept.size else math.nan
        rows.append(
            BenchRow(
                chapter="contours",
                case=case.name,
                method=name,
                quantity=quantity,
                unit=unit,
                bias=bias,
                rmse=rmse,
                ratio_to_bound=rmse / least,
                failures=failures,
                time_us=float(np.median(times)) * 1e6,
            )
        )
    return rows
