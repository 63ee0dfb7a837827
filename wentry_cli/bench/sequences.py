"""Hard sequences: what is measured, what is declared unmeasured, and whether the status tells the truth."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.sequence_scenes import SEQUENCES, HardSequence, Rendered
from wentry_cli.comparison.statistics import error_statistics
from wentry_cli.config.campaign import read_drop
from wentry_cli.config.places import read_document
from wentry_cli.errors import WentryError
from wentry_cli.frames.decoded import decoded_once
from wentry_cli.stages import cavity, ingest, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import has_table, read_table

STAGES = (ingest, track, cavity)
# Called ok with an error beyond this many uncertainties and this many pixels: false.
FALSE_SIGMA, FALSE_PX = 5.0, 0.1
# Event, its time in truth.yaml, and its word there.
EVENTS = {"pinch_off": ("t_p_s", "seal_type"), "dome_over": ("dome_over_s", "")}


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Rows of y_b and λ a sequence; ``quick`` takes two of them."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for number, sequence in enumerate(SEQUENCES[:2] if quick else SEQUENCES):
            rows += measure(sequence, seed + number, Path(name) / f"sequence{number}")
    return rows


def measure(sequence: HardSequence, seed: int, folder: Path) -> list[BenchRow]:
    """Render a sequence into ``folder``, process it and hold it against its truth."""
    scene = sequence.scene(seed)
    clip = _render(sequence, scene, folder)
    results, started = folder / "results", time.process_time()
    refusal = _process(folder, results)
    spent_us = 1e6 * (time.process_time() - started) / len(clip.frames)
    camera = scene.top if sequence.view == "top" else scene.side
    assert camera is not None
    found = pd.DataFrame({"frame": clip.frames["frame"]})
    if has_table(results, sequence.view):
        found = found.merge(read_table(results, sequence.view), on="frame", how="left")
    stretch_px = 0.5 * scene.sphere.diameter_m * camera.scale_px_per_m
    quantities = {"y_b_m": ("y_b", "px", camera.scale_px_per_m), "stretch": ("stretch", "1", stretch_px)}
    told = [refusal, _count_words(found), *(_tell_event(event, results, clip, camera.fps) for event in sequence.events)]
    note = "; ".join(text for text in told if text)
    rows = []
    for column, (quantity, unit, scale_px) in quantities.items():
        if column in clip.frames:
            in_view = len(found) if sequence.view == "top" else _in_view(clip, camera.height)
            head = {"chapter": "sequences", "case": sequence.name, "method": "wentry", "quantity": quantity}
            numbers = _compare(found, clip.frames, column, scale_px, scale_px if unit == "px" else 1.0)
            rows.append(BenchRow(**head, **numbers, unit=unit, in_view=in_view, time_us=spent_us, note=note))
            note = ""
    return rows


def _render(sequence: HardSequence, scene: Scene, folder: Path) -> Rendered:
    render_drop(scene, folder)
    table = {"side": "truth.csv", "top": "top.csv"}[sequence.view]
    numbers = read_document(folder / "truth" / "truth.yaml").data
    clip = Rendered(folder, pd.read_csv(folder / "truth" / table), numbers)
    return sequence.spoil(clip) if sequence.spoil is not None else clip


def _process(folder: Path, results: Path) -> str:
    """Run the stages up to the cavity; what one of them refused to do."""
    try:
        with decoded_once(results):
            for stage in STAGES:
                stage.run(results, read_drop("bench", folder))
    except WentryError as error:
        return f"refused: {error}"
    return ""


def _in_view(clip: Rendered, height: int) -> int:
    """Frames of the side view in which any of the sphere lies within the picture."""
    surface, scale = clip.numbers["surface_y_px"], clip.numbers["scale_px_per_m"]
    bottom = surface - scale * clip.frames["y_b_m"]
    top = bottom - 2.0 * scale * (clip.frames["y_c_m"] - clip.frames["y_b_m"])
    return int(((bottom > 0.0) & (top < height - 1.0)).sum())


def _compare(found: pd.DataFrame, truth: pd.DataFrame, column: str, scale_px: float, unit: float) -> dict[str, Any]:
    """Errors over the frames that are called ok, whether the truth calls them measurable or not."""
    status = found["status"] if "status" in found else pd.Series("", found.index)
    ok, can = (status == "ok").to_numpy(bool), (truth["measurable"] == 1).to_numpy()
    true = truth[column].to_numpy(float)
    measured, unc = (
        found[name].to_numpy(float) if name in found else np.full(len(found), math.nan)
        for name in (column, f"{column}_unc")
    )
    errors = error_statistics(measured, true, unc, ok)
    off = np.abs(measured - true)[ok]
    false = (off > FALSE_SIGMA * unc[ok]) & (off * scale_px > FALSE_PX)
    measured_share = float(ok[can].mean()) if can.any() else math.nan
    return {
        "bias": unit * errors.bias,
        "rmse": unit * errors.rmse,
        "ratio_to_bound": math.nan,
        "failures": 1.0 - measured_share,
        "pull": errors.pull,
        "beyond_3": errors.beyond_3,
        "measured": measured_share,
        "false_ok": float(false.mean()) if ok.any() else math.nan,
        "items": int(can.sum()),
        "unmeasurable_ok": float(ok[~can].mean()) if not can.all() else math.nan,
        "worst": float((off / unc[ok]).max()) if ok.any() else math.nan,
    }


def _count_words(found: pd.DataFrame) -> str:
    """Each status with its number of frames: ``41 ok, 6 occluded``."""
    if "status" not in found:
        return "no table"
    counts = found["status"].fillna("no row").value_counts()
    return ", ".join(f"{count} {word}" for word, count in counts.items())


def _tell_event(event: str, results: Path, clip: Rendered, fps: float) -> str:
    """What events.csv says beside the truth: word, status, how many frames and uncertainties its time is off."""
    time_key, word_key = EVENTS[event]
    name, wanted = event.replace("_", "-"), clip.numbers[time_key]
    happens = wanted is not None and wanted <= clip.frames["t_s"].max()
    truth = f"truth {clip.numbers[word_key] if word_key else 'within the clip'}" if happens else "truth after the clip"
    table = read_table(results, "events") if has_table(results, "events") else pd.DataFrame({"event": []})
    rows = table[table["event"] == event]
    if rows.empty:
        return f"{name} no row, {truth}"
    row = rows.iloc[0]
    said = f"{name} {row['status']}" + (f", {row['value']}" if isinstance(row["value"], str) else "")
    if not happens or not np.isfinite(row["t_s"]):
        return f"{said}, {truth}"
    off = row["t_s"] - wanted
    return f"{said}, {truth}, off by {off * fps:+.2f} frames ({abs(off) / row['t_s_unc']:.1f} unc)"
