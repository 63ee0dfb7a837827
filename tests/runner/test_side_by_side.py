"""Drops in processes beside each other: a process takes the next drop, and one that breaks down takes none with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from wentry_cli.config.campaign import Drop
from wentry_cli.pipeline import STAGES
from wentry_cli.runner import campaign
from wentry_cli.runner.campaign import Hands, run_campaign
from wentry_cli.runner.drop import Event
from wentry_cli.runner.work import Work


class Unreadable(Drop):
    """A drop that no process can read."""

    def record(self) -> dict[str, Any]:
        return {}


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    names: list[str] = []
    start = campaign._start

    def counted(work: Work, drop: Drop) -> Any:
        names.append(drop.name)
        return start(work, drop)

    monkeypatch.setattr(campaign, "_start", counted)
    return names


def test_two_processes_do_five_drops_and_outlive_one_that_cannot_be_read(
    drop: Drop, tmp_path: Path, started: list[str]
) -> None:
    drops = [replace(drop, name=f"d{number}") for number in range(4)]
    broken = Unreadable(**vars(replace(drop, name="broken")))
    events: list[Event] = []
    ingest = [stage for stage in STAGES if stage.name == "ingest"]
    failures = run_campaign(Work(tmp_path, ingest), [drops[0], broken, *drops[1:]], Hands(2), events.append)
    told = {failure.drop: failure.sentence for failure in failures}
    assert list(told) == ["d0", "broken", "d1", "d2", "d3"]
    assert "ended with code 1" in told.pop("broken")
    assert all("side" in sentence for sentence in told.values())  # their folder of frames is empty
    # two to begin with, and one in place of that which broke down, unless the other has done the rest before
    assert 2 <= len(started) <= 3


def test_a_process_whose_parent_was_killed_ends_without_a_word(
    drop: Drop, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ingest = [stage for stage in STAGES if stage.name == "ingest"]
    pipe, worker = campaign._start(Work(tmp_path, ingest), drop)
    pipe.close()
    worker.process.join(60)
    assert worker.process.exitcode == 1
    assert capfd.readouterr().err == ""
    assert not list(tmp_path.rglob("error.log"))
