"""Whole recordings: frames per second of `track` and of decoding alone, by format, with the error of the bottom.

The peer is the usual recipe on the same frames: flat field, threshold, largest contour, cv2.fitEllipse.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wentry_cli.bench.row import BenchRow
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.frames.formats import open_recording
from wentry_cli.stages import ingest, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

MATERIAL = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
FORMATS = {
    "mraw 12 bit packed": ("mraw", 12),
    "mraw 8 bit": ("mraw", 8),
    "tiff 16 bit": ("tiff", 16),
    "png 8 bit": ("png", 8),
}
LEVELS = ("accurate", "fast")


def run(quick: bool, seed: int) -> list[BenchRow]:
    """One row a format and method: time per frame of 1024 x 1024 pixels on one core, files in the page cache."""
    chosen = dict(list(FORMATS.items())[:1]) if quick else FORMATS
    rows: list[BenchRow] = []
    with tempfile.TemporaryDirectory() as name:
        for case, (kind, bits) in chosen.items():
            folder = Path(name) / f"{kind}{bits}"
            render_drop(bench_scene(kind, bits, seed, quick), folder)
            rows += _measure(case, folder)
    return rows


def bench_scene(kind: str, bits: int, seed: int, quick: bool) -> Scene:
    """A soft drop of 0.1 s filmed from the side, 1024 x 1024 pixels, R = 102 px."""
    return Scene.model_validate(
        {
            "name": "bench",
            "seed": seed,
            "sphere": {"diameter_m": 0.051, "material": "bench", "law": MATERIAL},
            "impact_speed_m_s": 5.3,
            "side": {
                "width": 1024,
                "height": 1024,
                "scale_px_per_m": 4000,
                "surface_y_px": 420.3,
                "format": kind,
                "bits": bits,
            },
            "clip": {"before_s": 0.008, "longest_s": 0.04 if quick else 0.1},
        }
    )


def _drop(folder: Path, level: str) -> Drop:
    path = folder / "experiment.yaml"
    text = path.read_text(encoding="utf-8").replace("material: bench", "material: dragonskin_6p70_small")
    path.write_text(text + ("" if "analysis:" in text else f"analysis: {{tracking: {level}}}\n"), encoding="utf-8")
    drop = read_drop("bench", folder)
    analysis = drop.experiment.analysis.model_copy(update={"tracking": level})
    experiment = drop.experiment.model_copy(update={"analysis": analysis})
    return Drop(drop.name, drop.folder, experiment, drop.material, drop.materials_path)


def _measure(case: str, folder: Path) -> list[BenchRow]:
    truth = pd.read_csv(folder / "truth" / "truth.csv")
    _drop(folder, LEVELS[0])
    seconds, frames = _timed(lambda: _decode(folder))
    rows = [_row(case, "decoding alone", seconds, frames, None, truth)]
    for level in LEVELS:
        drop = _drop(folder, level)
        results = folder / f"results_{level}"
        ingest.run(results, drop)
        track.run(results, drop)  # compiles
        seconds, _ = _timed(lambda drop=drop, results=results: track.run(results, drop))  # type: ignore[misc]
        rows.append(_row(case, f"wentry track, {level}", seconds, len(truth), read_table(results, "side"), truth))
    seconds, bottoms = _timed(lambda: _threshold_recipe(folder))
    scale = read_table(folder / f"results_{LEVELS[0]}", "geometry").iloc[0]
    measured = pd.DataFrame({"y_b_m": (scale["surface_y_px"] - bottoms) / scale["scale_px_per_m"], "status": "ok"})
    rows.append(_row(case, "threshold + cv2.fitEllipse", seconds, len(truth), measured, truth))
    return rows


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    started = time.perf_counter()
    result = work()
    return time.perf_counter() - started, result


def _decode(folder: Path) -> int:
    recording = open_recording(_source(folder))
    for index in range(recording.info.frame_count):
        recording.read(index)
    count = recording.info.frame_count
    recording.close()
    return count


def _source(folder: Path) -> Path:
    return read_drop("bench", folder).source_path("side")


def _threshold_recipe(folder: Path) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Lowest point of cv2.fitEllipse on the largest contour at half level of the whole flat-fielded frame, in px."""
    import cv2

    recording = open_recording(_source(folder))
    first = recording.read(0).astype(np.float32)
    bottoms = np.full(recording.info.frame_count, np.nan)
    for index in range(recording.info.frame_count):
        dark = (recording.read(index) < 0.5 * first.max()).astype(np.uint8)
        contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        largest = max(contours, key=cv2.contourArea, default=None)
        if largest is not None and len(largest) >= 5:
            (_, y), axes, angle = cv2.fitEllipse(largest)
            a, b, turn = axes[0] / 2, axes[1] / 2, np.deg2rad(angle)
            bottoms[index] = y + np.hypot(a * np.sin(turn), b * np.cos(turn))
    recording.close()
    return bottoms


def _row(
    case: str, method: str, seconds: float, frames: int, side: pd.DataFrame | None, truth: pd.DataFrame
) -> BenchRow:
    bias = rmse = failures = float("nan")
    if side is not None:
        wanted = (truth["measurable"] == 1).to_numpy()
        ok = wanted & (side["status"] == "ok").to_numpy(bool) & side["y_b_m"].notna().to_numpy()
        error = (side["y_b_m"] - truth["y_b_m"]).to_numpy(float)[ok] * 1e3
        bias, rmse = (float(error.mean()), float(np.sqrt(np.mean(error**2)))) if ok.any() else (bias, rmse)
        failures = 1 - float(ok.sum() / max(1, wanted.sum()))
    rate = frames / seconds
    return BenchRow(
        "throughput", case, method, "y_b", "mm", bias, rmse, float("nan"), failures, 1e6 * seconds / frames,
        f"{rate:.0f} frames/s",
    )  # fmt: skip
