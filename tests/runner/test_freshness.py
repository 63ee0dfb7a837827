"""What runs again and why; what a failure leaves behind; locks; corrections."""

from __future__ import annotations

import logging
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.runner.conftest import EXPERIMENT
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.config.corrections import read_corrections
from wentry_cli.doubts import puts_in_doubt
from wentry_cli.errors import InputError, LockedError, TooFewMeasurementsError
from wentry_cli.pipeline import STAGES, Stage
from wentry_cli.records import read_json
from wentry_cli.runner import plan as plan_module
from wentry_cli.runner.commands import processed
from wentry_cli.runner.corrections import apply_corrections
from wentry_cli.runner.drop import Event, run_drop
from wentry_cli.runner.lock import locked
from wentry_cli.runner.plan import Choice, plan
from wentry_cli.runner.record import write_drop, write_run
from wentry_cli.runner.status import campaign_status
from wentry_cli.runner.today import to_fit
from wentry_cli.tables import has_table, new_table, read_table, write_table

ALL = Choice()
TWO = [stage for stage in STAGES if stage.name in ("ingest", "track")]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results"


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Stand-ins for two stages that write one table each, and the list of those that ran."""
    names: list[str] = []

    def stand_in(stage: str, table: str) -> Callable[[Path, Drop], None]:
        def run(folder: Path, drop: Drop) -> None:
            names.append(stage)
            rate = drop.view("side").fps
            write_table(folder, table, new_table(table, {"view": ["side"], _NUMBER[table]: [rate]}))

        return run

    for stage, table in (("ingest", "frames"), ("track", "geometry")):
        module = types.ModuleType(stage)
        module.run = stand_in(stage, table)  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, f"wentry_cli.stages.{stage}", module)
    identity = types.ModuleType("identity")
    identity.recording_identity = lambda path: f"sampled:{path}"  # type: ignore[attr-defined]
    identity.recording_content = lambda path: f"content:{path}"  # type: ignore[attr-defined]
    identity.recording_files = lambda path: [path]  # type: ignore[attr-defined]
    identity.recording_bytes = lambda path: f"full:{path}"  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "wentry_cli.frames.identity", identity)
    plan_module.identity.cache_clear()
    return names


_NUMBER = {"frames": "mean_level", "geometry": "fps"}


def _run(results: Path, drop: Drop, choice: Choice = ALL, stages: list[Stage] = TWO) -> list[Event]:
    events: list[Event] = []
    run_drop(results, drop, stages, choice, events.append)
    return events


def test_a_second_run_does_nothing(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    assert ran == ["ingest", "track"]
    events = _run(results, drop)
    assert ran == ["ingest", "track"]
    assert [event.what for event in events] == ["fresh", "fresh"]


def test_a_changed_table_makes_its_stage_and_what_follows_stale(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    path = results / "video" / "frames.csv"
    path.write_text(path.read_text().replace("2000", "2001"))
    steps = plan(results, drop, TWO, Choice())
    assert [(step.action, step.reason) for step in steps] == [
        ("run", "frames.csv was changed or removed"),
        ("run", "ingest runs before it"),
    ]


def test_a_touched_but_equal_table_stays_fresh(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    path = results / "video" / "frames.csv"
    path.write_text(path.read_text())
    assert {step.action for step in plan(results, drop, TWO, Choice())} == {"fresh"}


def test_only_its_own_part_of_the_configuration_counts(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    analysis = drop.experiment.analysis.model_copy(update={"tracking": "fast"})
    changed = replace(drop, experiment=drop.experiment.model_copy(update={"analysis": analysis}))
    steps = plan(results, changed, TWO, Choice())
    assert [step.action for step in steps] == ["fresh", "run"]
    assert steps[1].reason == "configuration analysis.tracking changed"
    smoother = drop.experiment.analysis.model_copy(update={"smoother": "gcv"})
    for update in ({"condition": "other"}, {"analysis": smoother}):
        unrelated = replace(drop, experiment=drop.experiment.model_copy(update=update))
        assert {step.action for step in plan(results, unrelated, TWO, Choice())} == {"fresh"}


def test_a_recording_that_vanished_fails_its_drop_only(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _run(results, drop)

    def gone(path: Path) -> str:
        raise InputError(f"{path}: no such file")

    monkeypatch.setattr(sys.modules["wentry_cli.frames.identity"], "recording_identity", gone)
    plan_module.identity.cache_clear()
    failure = run_drop(results, drop, TWO, Choice(), lambda event: None)
    assert failure is not None
    assert (failure.exit_code, failure.stage) == (4, "ingest")


def test_what_was_verified_is_known_again_without(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop, Choice(verify=True))
    assert {step.action for step in plan(results, drop, TWO, Choice())} == {"fresh"}
    assert {step.action for step in plan(results, drop, TWO, Choice(verify=True))} == {"fresh"}


def test_what_was_only_sampled_is_not_taken_for_verified(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    assert {step.action for step in plan(results, drop, TWO, Choice(verify=True))} == {"run"}


def test_a_recording_of_other_bytes_is_not_the_verified_one(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _run(results, drop, Choice(verify=True))
    monkeypatch.setattr(sys.modules["wentry_cli.frames.identity"], "recording_bytes", lambda path: "full:other")
    plan_module.identity.cache_clear()
    assert {step.action for step in plan(results, drop, TWO, Choice())} == {"fresh"}
    assert {step.action for step in plan(results, drop, TWO, Choice(verify=True))} == {"run"}


def test_a_file_in_the_place_of_the_drops_folder(results: Path, drop: Drop, ran: list[str]) -> None:
    results.mkdir()
    (results / "video").touch()
    failure = run_drop(results, drop, TWO, Choice(), lambda event: None)
    assert failure is not None
    assert "is a file" in failure.sentence


def test_fit_refuses_what_was_not_measured(results: Path, drop: Drop, ran: list[str]) -> None:
    write_drop(results, drop)
    (failure,) = processed(results).failures
    assert "has not run" in failure.sentence
    write_run(results, "process", {"video": {"stage": "configuration", "exit_code": 3, "sentence": "wrong"}}, {"video"})
    (failure,) = processed(results).failures
    assert (failure.exit_code, failure.sentence) == (3, "wrong")
    assert "video" in write_run(results, "fit", {}, set())["failures"], "a failure that was not tried again stays"
    assert write_run(results, "process", {}, {"video"})["failures"] == {}


@pytest.mark.parametrize("edit", ["table", "version", "recording", "none"])
def test_fit_refuses_keys_that_changed_whatever_else_did(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch, edit: str
) -> None:
    """Its own stages read the keys of today, and would mix them with tables of those before."""
    monkeypatch.setattr("wentry_cli.runner.processed.stages_of", lambda *_: TWO)
    monkeypatch.setattr("wentry_cli.runner.today.stages_of", lambda *_: TWO)
    _run(results, drop)
    assert to_fit(results).failures == []
    experiment = drop.folder / "experiment.yaml"
    experiment.write_text(EXPERIMENT.replace("0.051", "0.0509"))
    if edit == "table":
        path = results / "video" / "geometry.csv"
        path.write_text(path.read_text().replace("2000", "2001"))
    elif edit == "version":
        monkeypatch.setattr(plan_module, "__version__", "another")
    elif edit == "recording":
        (drop.folder / "side").rmdir()
    with pytest.raises(
        InputError, match=r"video: configuration sphere\.diameter_m changed since track was done; run `"
    ):
        to_fit(results)
    experiment.write_text(EXPERIMENT)
    assert to_fit(results).failures == []


def test_status_tells_what_the_plan_would_do(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop)
    (results / "video" / "frames.csv").unlink()
    states = campaign_status(results)["video"]
    assert states["ingest"] == ("stale", "frames.csv was changed or removed")
    assert states["track"] == ("stale", "ingest runs before it")
    assert states["stretch"][0] == "not needed"


def test_a_table_that_was_removed_leaves_what_is_over_all_drops_stale(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = next(stage for stage in STAGES if stage.name == "summary")
    module = types.ModuleType("summary")
    module.run = lambda folder, _: write_table(folder, "summary", new_table("summary", {"drop": ["video"]}))  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "wentry_cli.stages.summary", module)
    three = [*TWO, summary]
    monkeypatch.setattr("wentry_cli.runner.status.ALL_STAGES", three)
    monkeypatch.setattr("wentry_cli.runner.processed.stages_of", lambda *_: three)
    _run(results, drop, stages=three)
    assert campaign_status(results)["*"]["scaling"] == ("stale", "not run yet")
    (results / "video" / "geometry.csv").unlink()
    states = campaign_status(results)
    assert states["video"]["summary"] == ("stale", "track runs before it")
    assert states["*"]["scaling"] == ("stale", "summary of video runs before it")


def test_warnings_stay_with_what_was_done(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    good, said = sys.modules["wentry_cli.stages.ingest"].run, ["video: the fall is odd", "video: the fall is odd", "x"]

    def doubtful(folder: Path, drop: Drop) -> None:
        good(folder, drop)
        for sentence in said:
            extra = puts_in_doubt("fall") if "odd" in sentence else None
            logging.getLogger("wentry_cli.stages.ingest").warning("%s", sentence, extra=extra)

    monkeypatch.setattr(sys.modules["wentry_cli.stages.ingest"], "run", doubtful)
    _run(results, drop)
    record = read_json(results / "video" / "stages.json")
    assert (record["ingest"]["warnings"], record["track"]["warnings"]) == (["the fall is odd", "x"], [])
    assert (record["ingest"]["doubts"], record["track"]["doubts"]) == (["fall"], [])
    _run(results, drop)
    assert campaign_status(results)["video"]["ingest"] == ("fresh", "warning: the fall is odd; warning: x")
    said.clear()
    _run(results, drop, Choice(force="ingest"))
    assert campaign_status(results)["video"]["ingest"] == ("fresh", "")


def test_force_and_until(results: Path, drop: Drop, ran: list[str]) -> None:
    _run(results, drop, Choice(until="ingest"))
    assert ran == ["ingest"]
    _run(results, drop, Choice(force="ingest"))
    assert ran == ["ingest", "ingest", "track"]
    _run(results, drop, Choice(force="track"))
    assert ran[3:] == ["track"]


def test_a_failed_stage_leaves_no_table_and_runs_again(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _run(results, drop)
    good = sys.modules["wentry_cli.stages.ingest"].run

    def broken(folder: Path, drop: Drop) -> None:
        good(folder, drop)
        raise InputError("side: cannot be read")

    monkeypatch.setattr(sys.modules["wentry_cli.stages.ingest"], "run", broken)
    failure = run_drop(results, drop, TWO, Choice(force="ingest"), lambda event: None)
    assert failure is not None
    assert (failure.exit_code, failure.stage) == (4, "ingest")
    assert not has_table(results / "video", "frames")
    assert not has_table(results / "video", "geometry"), "no table outlives its inputs"
    assert plan(results, drop, TWO, Choice())[0].reason == "failed last time"


def test_too_few_measurements_keep_their_tables(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    good = sys.modules["wentry_cli.stages.track"].run

    def too_few(folder: Path, drop: Drop) -> None:
        good(folder, drop)
        raise TooFewMeasurementsError("3 of 12 frames")

    monkeypatch.setattr(sys.modules["wentry_cli.stages.track"], "run", too_few)
    failure = run_drop(results, drop, TWO, Choice(), lambda event: None)
    assert failure is not None
    assert failure.exit_code == 5
    assert has_table(results / "video", "geometry")


def test_a_stage_that_is_no_longer_needed_leaves_nothing(results: Path, drop: Drop, ran: list[str]) -> None:
    soft = next(stage for stage in STAGES if stage.name == "stretch")
    write_table(results / "video", "stretch", new_table("stretch", {"frame": [1]}))
    events = _run(results, drop, stages=[soft])
    assert [(event.what, event.text) for event in events] == [("not_needed", "a rigid sphere does not stretch")]
    assert not has_table(results / "video", "stretch")


def test_leftovers_of_a_killed_run_are_swept(results: Path, drop: Drop, ran: list[str]) -> None:
    (results / "video").mkdir(parents=True)
    leftover = results / "video" / ".side.csv.abc.part"
    leftover.touch()
    _run(results, drop)
    assert not leftover.exists()


def test_two_writers_exclude_each_other(results: Path) -> None:
    with locked(results), pytest.raises(LockedError, match="another wentry"), locked(results):
        pass
    with locked(results):
        pass


@pytest.mark.parametrize(
    ("experiment", "needed"),
    [
        (("kind: water_entry", "kind: water_entry"), {"ingest", "track", "cavity", "kinematics", "summary"}),
        (("kind: water_entry", "kind: free_flight"), {"ingest", "track", "kinematics", "summary"}),
        (("rigid", "dragonskin_6p70_small"), {stage.name for stage in STAGES}),
        ((", material: rigid", ""), {stage.name for stage in STAGES} - {"model"}),
    ],
)
def test_the_scene_decides_the_work(drop: Drop, experiment: tuple[str, str], needed: set[str]) -> None:
    (drop.folder / "experiment.yaml").write_text(EXPERIMENT.replace(*experiment))
    today = read_drop("video", drop.folder)
    assert {stage.name for stage in STAGES if stage.why_not(today) is None} == needed


def test_top_only_and_surface_impact(drop: Drop) -> None:
    soft = EXPERIMENT.replace("rigid", "dragonskin_6p70_small")
    (drop.folder / "experiment.yaml").write_text(soft.replace("side: {", "top: {"))
    top = read_drop("video", drop.folder)
    assert {s.name for s in STAGES if s.why_not(top) is None} == {"ingest", "track", "stretch", "summary"}
    (drop.folder / "experiment.yaml").write_text(soft.replace("water_entry", "surface_impact"))
    plate = read_drop("video", drop.folder)
    assert {s.name for s in STAGES if s.why_not(plate) is None} == {"ingest", "track", "stretch", "model", "summary"}


def test_corrections_by_hand(results: Path, drop: Drop) -> None:
    track = next(stage for stage in STAGES if stage.name == "track")
    cavity = next(stage for stage in STAGES if stage.name == "cavity")
    (drop.folder / "corrections.yaml").write_text(
        "frames:\n- {view: side, frames: [1, 1], y_b_m: -0.5}\n- {view: side, frames: [2, 2], exclude: true}\n"
        "events:\n- {event: impact, time_s: 0.5}\n- {event: pinch_off, t_s: 0.08, value: deep_seal}\n"
    )
    side = new_table("side", {"frame": [0, 1, 2], "t_s": [0.0, 0.1, 0.2], "y_b_m": 1.0, "status": "ok"})
    write_table(results, "side", side)
    write_table(results, "geometry", new_table("geometry", {"view": ["side"], "impact_time_s": [0.4]}))
    write_table(results, "events", new_table("events", {"event": ["pinch_off"], "index": [1], "status": ["no_neck"]}))
    drop = replace(drop, corrections=read_corrections(drop.folder, drop.experiment))
    with pytest.raises(TooFewMeasurementsError, match="leaves only 2 frames of video, 12 are needed"):
        apply_corrections(results, track, drop)
    apply_corrections(results, cavity, drop)
    corrected = read_table(results, "side")
    assert corrected["t_s"].round(9).tolist() == [-0.1, 0.0, 0.1]
    assert corrected["y_b_m"].tolist()[:2] == [1.0, -0.5]
    assert corrected["y_b_m"].isna().tolist() == [False, False, True]
    assert corrected["status"].tolist() == ["ok", "manual", "manual"]
    assert corrected["y_b_m_unc"].isna().tolist() == [True, True, True]  # of a pixel nobody knows the size
    events = read_table(results, "events")
    assert events[["t_s", "value", "status"]].values.tolist() == [[0.08, "deep_seal", "manual"]]


def test_a_bug_is_kept_and_ends_only_its_drop(
    results: Path, drop: Drop, ran: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def bug(folder: Path, drop: Drop) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(sys.modules["wentry_cli.stages.track"], "run", bug)
    failure = run_drop(results, drop, TWO, Choice(), lambda event: None)
    assert failure is not None
    assert failure.exit_code == 1
    assert "ZeroDivisionError" in (results / "video" / "error.log").read_text()
    assert plan(results, drop, TWO, Choice())[1].action == "run"
