"""Whole recordings: frames per second of decoding alone, of `track` and of `wentry process`, with the bottom's error.

The peer is the usual recipe on the same frames: flat field, half level, largest contour, cv2.fitEllipse. The time is
also measured against the number of frames, and that of a campaign against the number of processes. All methods take
turns, and the least of their times counts: what others do on the machine comes and goes, and only adds.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.speed_clips import SpeedCase, write_copy
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.frames.decoded import decoded_once
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.packed import unpack_12bit
from wentry_cli.stages import cavity, ingest, kinematics, stretch, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

Floats = NDArray[np.float64]
MATERIAL = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
CASES = (
    SpeedCase("raw 8 bit, R 60 px", 8, 60.0),
    SpeedCase("raw 12 bit packed, R 60 px", 12, 60.0),
    SpeedCase("raw 16 bit, R 60 px", 16, 60.0),
    SpeedCase("raw 8 bit, R 125 px", 8, 125.0),
    SpeedCase("raw 12 bit packed, R 125 px", 12, 125.0),
    SpeedCase("tiff 16 bit, R 60 px", 16, 60.0, "tiff"),
    SpeedCase("png 8 bit, R 60 px", 8, 60.0, "png"),
    SpeedCase("avi 8 bit, R 60 px", 8, 60.0, "avi"),
)
QUICK = (CASES[0], CASES[1], CASES[-1])
DECODING, TRACKING, PROCESSING = "decoding alone", "wentry track, ", "wentry process"
RECIPE = "threshold + cv2.fitEllipse"
PARTS = (0.25, 0.5)  # of the frames of the first case
FIRST_FRAMES = ": first "  # between the name of the case and the number of frames
PROCESSES = (1, 2)
CAMPAIGN = " raw drops"
LEVELS = ("accurate", "fast")
PROCESS = (ingest, track, cavity, stretch, kinematics)
YARDSTICK, UNPACKING = "a whole frame in memory", "unpacking 12 bits"
STAGES = tuple(stage.__name__.rpartition(".")[2] for stage in PROCESS)
REPEATS = 5
FRAME_PX = 1024
GROSS_MM = 5.0  # a fifth of the radius: such a bottom is not that of the sphere


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Rows by format and method, of the first frames alone, of all raw drops on one and two processes, of the machine.

    Frames have 1024 x 1024 pixels and lie in the page cache; one core, but for the last.
    """
    rows: list[BenchRow] = []
    with tempfile.TemporaryDirectory() as name:
        campaign = Path(name) / "campaign"
        for case in QUICK if quick else CASES:
            folder = campaign / case.raw
            if not folder.is_dir():
                render_drop(bench_scene("mraw", case.bits, seed, quick, case.radius_px), folder)
            if case.copy:
                folder, raw = Path(name) / case.copy, folder
                write_copy(raw, folder, case.copy)
            rows += _measure(case.name, folder)
            if case.copy:
                shutil.rmtree(folder)  # gigabytes
            if case is CASES[0]:
                rows += _first_frames(case.name, folder)
        rows += _campaign(campaign, Path(name) / "results")
    return [*rows, _unpacking()]


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
                "width": FRAME_PX,
                "height": FRAME_PX,
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
    return replace(drop, experiment=experiment)


def _measure(case: str, folder: Path) -> list[BenchRow]:
    truth = pd.read_csv(folder / "truth" / "truth.csv")
    drops = {f"{TRACKING}{level}": _drop(folder, level) for level in LEVELS}
    drop, results = drops[f"{TRACKING}{LEVELS[0]}"], folder / "results"
    _process(results, drop)  # compiles, and writes what track reads
    taken: dict[str, list[float]] = defaultdict(list)
    found: dict[str, pd.DataFrame] = {}
    bottoms: list[Floats] = []
    for _ in range(REPEATS):
        taken[DECODING].append(_seconds(lambda: _decode(folder)))
        for method, item in drops.items():
            taken[method].append(_process(results, item, (track,))["track"])
            found[method] = read_table(results, "side")
        for stage, seconds in _process(results, drop).items():
            taken[stage].append(seconds)
        taken[RECIPE].append(_seconds(lambda: bottoms.append(_threshold_recipe(folder))))
    found[RECIPE] = _in_metres(bottoms[-1], read_table(results, "geometry").iloc[0])
    best = {name: min(seconds) for name, seconds in taken.items()}
    stages = {name: best.pop(name) for name in [stage for stage in taken if stage in STAGES]}
    best[PROCESSING], found[PROCESSING] = sum(stages.values()), found[f"{TRACKING}{LEVELS[0]}"]
    notes = {PROCESSING: ", ".join(f"{name} {seconds:.2f} s" for name, seconds in stages.items())}
    order = (DECODING, *drops, PROCESSING, RECIPE)
    return [_row(case, name, best[name], found.get(name), truth, notes.get(name, "")) for name in order]


