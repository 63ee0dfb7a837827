"""A real recording: a ball in free fall before a clipped back light, against the parabola that it must follow.

There is no truth but Newton's: the centres of a falling ball lie on a parabola, so what they scatter about it is
measured, and must be what the fit says of itself.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from wentry_cli.bench.row import BenchRow
from wentry_cli.contours.departure import Departure, measure_departure, outline_offsets, pool_departures
from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.frames.formats import open_recording
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

FULL_SCALE = 4095
BOX = 90.0
START = (172.0, 112.0, 62.5)
SPEED_PX = 2.65
CHANGING = "what changes from frame to frame"
MOST_OFF_PX = 1.5
METHODS = (
    "accurate, its own waves known, clipped light masked",
    "accurate, clipped light masked",
    "accurate, clipped light kept",
    "fast, clipped light kept",
)


def run(recording: Path | None) -> list[BenchRow]:
    """Rows of the ball by method: scatter of the centre about a parabola, and its radius by edge definition.

    One row that says so where the recording is not there.
    """
    if recording is None or not recording.is_file():
        nan = math.nan
        return [BenchRow("ball", "falling ball", "–", "y", "px", nan, nan, nan, nan, nan, note="recording absent")]
    source = open_recording(recording)
    frames = [np.asarray(source.read(index)) for index in range(source.info.frame_count)]
    motion = SPEED_PX * float((source.info.exposure_s or 0.0) * (source.info.fps or 0.0))
    source.close()
    rows: list[BenchRow] = []
    radii: dict[str, float] = {}
    for method in METHODS:
        start = time.thread_time_ns()
        fits = _follow(frames, method, motion, ())
        if "waves known" in method:
            fits = _follow(frames, method, motion, _own_waves(frames, fits))
        spent = 1e-3 * (time.thread_time_ns() - start) / len(frames)
        rows += [_scatter(method, quantity, fits, spent) for quantity in ("y", "x")]
        if "waves known" in method:
            share = _changing_share(frames, fits)
            rows += [_scatter(f"{method}; {CHANGING}", quantity, fits, spent, share) for quantity in ("y", "x")]
        radii[method] = float(np.mean([fit.radius_px for fit in fits if fit.status == "ok"]))
    radii["outer contour at half level"], radii["area below half level"] = _simple_radii(frames)
    return rows + _scale_rows(radii)


def _own_waves(frames: list[NDArray[Any]], fits: list[SilhouetteFit]) -> Departure:
    """How the ball departs from an ellipse in all frames alike, as the tracker measures it before impact."""
    patches = [
        _patch(frame, (fit.center_x_px, fit.center_y_px), False) for frame, fit in zip(frames, fits, strict=True)
    ]
    found = [measure_departure(patch, fit) for patch, fit in zip(patches, fits, strict=True)]
    return pool_departures(found, fits[0].radius_px).waves


def _changing_share(frames: list[NDArray[Any]], fits: list[SilhouetteFit]) -> float:
    """Share of what the edge scatters about the ellipse along rays that changes from frame to frame.

    The rest, shape and texture of the ball, is the same along a ray in all frames. No centre is looked at.
    """
    off = []
    for frame, fit in zip(frames, fits, strict=True):
        patch = _patch(frame, (fit.center_x_px, fit.center_y_px), False)
        off.append(outline_offsets(patch, fit)[0])
    values = np.array(off)
    values[np.abs(values) > MOST_OFF_PX] = np.nan
    changing = values - np.nanmean(values, axis=0)
    return float(np.nanstd(changing) / np.nanstd(values) * math.sqrt(len(fits) / (len(fits) - 1)))


def _patch(frame: NDArray[Any], place: tuple[float, float], masked: bool) -> Patch:
    """The region about a place; clipped pixels masked, or kept as at least that bright."""
    values = (frame / FULL_SCALE).astype(np.float32)
    if masked:
        values[frame >= FULL_SCALE] = math.nan
    x0, y0 = int(place[0] - BOX), max(0, int(place[1] - BOX))
    cut = np.ascontiguousarray(values[y0 : int(place[1] + BOX), x0 : int(place[0] + BOX)])
    return Patch(cut, x0, y0, 0.0, math.inf if masked else 1.0 - 0.5 / FULL_SCALE)


def _follow(frames: list[NDArray[Any]], method: str, motion: float, departure: Departure) -> list[SilhouetteFit]:
    """Fit place, size and stretch in every frame, each from where the last ball was."""
    x, y, radius = START
    fits = []
    for frame in frames:
        patch = _patch(frame, (x, y), method.endswith("masked"))
        level = method.split(",", maxsplit=1)[0]
        guess = EllipseShape(x, y, radius)
        fit = fit_silhouette(
            patch, guess, free="x y R stretch", motion_px=(0.0, motion), level=level, departure=departure
        )
        fits.append(fit)
        if fit.status == "ok":
            x, y = fit.center_x_px, fit.center_y_px
        y += SPEED_PX
    return fits


def _scatter(method: str, quantity: str, fits: list[SilhouetteFit], spent: float, share: float = 1.0) -> BenchRow:
    """Residual of one coordinate about a parabola, weighted; pull is the root of the reduced chi square.

    ``share`` is how much of the stated uncertainty counts.
    """
    good = np.array([fit.status == "ok" for fit in fits])
    number = np.arange(len(fits), dtype=np.float64)[good]
    values = np.array([getattr(fit, f"center_{quantity}_px") for fit in fits])[good]
    unc = share * np.array([getattr(fit, f"center_{quantity}_unc_px") for fit in fits])[good]
    curve = np.polynomial.Polynomial.fit(number, values, 2, w=1.0 / unc)
    rest = values - curve(number)
    freedom = len(number) - 3
    squares = float(np.sum((rest / unc) ** 2))
    low, high = chi2.ppf([0.025, 0.975], freedom)
    inside = "inside" if low <= squares <= high else "outside"
    return BenchRow(
        chapter="ball",
        case="falling ball",
        method=method,
        quantity=quantity,
        unit="px",
        bias=math.nan,
        rmse=float(np.sqrt(np.sum(rest**2) / freedom)),
        ratio_to_bound=math.nan,
        failures=1.0 - float(good.mean()),
        time_us=spent,
        note=f"stated {np.mean(unc):.4f} px; χ² {squares:.1f}, {inside} of {low:.1f} to {high:.1f}",
        pull=math.sqrt(squares / freedom),
        measured=float(good.mean()),
        items=len(fits),
    )


def _simple_radii(frames: list[NDArray[Any]]) -> tuple[float, float]:
    """Mean radius by the outer contour at half level (half a pixel added) and by the filled area below it."""
    outer, area = [], []
    for frame in frames:
        dark = (frame < FULL_SCALE // 2).astype(np.uint8)
        contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        ball = min(contours, key=lambda c: abs(cv2.boundingRect(c)[2] - 2.0 * START[2]))
        (_, _), (first, second), _ = cv2.fitEllipse(ball)
        outer.append(0.25 * (first + second) + 0.5)
        filled = cv2.drawContours(np.zeros_like(dark), [ball], -1, 1, cv2.FILLED)
        area.append(math.sqrt(float(np.count_nonzero(filled)) / math.pi))
    return float(np.mean(outer)), float(np.mean(area))


def _scale_rows(radii: dict[str, float]) -> list[BenchRow]:
    """The radius by each definition of the edge, as a difference to ours in per cent."""
    nan, ours = math.nan, radii[METHODS[0]]
    return [
        BenchRow(
            "ball", "falling ball", name, "radius", "px", radius - ours, nan, nan, nan, nan,
            note=f"{radius:.2f} px, {100.0 * (radius / ours - 1.0):+.2f} %",
        )
        for name, radius in radii.items()
    ]  # fmt: skip
