"""Every table of whole drops keeps the promise of its status words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.promises import broken_promises
from tests.synthetic.drops import SOFT, make_scene
from wentry_cli.cli.main import run
from wentry_cli.schemas import TABLES
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.tables import new_table, read_table, vouched, write_table

SAMPLE = Path(__file__).resolve().parent.parent / "sample_frames"
SPHERE = {"diameter_m": 0.051, "law": SOFT, "material": "dragonskin_6p70_small"}
TOP = {"width": 176, "height": 176, "scale_px_per_m": 1000.0, "camera_distance_m": 1.5}
SIDE = {"width": 200, "height": 360, "scale_px_per_m": 900.0, "surface_y_px": 90.25}
SHORT = {"before_s": 0.006, "longest_s": 0.04}
DROPS: dict[str, dict[str, Any]] = {
    "soft": {"top": TOP, "clip": {"before_s": 0.006, "after_pinch_off_s": 0.004, "longest_s": 0.12}},
    "rigid": {"sphere": {"diameter_m": 0.051}, "clip": {"before_s": 0.006, "longest_s": 0.1}},
    "spoilt": {"clip": SHORT, "switches": {"droplets": 40, "bubbles": 30, "tilt_deg": 3.0, "mirror_image": True}},
    "plate": {"kind": "surface_impact", "side": SIDE | {"surface_y_px": 250.4}, "clip": SHORT},
    "flight": {"kind": "free_flight", "clip": {"before_s": 0.0, "longest_s": 0.02}},
    "above": {"side": None, "top": TOP, "clip": SHORT},
    "gone": {"clip": {"before_s": 0.006, "longest_s": 0.008}},
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("promises")
    for name, keys in DROPS.items():
        scene = {"name": name, "sphere": SPHERE, "side": SIDE} | keys
        render_drop(make_scene(**scene), base / "videos" / name)
    run(["process", str(base / "videos"), "-o", str(base / "results"), "-q"])
    run(["fit", str(base / "results"), "-q"])
    return base / "results"


@pytest.mark.parametrize("drop", DROPS)
def test_an_ok_row_of_a_rendered_drop_is_filled(results: Path, drop: str) -> None:
    assert broken_promises(results / drop) == []


def test_an_ok_row_of_a_campaign_is_filled(results: Path) -> None:
    assert broken_promises(results) == []
    good = {name for folder in results.iterdir() if folder.is_dir() for name in _with_ok(folder)}
    assert {"frames", "side", "top", "events", "periods", "kinematics"} <= good


def _with_ok(folder: Path) -> list[str]:
    written = [name for name in TABLES if TABLES[name].promised and (folder / f"{name}.csv").is_file()]
    return [name for name in written if (read_table(folder, name)["status"] == "ok").any()]


def test_the_sample_drop_keeps_the_promise(tmp_path: Path) -> None:
    assert run(["process", str(SAMPLE), "-o", str(tmp_path), "-q"]) == 0
    for folder in (tmp_path, *(item for item in tmp_path.iterdir() if item.is_dir())):
        assert broken_promises(folder) == []


def test_an_empty_cell_that_was_promised_is_told(tmp_path: Path) -> None:
    columns = {name: [1.0, 1.0] for name in TABLES["top"].names} | {"status": ["ok", "occluded"]}
    columns["stretch"] = [float("nan"), float("nan")]
    assert vouched("top", columns) == ["not_identified", "occluded"]
    write_table(tmp_path, "top", new_table("top", columns))
    assert broken_promises(tmp_path) == ["top.stretch: 1"]


def test_an_uncertainty_may_be_empty_where_its_value_may() -> None:
    for table in TABLES.values():
        by_name = {column.name: column for column in table.columns}
        for name, column in by_name.items():
            if f"{name}_unc" in by_name and column.may_be_empty:
                assert by_name[f"{name}_unc"].may_be_empty
