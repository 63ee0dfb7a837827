"""Small rendered drops, written as a laboratory would leave them; the truth is for the tests alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from tests.synthetic.drops import SOFT, make_scene
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.errors import WentryError
from wentry_cli.stages import ingest, track
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.tables import read_table

SIDE: dict[str, Any] = {"width": 176, "height": 260, "scale_px_per_m": 900.0, "surface_y_px": 90.25}


def render(folder: Path, **keys: Any) -> Path:
    """Render a short drop into ``folder``."""
    sphere = {"diameter_m": 0.051, "law": SOFT, "material": "dragonskin_6p70_small"}
    base: dict[str, Any] = {"sphere": sphere, "side": SIDE, "clip": {"before_s": 0.006, "longest_s": 0.03}}
    render_drop(make_scene(**(base | keys)), folder)
    return folder


def change(folder: Path, name: str = "side", **view: Any) -> None:
    """Change keys of a view in the ``experiment.yaml`` of a drop."""
    path = folder / "experiment.yaml"
    said = yaml.safe_load(path.read_text(encoding="utf-8"))
    said["views"][name] |= view
    path.write_text(yaml.safe_dump(said), encoding="utf-8")


def measure(folder: Path, out: Path) -> tuple[Drop, WentryError | None]:
    """Run ingest and track; returns the drop and the error that one of them raised."""
    drop = read_drop(folder.name, folder)
    try:
        ingest.run(out, drop)
        track.run(out, drop)
    except WentryError as error:
        return drop, error
    return drop, None


def truth(folder: Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """The rendered truth: a row per frame, and the numbers of the drop."""
    said = yaml.safe_load((folder / "truth" / "truth.yaml").read_text(encoding="utf-8"))
    return pd.read_csv(folder / "truth" / "truth.csv"), said


def errors_px(folder: Path, out: Path) -> dict[str, np.ndarray]:
    """Errors of y_b (px in air) and λ in the frames that can be measured, and which of those are ok."""
    known, said = truth(folder)
    side = read_table(out, "side").iloc[: len(known)]
    can = (known.measurable == 1).to_numpy()
    ok = (side.status == "ok").to_numpy()
    y_b = (side.y_b_m.to_numpy() - known.y_b_m.to_numpy()) * said["scale_px_per_m"]
    return {"y_b": y_b[can], "stretch": (side.stretch.to_numpy() - known.stretch.to_numpy())[can], "ok": ok[can]}