def _unpacking() -> BenchRow:
    """What the machine needs to unpack a frame of 1024 x 1024 pixels: by this its speed compares with another's."""
    packed = np.random.default_rng(0).integers(0, 256, FRAME_PX**2 * 3 // 2, np.uint8)
    levels = np.empty((FRAME_PX, FRAME_PX), np.uint16)
    taken = [_seconds(lambda: unpack_12bit(packed, 0, FRAME_PX, levels)) for _ in range(50 * REPEATS)]
    nan = float("nan")
    return BenchRow("throughput", YARDSTICK, UNPACKING, "", "", nan, nan, nan, 0.0, 1e6 * min(taken), items=1)


def _first_frames(case: str, folder: Path) -> list[BenchRow]:
    """`track` and `wentry process` on the first part of the frames."""
    truth = pd.read_csv(folder / "truth" / "truth.csv")
    rows = []
    for part in PARTS:
        count = int(part * len(truth))
        drop, results = _cut(_drop(folder, LEVELS[0]), count), folder / f"results_{count}"
        _process(results, drop)  # writes what track reads
        tracked, processed = _best_process(results, drop, (track,)), _best_process(results, drop)
        side, known = read_table(results, "side"), truth.head(count)
        for method, seconds in ((f"{TRACKING}{LEVELS[0]}", tracked), (PROCESSING, processed)):
            rows.append(_row(f"{case}{FIRST_FRAMES}{count} frames", method, seconds, side, known))
    return rows


def _cut(drop: Drop, count: int) -> Drop:
    """The drop with the first ``count`` frames of its side view alone."""
    side = drop.view("side").model_copy(update={"frames": (0, count - 1)})
    views = drop.experiment.views.model_copy(update={"side": side})
    return replace(drop, experiment=drop.experiment.model_copy(update={"views": views}))


def _campaign(campaign: Path, results: Path) -> list[BenchRow]:
    """Least wall time of the command `wentry process`, its start included, on as many processes as told."""
    drops = sorted(path.parent for path in campaign.glob("*/experiment.yaml"))
    truth = pd.concat([pd.read_csv(drop / "truth" / "truth.csv") for drop in drops])
    rows = []
    for jobs in PROCESSES:
        taken = []
        for repeat in range(REPEATS):
            words = ["process", str(campaign), "-o", str(results / f"{jobs}_{repeat}"), "-q", "-j", str(jobs)]
            started = time.perf_counter()
            subprocess.run([sys.executable, "-m", "wentry_cli.cli.main", *words], check=True)
            taken.append(time.perf_counter() - started)
        method = f"{PROCESSING} -j {jobs}"
        told = f"wall time, {os.cpu_count()} cores"
        rows.append(_row(f"{len(drops)}{CAMPAIGN}", method, min(taken), None, truth, told))
    return rows


def _seconds(work: Callable[[], Any]) -> float:
    """Processor time of ``work`` in seconds."""
    started = time.process_time()
    work()
    return time.process_time() - started


def _best_process(results: Path, drop: Drop, stages: tuple[ModuleType, ...] = PROCESS) -> float:
    """Least processor time of ``stages``, each by itself, in seconds."""
    runs = [_process(results, drop, stages) for _ in range(REPEATS)]
    return sum(min(run[name] for run in runs) for name in runs[0])


def _process(results: Path, drop: Drop, stages: tuple[ModuleType, ...] = PROCESS) -> dict[str, float]:
    """Run stages as `wentry process` does, each frame decoded once; processor time of each in seconds."""
    taken = {}
    with decoded_once(results):
        for stage in stages:
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


def _in_metres(bottoms: Floats, geometry: pd.Series[Any]) -> pd.DataFrame:
    """What the peer makes of y_b, with our scale and surface."""
    metres = (geometry["surface_y_px"] - bottoms) / geometry["scale_px_per_m"]
    return pd.DataFrame({"y_b_m": metres, "status": "ok"})


def _threshold_recipe(folder: Path) -> Floats:
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
    items = len(truth)
    return BenchRow("throughput", case, method, "y_b", "mm", bias, rmse, nan, failures, time_us, told, items=items)
