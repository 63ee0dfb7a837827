"""Error of ΔU = U₀ − U₁ by the λ that places the centre: exact, measured, measured with a bridge, the model's.

Soft spheres are rendered and measured from their frames: some oscillate by the model's own law (slowed down by the
water; but loaded by the impact, where the paper's model is released from the first peak without any creep), some off
it: valleys 30 % too shallow, a period that grows with depth. The bias that is left off the model with exact λ is not
one of the scale (right to 5e-6 here): white noise on the true y_c shows most of it, so it is the smoother's own. For
the bridge all frames within 4 ms of the end of the first period are taken away and filled by the time-scaled model;
left empty, that gap gives no ΔU at all.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.throughput import MATERIAL
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.stages import cavity, ingest, kinematics, model, stretch, track
from wentry_cli.stages.inputs.columns import column
from wentry_cli.stages.summary.speeds import velocity_at, velocity_before_impact
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import new_table, read_table

Array = NDArray[np.float64]
CASES: dict[str, dict[str, float]] = {
    "on the model": {},
    "off the model": {"shallow_valleys": 0.3, "period_growth": 0.08},
}
CHOICES = ("exact", "measured", "measured, gap left empty", "measured, gap bridged by the model", "model")
DROPS = 4
GAP_S = 0.004
STAGES = (ingest, track, cavity, stretch, kinematics, model)
IMPACT_SPEEDS = (3.2, 5.5)


def run(quick: bool, seed: int) -> list[BenchRow]:
    """One row a case and choice: error of ΔU in mm/s over ``DROPS`` drops (``quick``: one); time to measure a drop."""
    rows: list[BenchRow] = []
    with tempfile.TemporaryDirectory() as name:
        for case, physics in CASES.items():
            found: dict[str, list[tuple[float, float]]] = {choice: [] for choice in CHOICES}
            seconds = []
            for k in range(1 if quick else DROPS):
                folder = Path(name) / f"{case.replace(' ', '_')}{k}"
                render_drop(_scene(seed + k, physics), folder)
                started = time.perf_counter()
                drop = _measure(folder)
                seconds.append(time.perf_counter() - started)
                for choice, error, unc in _errors(folder, drop):
                    found[choice].append((error, unc))
            rows += [_row(case, choice, pairs, float(np.median(seconds))) for choice, pairs in found.items()]
    return rows


def _scene(seed: int, physics: dict[str, float]) -> Scene:
    """A soft sphere of 51 mm, both views, until well after its first period."""
    random = np.random.default_rng(seed)
    camera = {"fps": 2000, "exposure_s": 1.0e-4}
    return Scene.model_validate(
        {
            "name": "delta_u",
            "seed": seed,
            "sphere": {"diameter_m": 0.051, "material": "dragonskin_6p70_small", "law": MATERIAL},
            "impact_speed_m_s": float(random.uniform(*IMPACT_SPEEDS)),
            "physics": physics,
            "side": camera | {"width": 320, "height": 540, "scale_px_per_m": 1800, "surface_y_px": 170.4},
            "top": camera | {"width": 256, "height": 256, "scale_px_per_m": 2000, "camera_distance_m": 1.5},
            "clip": {"before_s": 0.008, "after_pinch_off_s": 1.0, "longest_s": 0.075},
        }
    )


def _measure(folder: Path) -> Drop:
    """Run the stages that need no campaign into ``folder``/results."""
    drop = read_drop("delta_u", folder)
    for stage in STAGES:
        stage.run(folder / "results", drop)
    return drop


def _errors(folder: Path, drop: Drop) -> Iterator[tuple[str, float, float]]:
    """Choice, error of ΔU and its stated uncertainty, m/s; NaN where the choice gives none."""
    results = folder / "results"
    summary = yaml.safe_load((folder / "truth" / "truth.yaml").read_text(encoding="utf-8"))
    truth = pd.read_csv(folder / "truth" / "truth.csv")
    true = summary["u0_m_s"] * summary["delta_u_over_u0"]
    end = float(summary["periods"][0]["end_s"])
    side, measured = read_table(results, "side"), read_table(results, "stretch")
    times = column(side, "t_s")
    seen = measured.set_index("frame").reindex(side["frame"])
    value, unc = column(seen, "stretch"), column(seen, "stretch_unc")
    scaled = read_table(results, "model")
    bridge = np.interp(times, column(scaled, "t_scaled_s"), column(scaled, "stretch"), left=np.nan, right=np.nan)
    misfit = float(read_table(results, "model_fit")["residual_rms"].iloc[0])
    gap = np.abs(times - end) < GAP_S
    exact = truth.set_index("frame")["stretch"].reindex(side["frame"]).to_numpy(dtype=float)
    choices: dict[str, tuple[Array, Array]] = {
        "exact": (exact, np.full(exact.size, 1e-5)),
        "measured": (value, unc),
        "measured, gap left empty": (np.where(gap, np.nan, value), unc),
        "measured, gap bridged by the model": (np.where(gap, bridge, value), np.where(gap, misfit, unc)),
    }
    for choice, known in choices.items():
        motion = kinematics.motion_columns(kinematics.entry_motion(results, drop, known))
        table = new_table("kinematics", {"frame": side["frame"].to_numpy(), "t_s": times} | motion)
        yield choice, *_delta_u(table, end, true)
    yield "model", *_delta_u(read_table(results, "kinematics_model"), end, true)


def _delta_u(table: pd.DataFrame, end_s: float, true: float) -> tuple[float, float]:
    before, before_unc = velocity_before_impact(table)
    after, after_unc = velocity_at(table, end_s)
    return after - before - true, math.hypot(before_unc, after_unc)


def _row(case: str, choice: str, pairs: list[tuple[float, float]], seconds: float) -> BenchRow:
    error, unc = 1e3 * np.array(pairs).T
    known = np.isfinite(error)
    held = "no value"
    if known.any():
        held = f"scatter {np.std(error[known]):.2g}, stated ± {np.sqrt(np.mean(unc[known] ** 2)):.2g} mm/s"
    return BenchRow(
        chapter="delta_u",
        case=f"ΔU, {case}",
        method=f"λ {choice}",
        quantity="ΔU",
        unit="mm/s",
        bias=float(np.mean(error[known])) if known.any() else math.nan,
        rmse=float(np.sqrt(np.mean(error[known] ** 2))) if known.any() else math.nan,
        ratio_to_bound=math.nan,
        failures=float(np.mean(~known)),
        time_us=1e6 * seconds,
        note=held,
    )
