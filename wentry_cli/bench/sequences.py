"""Hard sequences: what is measured, what is declared unmeasured, and whether the status tells the truth."""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.sequence_scenes import SEQUENCES, HardSequence, Rendered
from wentry_cli.config.campaign import read_drop
from wentry_cli.config.places import read_document
from wentry_cli.errors import WentryError
from wentry_cli.frames.decoded import decoded_once
from wentry_cli.stages import cavity, ingest, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Camera, Scene
from wentry_cli.tables import has_table, read_table

FloatArray = NDArray[np.float64]
STAGES = (ingest, track, cavity)
# Called ok with an error beyond this many uncertainties and this many pixels: false.
FALSE_SIGMA, FALSE_PX = 5.0, 0.1
# Event, its time in truth.yaml, and its word there.
EVENTS = {"impact": ("impact_time_s", ""), "pinch_off": ("t_p_s", "seal_type"), "dome_over": ("dome_over_s", "")}


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Rows of y_b, its row in the picture, and λ, a sequence; ``quick`` takes two of them."""
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
    told = [refusal, _count_words(found), *(_tell_event(event, results, clip, camera.fps) for event in sequence.events)]
    in_view = len(found) if sequence.view == "top" else _in_view(clip, camera.height)
    rows = [
        BenchRow(
            chapter="sequences",
            case=sequence.name,
            method="wentry",
            ratio_to_bound=math.nan,
            time_us=spent_us,
            note="; ".join(text for text in told if text),
            in_view=in_view,
            **_compare(found, clip.frames, quantity),
        )
        for quantity in _quantities(clip, scene, camera, sequence.view)
    ]
    return [rows[0], *(replace(row, note="") for row in rows[1:])]


@dataclass(frozen=True)
class _Quantity:
    """A name and unit, the column that has it, its truth, the factor to the unit, and that to pixels."""

    name: str
    unit: str
    column: str
    truth: FloatArray
    scale: float
    scale_px: float


def _quantities(clip: Rendered, scene: Scene, camera: Camera, view: str) -> list[_Quantity]:
    """The height y_b with all of its uncertainty, the row of the bottom with that of the frame alone, and λ."""
    scale, radius_m = camera.scale_px_per_m, 0.5 * scene.sphere.diameter_m
    stretch = _Quantity("stretch", "1", "stretch", clip.frames["stretch"].to_numpy(float), 1.0, radius_m * scale)
    if view == "top":
        return [stretch]
    height = _Quantity("y_b", "px", "y_b_m", clip.frames["y_b_m"].to_numpy(float), scale, scale)
    return [height, _Quantity("bottom_y", "px", "bottom_y_px", clip.bottom_row(), 1.0, 1.0), stretch]


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


def _compare(found: pd.DataFrame, frames: pd.DataFrame, quantity: _Quantity) -> dict[str, Any]:
    """Errors over the frames that are called ok, whether the truth calls them measurable or not."""
    status = found["status"] if "status" in found else pd.Series("", found.index)
    ok, can = (status == "ok").to_numpy(bool), (frames["measurable"] == 1).to_numpy()
    measured, unc = (
        found[name].to_numpy(float) if name in found else np.full(len(found), math.nan)
        for name in (quantity.column, f"{quantity.column}_unc")
    )
    error = (measured - quantity.truth)[ok]
    pull, nothing = error / unc[ok], not ok.any()
    false = (np.abs(pull) > FALSE_SIGMA) & (np.abs(error) * quantity.scale_px > FALSE_PX)
    share = float(ok[can].mean()) if can.any() else math.nan
    return {
        "quantity": quantity.name,
        "unit": quantity.unit,
        "bias": math.nan if nothing else quantity.scale * float(error.mean()),
        "rmse": math.nan if nothing else quantity.scale * float(np.sqrt(np.mean(error**2))),
        "failures": 1.0 - share,
        "pull": math.nan if nothing else float(np.sqrt(np.mean(pull**2))),
        "beyond_3": math.nan if nothing else float(np.mean(np.abs(pull) > 3.0)),
        "measured": share,
        "false_ok": math.nan if nothing else float(false.mean()),
        "items": int(can.sum()),
        "unmeasurable_ok": float(ok[~can].mean()) if not can.all() else math.nan,
        "worst": math.nan if nothing else float(np.abs(pull).max()),
    }


def _count_words(found: pd.DataFrame) -> str:
    """Each status with its number of frames: ``41 ok, 6 occluded``."""
    if "status" not in found:
        return "no table"
    counts = found["status"].fillna("no row").value_counts()
    return ", ".join(f"{count} {word}" for word, count in counts.items())


def _tell_event(event: str, results: Path, clip: Rendered, fps: float) -> str:
    """What the tables say of an event beside the truth: status, word, how many frames and uncertainties it is off."""
    time_key, word_key = EVENTS[event]
    name, wanted = event.replace("_", "-"), clip.numbers[time_key]
    rows = _rows_of(event, results)
    if rows.empty:
        return f"{name} not told"
    row = rows.iloc[0]
    said = f"{name} {row['status']}" + (f", {row['value']}" if word_key and isinstance(row["value"], str) else "")
    if wanted is None or wanted > clip.frames["time_s" if event == "impact" else "t_s"].max():
        return f"{said} (truth: after the clip)"
    truth = f" (truth: {clip.numbers[word_key]})" if word_key else ""
    if not np.isfinite(row["t_s"]):
        return f"{said}{truth}, no time"
    off = row["t_s"] - wanted
    return f"{said}{truth}, off by {off * fps:+.2f} frames ({abs(off) / row['t_s_unc']:.1f} unc)"


def _rows_of(event: str, results: Path) -> pd.DataFrame:
    """Rows of events.csv; t_s of the impact counts from the first frame."""
    if not has_table(results, "events"):
        return pd.DataFrame()
    events = read_table(results, "events")
    rows = events[events["event"] == event]
    if event == "impact":
        view = read_table(results, "geometry").iloc[0]
        return rows.assign(t_s=view["impact_time_s"], t_s_unc=view["impact_time_s_unc"])
    return rows
