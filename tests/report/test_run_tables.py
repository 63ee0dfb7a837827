"""How a run went, told in the report."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from wentry_cli.report.campaign import Campaign, DropResults
from wentry_cli.report.run_tables import warning_table


def test_what_the_stages_over_all_drops_warned_of_stands_last() -> None:
    none = pd.DataFrame()
    drop = DropResults("one", {}, {}, (), {}, {"track": {"warnings": ["the light is bright"]}, "cavity": "damaged"})
    told = "one and other were measured from the same recording"
    run = {"stages": {"scaling": {"warnings": [told]}, "report": {"warnings": "no list"}}}
    campaign = Campaign(Path("results"), (drop,), none, none, none, none, none, run)
    assert warning_table(campaign).rows == (("one", "track", "the light is bright"), ("all drops", "scaling", told))


def test_notes_of_the_run_stand_with_their_drop() -> None:
    none = pd.DataFrame()
    drops = tuple(DropResults(name, {}, {}, (), {}, {"track": {"warnings": ["dim"]}}) for name in ("one", "two"))
    run = {"notes": [["one", "stretch", "stretch.csv is not as this stage wrote it"], ["gone", "", "x"], "damaged"]}
    campaign = Campaign(Path("results"), drops, none, none, none, none, none, run)
    told = ("one", "stretch", "stretch.csv is not as this stage wrote it")
    assert warning_table(campaign).rows == (("one", "track", "dim"), told, ("two", "track", "dim"))
