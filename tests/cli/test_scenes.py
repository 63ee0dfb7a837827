"""The scene decides the work: each kind of drop runs to the report with just the tables that it needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import SMALL, Command
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

LAW = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
SOFT = {"diameter_m": 0.051, "material": "dragonskin_6p70_small", "law": LAW}
SIDE = {**SMALL["side"], "fps": 2000}  # type: ignore[dict-item]
TOP = {"width": 200, "height": 200, "scale_px_per_m": 1200, "camera_distance_m": 1.5, "fps": 2000}
CLIP = {"before_s": 0.012, "longest_s": 0.09}

# the table "What runs, by scene" of the contract
SCENES: dict[str, tuple[dict[str, Any], str]] = {
    "free_flight": (
        {
            "kind": "free_flight",
            "impact_speed_m_s": 1.0,
            "side": {**SIDE, "surface_y_px": 60.2},
            "clip": {"longest_s": 0.05},
        },
        "frames geometry side kinematics summary",
    ),
    "surface_impact": (
        {"kind": "surface_impact", "sphere": SOFT, "side": {**SIDE, "surface_y_px": 330.3}, "clip": CLIP},
        "frames geometry side stretch periods model model_fit summary",
    ),
    "rigid": ({"side": SIDE, "clip": CLIP}, "frames geometry side cavity neck events kinematics forces summary"),
    "rigid_with_top": (
        {"side": SIDE, "top": TOP, "clip": CLIP},
        "frames geometry side top cavity neck events kinematics forces summary",
    ),
    "side_only": (
        {"sphere": SOFT, "side": SIDE, "clip": CLIP},
        "frames geometry side cavity neck events stretch periods kinematics model model_fit kinematics_model forces "
        "summary",
    ),
    "top_only": (
        {"sphere": SOFT, "side": None, "top": TOP, "clip": CLIP},
        "frames geometry top stretch periods summary",
    ),
    "deformable": (
        {"sphere": SOFT, "side": SIDE, "top": TOP, "clip": CLIP},
        "frames geometry side top cavity neck events stretch periods kinematics model model_fit kinematics_model "
        "forces summary",
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_writes_just_its_tables(name: str, wentry: Command, tmp_path: Path) -> None:
    changes, tables = SCENES[name]
    scene = {key: value for key, value in {**SMALL, "name": name, **changes}.items() if value is not None}
    render_drop(Scene.model_validate(scene), tmp_path / name)
    done = wentry("run", tmp_path / name, "-o", tmp_path / "r", "-v")
    assert done.code == 0, done.err
    written = {path.stem for path in (tmp_path / "r" / name).glob("*.csv")}
    assert written == set(tables.split())
    summary = read_table(tmp_path / "r", "summary").iloc[0]
    assert summary["kind"] == scene.get("kind", "water_entry")
    assert summary["frames_measured"] > 12
    assert (tmp_path / "r" / "report.html").stat().st_size > 10_000
    assert not (tmp_path / "r" / name / "error.log").exists()
