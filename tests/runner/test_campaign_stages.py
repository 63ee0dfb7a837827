"""Scaling and report: what makes them stale and why, what a failure leaves, which drops take part."""

from __future__ import annotations

import json
import sys
import types
from dataclasses import replace
from pathlib import Path

import pytest

from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.errors import InputError, WentryError
from wentry_cli.pipeline import CAMPAIGN_STAGES, campaign_stages_of, stages_of
from wentry_cli.provenance import digest_of_file
from wentry_cli.runner import commands
from wentry_cli.runner import plan as plan_module
from wentry_cli.runner.campaign_stages import Members, plan_campaign, run_campaign_stages
from wentry_cli.runner.drop import Event
from wentry_cli.runner.plan import Choice
from wentry_cli.runner.record import note_stage, write_drop, write_run
from wentry_cli.tables import has_table, new_table, read_table, write_table

EXPERIMENT = """\
kind: water_entry
sphere: {diameter_m: 0.051, density_kg_m3: 1070, material: rigid}
views:
  side: {source: side, fps: 2000}
"""
STAGES = list(CAMPAIGN_STAGES)
NOTHING = "nothing that it reads has changed"


@pytest.fixture
def members(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Members:
    """Two drops with a summary each; the report is a stand-in that writes one page and one figure."""
    results, drops = tmp_path / "results", []
    for name in ("a", "b"):
        folder = tmp_path / "videos" / name
        (folder / "side").mkdir(parents=True)
        (folder / "side" / "side_1.png").write_bytes(b"frame")
        (folder / "experiment.yaml").write_text(EXPERIMENT)
        drops.append(read_drop(name, folder))
        write_drop(results, drops[-1])
        _summarise(results, name, 3.0)
    write_run(results, "run", {}, set())
    module = types.ModuleType("report")

    def run(results: Path, drops: list[Drop]) -> None:
        (results / "report.html").write_text(" ".join(drop.name for drop in drops))
        (results / "report.pdf").write_bytes(b"%PDF")
        (results / "figures").mkdir(exist_ok=True)
        (results / "figures" / "one.svg").write_text("<svg/>")

    module.run = run  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "wentry_cli.stages.report", module)
    plan_module.identity.cache_clear()
    return Members(results, drops)


def _summarise(results: Path, name: str, speed: float) -> None:
    write_table(results / name, "summary", new_table("summary", {"drop": [name], "impact_speed_m_s": [speed]}))


def _run(members: Members, choice: Choice | None = None) -> list[Event]:
    events: list[Event] = []
    run_campaign_stages(members, STAGES, choice or Choice(), events.append)
    return events


def _reasons(members: Members, choice: Choice | None = None) -> dict[str, tuple[str, str]]:
    plan_module.identity.cache_clear()
    return {step.stage.name: (step.action, step.reason) for step in plan_campaign(members, STAGES, choice or Choice())}


def test_a_second_run_does_nothing(members: Members) -> None:
    assert _reasons(members) == {"scaling": ("run", "not run yet"), "report": ("run", "scaling runs before it")}
    assert [event.what for event in _run(members)] == ["start", "done", "start", "done"]
    assert [event.what for event in _run(members)] == ["fresh", "fresh"]
    assert _reasons(members) == {"scaling": ("fresh", NOTHING), "report": ("fresh", NOTHING)}
    assert _reasons(members, Choice(force="report"))["report"] == ("run", "forced")
    assert {action for action, _ in _reasons(members, Choice(force="all")).values()} == {"run"}


def test_each_thing_that_is_read_makes_it_stale_by_name(members: Members) -> None:
    _run(members)
    _summarise(members.results, "b", 4.0)
    assert _reasons(members)["scaling"] == ("run", "b/summary.csv changed")
    _run(members)
    write_table(members.results / "a", "side", new_table("side", {"frame": [0]}))
    assert _reasons(members) == {"scaling": ("fresh", NOTHING), "report": ("run", "a/side.csv changed")}
    _run(members)
    (members.drops[0].folder / "side" / "side_1.png").write_bytes(b"another")
    assert _reasons(members)["report"] == ("run", "recording side of a changed")
    (members.drops[0].folder / "side" / "side_1.png").unlink()
    assert _reasons(members)["report"] == ("run", "recording side of a changed"), "a recording that is gone stops none"
    _run(members)
    experiment = members.drops[1].experiment.model_copy(update={"condition": "other"})
    other = replace(members, drops=[members.drops[0], replace(members.drops[1], experiment=experiment)])
    assert _reasons(other)["report"] == ("run", "configuration of b changed")
    write_run(members.results, "run", {"c": {"stage": "track", "exit_code": 4, "sentence": "gone"}}, set())
    assert _reasons(members)["report"] == ("run", "list of failures changed")


