"""The top view is compared by its own frames, with what the crown lets it see."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from wentry_cli.comparison.campaign import compare
from wentry_cli.tables import new_table, write_table


def test_radius_and_stretch_of_the_top_view(tmp_path: Path) -> None:
    drop, truth = tmp_path / "results" / "d", tmp_path / "videos" / "d" / "truth"
    drop.mkdir(parents=True)
    truth.mkdir(parents=True)
    (drop / "drop.json").write_text("{}")
    (truth / "truth.yaml").write_text("")
    (truth / "truth.csv").write_text("frame,t_s,stretch\n0,0,5\n1,0.001,5\n2,0.002,5\n")
    (truth / "top.csv").write_text(
        "frame,t_s,stretch,radius_px,measurable\n0,0,1.0,20,1\n1,0.001,1.1,22,1\n2,0.002,1,9,0\n"
    )
    columns = {
        "frame": np.arange(3),
        "radius_px": [20.5, 21.5, 30.0],
        "radius_px_unc": [0.5, 0.5, 0.5],
        "stretch": [1.1, 1.0, 1.5],
        "status": ["ok", "no_circle", "ok"],
    }
    write_table(drop, "top", new_table("top", columns))
    lines = {line.quantity: line for line in compare(tmp_path / "results", tmp_path / "videos")}
    assert {(line.table, line.errors.measurable, line.errors.measured) for line in lines.values()} == {("top", 2, 1)}
    np.testing.assert_allclose([lines["radius_px"].errors.bias, lines["radius_px"].errors.pull], [0.5, 1.0])
    np.testing.assert_allclose(lines["stretch"].errors.bias, 0.1)
    assert (lines["radius_px"].unit, lines["stretch"].unit) == ("px", "1")
