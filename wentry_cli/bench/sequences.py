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
from wentry_cli.bench.table import DASH
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
DROPS = 3  # of a sequence: noise, droplets and bubbles of each are its own
# Called ok with an error beyond this many uncertainties and this many pixels: false.
FALSE_SIGMA, FALSE_PX = 5.0, 0.1
# Event, its time in truth.yaml, and its word there.
EVENTS = {"impact": ("impact_time_s", ""), "pinch_off": ("t_p_s", "seal_type"), "dome_over": ("dome_over_s", "")}


@dataclass(frozen=True)
class Quantity:
    """A name and unit, the column that has it, its truth, the factor to the unit, and that to pixels."""

    name: str
    unit: str
    column: str
    truth: FloatArray
    scale: float
    scale_px: float


@dataclass(frozen=True)
class Event:
    """What the tables say of an event, and how many frames and uncertainties its time is off (NaN: no time)."""

    said: str
    off_frames: float = math.nan
    sigmas: float = math.nan


@dataclass(frozen=True)
class Measured:
    """A drop of a sequence: table of the view, which frames can be measured, quantities, events, time in µs."""

    found: pd.DataFrame
    can: NDArray[np.bool_]
    quantities: list[Quantity]
    events: dict[str, Event]
    in_view: int
    spent_us: float
    refusal: str = ""


def run(quick: bool, seed: int) -> list[BenchRow]:
    """Rows of y_b, its row in the picture, and λ, a sequence; ``quick`` takes one drop of two of them."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for number, sequence in enumerate(SEQUENCES[:2] if quick else SEQUENCES):
            places = [Path(name) / f"sequence{number}_{drop}" for drop in range(1 if quick else DROPS)]
            drops = [measure(sequence, seed + 100 * k + number, place) for k, place in enumerate(places)]
            rows += list_rows(sequence.name, drops)
    return rows


def measure(sequence: HardSequence, seed: int, folder: Path) -> Measured:
    """Render a drop of a sequence into ``folder`` and process it there."""
    scene = sequence.scene(seed)
    clip = _render(sequence, scene, folder)
    results, started = folder / "results", time.process_time()
    refusal = _process(folder, results)
    spent_us = 1e6 * (time.process_time() - started)
    camera = scene.top if sequence.view == "top" else scene.side
    assert camera is not None
    found = clip.frames[["frame"]]
    if has_table(results, sequence.view):
        found = found.merge(read_table(results, sequence.view), on="frame", how="left")
    return Measured(
        found,
        (clip.frames["measurable"] == 1).to_numpy(bool),
        _quantities(clip, scene, camera, sequence.view),
        {event: _find_event(event, results, clip, camera.fps) for event in sequence.events},
        len(found) if sequence.view == "top" else _in_view(clip, camera.height),
        spent_us,
        refusal,
    )


def list_rows(case: str, drops: list[Measured]) -> list[BenchRow]:
    """A row a quantity over the frames of all drops; the first also has what was said."""
    found = pd.concat([drop.found for drop in drops], ignore_index=True)
    can = np.concatenate([drop.can for drop in drops])
    told = [*(drop.refusal for drop in drops), _count_words(found)]
    told += [_tell_event(event, [drop.events[event] for drop in drops]) for event in drops[0].events]
    rows = [
        BenchRow(
            chapter="sequences",
            case=case,
            method="wentry",
            quantity=quantity.name,
            unit=quantity.unit,
            ratio_to_bound=math.nan,
            time_us=sum(drop.spent_us for drop in drops) / len(found),
            note="; ".join(text for text in told if text),
            in_view=sum(drop.in_view for drop in drops),
            **_compare(found, can, quantity),
        )
        for quantity in map(_pool, zip(*(drop.quantities for drop in drops), strict=True))
    ]
    return [rows[0], *(replace(row, note="") for row in rows[1:])]


def _pool(quantities: tuple[Quantity, ...]) -> Quantity:
    """One quantity of several drops, the frames of each behind those of the one before."""
    return replace(quantities[0], truth=np.concatenate([quantity.truth for quantity in quantities]))


def _quantities(clip: Rendered, scene: Scene, camera: Camera, view: str) -> list[Quantity]:
    """The height y_b with all of its uncertainty, the row of the bottom with that of the frame alone, and λ."""
    scale, radius_m = camera.scale_px_per_m, 0.5 * scene.sphere.diameter_m
    stretch = Quantity("stretch", "1", "stretch", clip.frames["stretch"].to_numpy(float), 1.0, radius_m * scale)
    if view == "top":
        return [stretch]
    height = Quantity("y_b", "px", "y_b_m", clip.frames["y_b_m"].to_numpy(float), scale, scale)
    return [height, Quantity("bottom_y", "px", "bottom_y_px", clip.bottom_row(), 1.0, 1.0), stretch]


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


def _compare(found: pd.DataFrame, can: NDArray[np.bool_], quantity: Quantity) -> dict[str, Any]:
    """Errors over the frames that are called ok, whether the truth calls them measurable or not."""
    status = found["status"] if "status" in found else pd.Series("", found.index)
    ok = (status == "ok").to_numpy(bool)
    measured, unc = (
        found[name].to_numpy(float) if name in found else np.full(len(found), math.nan)
        for name in (quantity.column, f"{quantity.column}_unc")
    )
    error = (measured - quantity.truth)[ok]
    pull, nothing = error / unc[ok], not ok.any()
    false = (np.abs(pull) > FALSE_SIGMA) & (np.abs(error) * quantity.scale_px > FALSE_PX)
    share = float(ok[can].mean()) if can.any() else math.nan
    return {
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


def _find_event(event: str, results: Path, clip: Rendered, fps: float) -> Event:
    """An event in the tables beside the truth: its status and word, and how far its time is off."""
    time_key, word_key = EVENTS[event]
    wanted, rows = clip.numbers[time_key], _rows_of(event, results)
    if rows.empty:
        return Event("not told")
    row = rows.iloc[0]
    said = str(row["status"]) + (f", {row['value']}" if word_key and isinstance(row["value"], str) else "")
    if wanted is None or wanted > clip.frames["time_s" if event == "impact" else "t_s"].max():
        return Event(f"{said} (truth: after the clip)")
    said += f" (truth: {clip.numbers[word_key]})" if word_key else ""
    off = row["t_s"] - wanted
    return Event(said, off * fps, abs(off) / row["t_s_unc"])


def _tell_event(event: str, found: list[Event]) -> str:
    """``pinch-off ok, deep_seal (truth: deep_seal), off by +0.1, –, +0.0 frames (0.3, –, 0.1 unc)``: a drop each."""
    said = " or ".join(dict.fromkeys(item.said for item in found))
    timed = [math.isfinite(item.off_frames) for item in found]
    if not any(timed):
        return f"{event.replace('_', '-')} {said}"
    off = ", ".join(f"{item.off_frames:+.2f}" if told else DASH for item, told in zip(found, timed, strict=True))
    sigmas = ", ".join(f"{item.sigmas:.1f}" if told else DASH for item, told in zip(found, timed, strict=True))
    return f"{event.replace('_', '-')} {said}, off by {off} frames ({sigmas} unc)"


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