def test_a_table_that_was_edited_is_noted_and_the_report_stale(members: Members) -> None:
    digest = digest_of_file(members.results / "a" / "summary.csv")
    note_stage(members.results / "a", "summary", {"outputs": {"summary": digest}})
    _run(members)
    _summarise(members.results, "a", 4.0)
    edited = replace(members)
    assert edited.notes == [["a", "summary", "summary.csv is not as this stage wrote it; it is shown as it is"]]
    _run(edited)
    assert _reasons(edited)["report"][0] == "fresh"
    note_stage(members.results / "a", "summary", {})
    assert _reasons(replace(members))["report"] == ("run", "list of notes changed")


def test_a_drop_that_failed_before_and_is_mended_takes_part(members: Members, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = {"stage": "configuration", "exit_code": 3, "sentence": "wrong"}
    write_run(members.results, "run", {"b": wrong}, set())
    monkeypatch.setattr("wentry_cli.runner.processed.stages_of", lambda *_: [])
    monkeypatch.setattr(commands, "run_campaign", lambda *_: [])
    order = commands.Order("run", Choice(until="scaling"))
    commands.work(commands.Campaign(members.drops), members.results, order, lambda _: None)
    assert read_table(members.results, "summary")["drop"].tolist() == ["a", "b"]


def test_the_command_alone_makes_nothing_stale(members: Members) -> None:
    _run(members)
    write_run(members.results, "fit", {}, set())
    assert _reasons(members)["report"][0] == "fresh"


@pytest.mark.parametrize("name", ["report.html", "report.pdf", "figures/one.svg", "scaling.csv"])
def test_what_was_written_is_looked_after(members: Members, name: str) -> None:
    _run(members)
    (members.results / name).unlink()
    stage = "scaling" if name == "scaling.csv" else "report"
    assert _reasons(members)[stage] == ("run", f"{name} was changed or removed")


def test_a_failed_drop_takes_no_part_but_is_shown(members: Members) -> None:
    _run(members)
    without = replace(members, failed=frozenset({"a"}))
    assert _reasons(without)["scaling"] == ("run", "list of drops changed")
    _run(without)
    assert read_table(members.results, "summary")["drop"].tolist() == ["b"]
    assert (members.results / "report.html").read_text() == "a b"
    _run(replace(members, failed=frozenset({"a", "b"})))
    assert not has_table(members.results, "summary"), "no table outlives its inputs"
    assert _reasons(replace(members, failed=frozenset({"a", "b"})))["scaling"] == (
        "not_needed",
        "no drop that has a summary is complete",
    )


def test_a_failure_is_kept_and_tried_again(members: Members, monkeypatch: pytest.MonkeyPatch) -> None:
    _run(members)

    def full(*_: object) -> None:
        raise InputError("report.html: cannot be written")

    def bug(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(sys.modules["wentry_cli.stages.report"], "run", full)
    with pytest.raises(InputError):
        _run(members, Choice(force="report"))
    assert _reasons(members)["report"] == ("run", "failed last time")
    monkeypatch.setattr(sys.modules["wentry_cli.stages.report"], "run", bug)
    with pytest.raises(WentryError, match="ZeroDivisionError in stage report: a mistake in wentry") as caught:
        _run(members)
    assert caught.value.exit_code == 1
    assert "ZeroDivisionError" in (members.results / "error.log").read_text()


def test_an_interrupted_one_is_not_fresh(members: Members, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["wentry_cli.stages.report"], "run", interrupt)
    with pytest.raises(KeyboardInterrupt):
        _run(members)
    assert _reasons(members) == {"scaling": ("fresh", NOTHING), "report": ("run", "interrupted last time")}


def test_the_record_of_the_run_holds_them(members: Members) -> None:
    _run(members)
    write_run(members.results, None, {}, set())
    told = json.loads((members.results / "run.json").read_text())
    assert told["command"] == "run"
    assert {name: set(entry) >= {"seconds", "peak_memory_mb"} for name, entry in told["stages"].items()} == {
        "scaling": True,
        "report": True,
    }


def test_until_ends_what_several_commands_do() -> None:
    everything = ("process", "fit", "report")
    assert [stage.name for stage in stages_of(*everything, until="track")] == ["ingest", "track"]
    assert campaign_stages_of(*everything, until="track") == []
    assert [stage.name for stage in campaign_stages_of(*everything, until="scaling")] == ["scaling"]
    assert [stage.name for stage in campaign_stages_of(*everything)] == ["scaling", "report"]
