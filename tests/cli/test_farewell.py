"""What `wentry process` says comes next."""

from __future__ import annotations

from pathlib import Path

import pytest

from wentry_cli.cli.flow import Flow
from wentry_cli.cli.process import _farewell


@pytest.mark.parametrize("until", [None, "kinematics"])
def test_all_stages_lead_to_fit(until: str | None) -> None:
    assert _farewell(Flow(Path("r"), until=until), 2, Path("v")) == "2 drops measured; next: wentry fit r"


def test_a_stage_in_between_leads_to_the_rest() -> None:
    told = _farewell(Flow(Path("r"), until="track"), 1, Path("v"))
    assert told == "1 drop: done as far as track; next: wentry process v -o r"
