"""Words of the summary against those of the truth: right, wrong, or nothing said."""

from __future__ import annotations

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
