"""Whole recordings: frames per second of decoding alone, of `track` and of `wentry process`, with the bottom's error.

The peer is the usual recipe on the same frames: flat field, half level, largest contour, cv2.fitEllipse.
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
from wentry_cli.frames.decoded import decoded_once
from wentry_cli.frames.formats import open_recording
from wentry_cli.stages import cavity, ingest, kinematics, stretch, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

MATERIAL = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
FORMATS = {
    "mraw 12 bit packed, R 60 px": ("mraw", 12, 60.0),
    "mraw 12 bit packed, R 102 px": ("mraw", 12, 102.0),
    "mraw 8 bit, R 60 px": ("mraw", 8, 60.0),
    "tiff 16 bit, R 60 px": ("tiff", 16, 60.0),
    "png 8 bit, R 60 px": ("png", 8, 60.0),
}
LEVELS = ("accurate", "fast")
PROCESS = (ingest, track, cavity, stretch, kinematics)
REPEATS = 3
GROSS_MM = 5.0  # a fifth of the radius: such a bottom is not that of the sphere


def run(quick: bool, seed: int) -> list[BenchRow]:
    """One row a format and method: time per frame of 1024 x 1024 pixels on one core, files in the page cache."""
    chosen = dict(list(FORMATS.items())[:1]) if quick else FORMATS
    rows: list[BenchRow] = []
    with tempfile.TemporaryDirectory() as name:
        for case, (kind, bits, radius_px) in chosen.items():
            folder = Path(name) / f"{kind}{bits}_{radius_px:.0f}"
            render_drop(bench_scene(kind, bits, seed, quick, radius_px), folder)
            rows += _measure(case, folder)
    return rows


def bench_scene(kind: str, bits: int, seed: int, quick: bool, radius_px: float = 60.0) -> Scene:
    """A soft drop filmed from the side for .25 s, or as long as it stays within the 1024 x 1024 pixels."""
    scale = radius_px / 0.0255
    return Scene.model_validate(
        {
            "name": "bench",
            "seed": seed,
            "sphere": {"diameter_m": 0.051, "material": "bench", "law": MATERIAL},
            "impact_speed_m_s": 5.3,
            "side": {
                "width": 1024,
                "height": 1024,
                "scale_px_per_m": scale,
                "surface_y_px": 180.3 + 2.4 * radius_px,
                "format": kind,
                "bits": bits,
            },
            "clip": {
                "before_s": 0.008,
                "after_pinch_off_s": 1.0,
                "longest_s": 0.04 if quick else min(0.25, 15.0 / radius_px),
            },
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
    drops = {level: _drop(folder, level) for level in LEVELS}
    rows = [_row(case, "decoding alone", _timed(lambda: _decode(folder)), None, truth)]
    for level, drop in drops.items():
        results = folder / f"results_{level}"
        _process(results, drop)  # compiles, and writes what track reads
        seconds = _timed(lambda drop=drop, results=results: track.run(results, drop))  # type: ignore[misc]
        rows.append(_row(case, f"wentry track, {level}", seconds, read_table(results, "side"), truth))
    results = folder / f"results_{LEVELS[0]}"
    runs = [_process(results, drops[LEVELS[0]]) for _ in range(REPEATS)]
    split = {name: float(np.median([run[name] for run in runs])) for name in runs[0]}
    note = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in split.items())
    rows.append(_row(case, "wentry process", sum(split.values()), read_table(results, "side"), truth, note))
    geometry = read_table(results, "geometry").iloc[0]
    bottoms = _threshold_recipe(folder)
    metres = (geometry["surface_y_px"] - bottoms) / geometry["scale_px_per_m"]
    measured = pd.DataFrame({"y_b_m": metres, "status": "ok"})
    seconds = _timed(lambda: _threshold_recipe(folder))
    rows.append(_row(case, "threshold + cv2.fitEllipse", seconds, measured, truth))
    return rows


def _timed(work: Callable[[], Any]) -> float:
    """Median processor time of ``work`` in seconds: what others do on the machine does not count."""
    taken = []
    for _ in range(REPEATS):
        started = time.process_time()
        work()
        taken.append(time.process_time() - started)
    return float(np.median(taken))


def _process(results: Path, drop: Drop) -> dict[str, float]:
    """Run the stages of `wentry process`; processor time of each in seconds."""
    taken = {}
    with decoded_once(results):
        for stage in PROCESS:
            started = time.process_time()
            stage.run(results, drop)
            taken[stage.__name__.rpartition(".")[2]] = time.process_time() - started
    return taken


def _decode(folder: Path) -> None:
    recording = open_recording(_source(folder))
    for index in range(recording.info.frame_count):
        recording.read(index)
    recording.close()


def _source(folder: Path) -> Path:
    return read_drop("bench", folder).source_path("side")


def _threshold_recipe(folder: Path) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Lowest point of cv2.fitEllipse on the largest contour at half level of the whole flat-fielded frame, in px.

    The flat field is the brightest that each pixel gets in every 25th frame.
    """
    import cv2

    recording = open_recording(_source(folder))
    half = recording.read(0)
    for index in range(25, recording.info.frame_count, 25):
        half = np.maximum(half, recording.read(index))
    half >>= 1
    bottoms = np.full(recording.info.frame_count, np.nan)
    for index in range(recording.info.frame_count):
        dark = (recording.read(index) < half).astype(np.uint8)
        contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        largest = max(contours, key=cv2.contourArea, default=None)
        if largest is not None and len(largest) >= 5:
            (_, y), axes, angle = cv2.fitEllipse(largest)
            a, b, turn = axes[0] / 2, axes[1] / 2, np.deg2rad(angle)
            bottoms[index] = y + np.hypot(a * np.sin(turn), b * np.cos(turn))
    recording.close()
    return bottoms


def _row(
    case: str, method: str, seconds: float, side: pd.DataFrame | None, truth: pd.DataFrame, note: str = ""
) -> BenchRow:
    bias, rmse, failures = float("nan"), float("nan"), 0.0
    if side is not None:
        wanted = (truth["measurable"] == 1).to_numpy()
        error = (side["y_b_m"] - truth["y_b_m"]).to_numpy(float) * 1e3
        good = wanted & (side["status"] == "ok").to_numpy(bool) & (np.abs(error) < GROSS_MM)
        failures = 1.0 - float(good.sum() / max(1, wanted.sum()))
        if good.any():
            bias, rmse = float(error[good].mean()), float(np.sqrt(np.mean(error[good] ** 2)))
    told = f"{len(truth) / seconds:.0f} frames/s" + (f": {note}" if note else "")
    time_us = 1e6 * seconds / len(truth)
    nan = float("nan")
    return BenchRow("throughput", case, method, "y_b", "mm", bias, rmse, nan, failures, time_us, told)
