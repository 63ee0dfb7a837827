"""The top view of whole drops: stretch from the circle while the sphere recedes from the camera under its crown."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wentry_cli.bench.row import BenchRow
from wentry_cli.config.campaign import read_drop
from wentry_cli.stages import ingest, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

MATERIAL = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
RADIUS_M = 0.0255
SIDE = {"width": 240, "height": 300, "scale_px_per_m": 1200.0, "surface_y_px": 110.25}
TOP = {"width": 320, "height": 320, "scale_px_per_m": 2000.0}
NEAR = {"camera_distance_m": 1.5}
FRONT_LIGHT = {"polarity": "bright", "lamp": {"dark": 0.08}}
# Keys of the top view and switches of each clip.
CLIPS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "far camera": ({}, {}),
    "perspective, distance told": (NEAR, {}),
    "perspective, distance not told": (NEAR, {"tell_camera_distance": False}),
    "ragged crown": ({}, {"ragged_crown": 0.6}),
    "bright on dark": (FRONT_LIGHT, {}),
    "bright on dark, highlights, crown's shadow": (FRONT_LIGHT, {"wet_highlights": 12, "crown_shadow": True}),
}
# An error beyond this is no measurement of the sphere; called good beyond this many uncertainties and this much: false.
GROSS, FALSE_SIGMA, FALSE = 0.08, 5.0, 0.002


def run(quick: bool, seed: int) -> list[BenchRow]:
    """A row a clip; ``quick`` takes the first and a shorter one."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for number, (case, (view, switches)) in enumerate(CLIPS.items()):
            if quick and number:
                break
            folder = Path(name) / f"clip{number}"
            render_drop(_scene(seed + number, view, switches, 0.02 if quick else 0.05), folder)
            rows.append(_row(case, folder))
    return rows


def _scene(seed: int, view: dict[str, Any], switches: dict[str, Any], longest_s: float) -> Scene:
    return Scene.model_validate(
        {
            "name": "bench",
            "seed": seed,
            "sphere": {"diameter_m": 2.0 * RADIUS_M, "material": "dragonskin_6p70_small", "law": MATERIAL},
            "impact_speed_m_s": 5.0,
            "side": SIDE,
            "top": TOP | view,
            "switches": switches,
            "clip": {"before_s": 0.008, "longest_s": longest_s},
        }
    )


def _row(case: str, folder: Path) -> BenchRow:
    drop, results = read_drop("bench", folder), folder / "results"
    ingest.run(results, drop)
    start = time.process_time()
    track.run(results, drop)
    spent = time.process_time() - start
    truth = pd.read_csv(folder / "truth" / "top.csv")
    top = read_table(results, "top").iloc[: len(truth)]
    wanted = (truth["measurable"] == 1).to_numpy()
    ok = (top["status"] == "ok").to_numpy(bool)
    error, unc = (top["stretch"] - truth["stretch"]).to_numpy(float), top["stretch_unc"].to_numpy(float)
    good = wanted & ok & (np.abs(error) < GROSS)
    false = ok & (np.abs(error) > FALSE_SIGMA * unc) & (np.abs(error) > FALSE)
    pull = error[good] / unc[good]
    nothing = not good.any()
    return BenchRow(
        chapter="top_clips",
        case=case,
        method="wentry",
        quantity="stretch",
        unit="1",
        bias=math.nan if nothing else float(error[good].mean()),
        rmse=math.nan if nothing else float(np.sqrt(np.mean(error[good] ** 2))),
        ratio_to_bound=math.nan,
        failures=1.0 - float(good.sum() / max(1, wanted.sum())),
        time_us=1e6 * spent / len(truth),
        note=f"{int(wanted.sum())} frames show the whole circle, both views tracked",
        pull=math.nan if nothing else float(np.sqrt(np.mean(pull**2))),
        beyond_3=math.nan if nothing else float(np.mean(np.abs(pull) > 3.0)),
        measured=float((wanted & ok).sum() / max(1, wanted.sum())),
        false_ok=float(false.sum() / max(1, ok.sum())),
        items=len(truth),
    )
