"""The closure of the crown is a row of events.csv and a key of the truth."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from wentry_cli.comparison.campaign import Comparison, compare
from wentry_cli.tables import new_table, write_table

EVENTS = ["impact", "dome_over", "pinch_off"]


def _compared(folder: Path, true_s: float, measured_s: float | None) -> list[Comparison]:
    drop, truth = folder / "results" / "d", folder / "videos" / "d" / "truth"
    drop.mkdir(parents=True)
    truth.mkdir(parents=True)
    (drop / "drop.json").write_text("{}")
    columns = {"event": EVENTS, "index": [1, 1, 1], "t_s": [0.0, measured_s, 0.05], "t_s_unc": [1e-5, 5e-4, 1e-4]}
    write_table(drop, "events", new_table("events", columns))
    write_table(drop, "summary", new_table("summary", {"drop": ["d"], "kind": ["water_entry"], "seal_type": [None]}))
    (truth / "truth.csv").write_text("frame,time_s,t_s,measurable\n0,0,-0.01,1\n1,0.07,0.06,1\n")
    (truth / "truth.yaml").write_text(yaml.safe_dump({"dome_over_s": true_s, "seal_type": "none"}))
    return [item for item in compare(folder / "results", folder / "videos") if item.quantity == "dome_over_s"]


@pytest.mark.parametrize(("measured_s", "measured", "beyond"), [(0.0304, 1, 0.0), (0.0214, 1, 1.0), (None, 0, None)])
def test_it_is_compared_with_its_uncertainty(
    tmp_path: Path, measured_s: float | None, measured: int, beyond: float | None
) -> None:
    (line,) = _compared(tmp_path, 0.03, measured_s)
    assert (line.table, line.unit, line.errors.measurable, line.errors.measured) == ("events", "s", 1, measured)
    if measured_s is not None:
        assert line.errors.bias == pytest.approx(measured_s - 0.03)
        assert line.errors.beyond_3 == beyond


def test_a_crown_that_closes_after_the_clip_is_not_asked_for(tmp_path: Path) -> None:
    assert _compared(tmp_path, 0.07, None) == []
