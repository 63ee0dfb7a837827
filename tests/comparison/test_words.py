"""Words of the summary against those of the truth: right, wrong, or nothing said."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from wentry_cli.comparison.campaign import compare
from wentry_cli.tables import new_table, write_table


@pytest.mark.parametrize(
    ("said", "true", "measured", "rmse"),
    [("deep_seal", "deep_seal", 1, 0.0), ("surface_seal", "deep_seal", 1, 1.0), ("", "deep_seal", 0, None),
     ("", "none", 1, 0.0), ("deep_seal", "none", 1, 1.0)],
)  # fmt: skip
def test_nothing_said_is_no_wrong_word(tmp_path: Path, said: str, true: str, measured: int, rmse: float | None) -> None:
    folder, truth = tmp_path / "results" / "d", tmp_path / "videos" / "d" / "truth"
    folder.mkdir(parents=True)
    truth.mkdir(parents=True)
    (folder / "drop.json").write_text("{}")
    write_table(
        folder, "summary", new_table("summary", {"drop": ["d"], "kind": ["water_entry"], "seal_type": [said or None]})
    )
    (truth / "truth.csv").write_text("frame,time_s,t_s,measurable\n0,0,0,1\n")
    (truth / "truth.yaml").write_text(yaml.safe_dump({"seal_type": true}))
    line = next(item for item in compare(tmp_path / "results", tmp_path / "videos") if item.quantity == "seal_type")
    assert line.errors.measured == measured
    assert rmse is None or line.errors.rmse == rmse


def test_what_a_scene_has_not_by_definition_is_not_compared(tmp_path: Path) -> None:
    """A free flight meets no surface, and only a deep seal closes a cavity that has a number."""
    truth = {"u0_m_s": 0.0, "surface_y_px": 100.0, "scale_px_per_m": 1000.0, "seal_type": None}
    for kind, seal, expected in (
        ("free_flight", None, {"scale_px_per_m"}),
        ("water_entry", "sphere_seal", {"scale_px_per_m", "impact_speed_m_s", "surface_y_px", "seal_type"}),
        (
            "water_entry",
            "deep_seal",
            {"scale_px_per_m", "impact_speed_m_s", "surface_y_px", "seal_type", "pinch_off_cavity"},
        ),
    ):
        folder, place = tmp_path / kind / str(seal) / "r" / "d", tmp_path / kind / str(seal) / "v" / "truth"
        folder.mkdir(parents=True)
        place.mkdir(parents=True)
        (folder / "drop.json").write_text(json.dumps({"experiment": {"kind": kind}}))
        write_table(folder, "summary", new_table("summary", {"drop": ["d"], "kind": [kind]}))
        write_table(folder, "geometry", new_table("geometry", {"view": ["side"], "scale_px_per_m": [1000.0]}))
        (place / "truth.csv").write_text("frame,time_s,t_s,measurable\n0,0,0,1\n")
        (place / "truth.yaml").write_text(yaml.safe_dump(truth | {"seal_type": seal, "pinch_off_cavity": 1}))
        assert {line.quantity for line in compare(folder.parent, place.parent)} == expected
