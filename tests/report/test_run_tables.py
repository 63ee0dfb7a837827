"""How a run went, told in the report."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.run_tables import recording_table, warning_table
from wentry_cli.tables import new_table


def test_what_the_stages_over_all_drops_warned_of_stands_last() -> None:
    none = pd.DataFrame()
    drop = DropResults("one", {}, {}, (), {}, {"track": {"warnings": ["the light is bright"]}, "cavity": "damaged"})
    told = "one and other were measured from the same recording"
    run = {"stages": {"scaling": {"warnings": [told]}, "report": {"warnings": "no list"}}}
    campaign = Campaign(Path("results"), (drop,), none, none, none, none, none, run)
    assert warning_table(campaign).rows == (("one", "track", "the light is bright"), ("all drops", "scaling", told))


def test_how_a_drop_was_filmed_is_as_the_tracking_used_it() -> None:
    none = pd.DataFrame()
    used = {
        "view": ["side"], "width_px": [512], "height_px": [768], "fps": [4000.0], "fps_source": ["cihx"],
        "exposure_s": [5e-5], "scale_px_per_m": [1800.0],
        "scale_px_per_m_unc": [0.4], "scale_water_px_per_m": [1890.0], "scale_source": ["air diameter"],
    }  # fmt: skip
    tables = {
        "geometry": new_table("geometry", used),
        "frames": new_table("frames", {"view": ["side", "side", "top"], "frame": [0, 1, 0]}),
    }
    views = {"side": {"source": "a", "fps": 2000.0}, "top": {"source": "b", "fps": 1000.0, "scale_px_per_m": "auto"}}
    drop = DropResults("one", {}, tables, (), {"views": views})
    campaign = Campaign(Path("results"), (drop,), none, none, none, none, none, {})
    assert recording_table(campaign).rows == (
        ("one, side", "2", "512 × 768", "4000", "50", "1.80000 ± 0.00040", "1.89", "cihx", "air diameter"),
        ("one, top", "1", "–", "1000", "–", "–", "–", "–", "–"),
    )


def test_notes_of_the_run_stand_with_their_drop() -> None:
    none = pd.DataFrame()
    drops = tuple(DropResults(name, {}, {}, (), {}, {"track": {"warnings": ["dim"]}}) for name in ("one", "two"))
    run = {"notes": [["one", "stretch", "stretch.csv is not as this stage wrote it"], ["gone", "", "x"], "damaged"]}
    campaign = Campaign(Path("results"), drops, none, none, none, none, none, run)
    told = ("one", "stretch", "stretch.csv is not as this stage wrote it")
    assert warning_table(campaign).rows == (("one", "track", "dim"), told, ("two", "track", "dim"))
