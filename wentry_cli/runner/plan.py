"""What must run and why: a stage is fresh only if nothing that it reads has changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from wentry_cli import __version__
from wentry_cli.config.campaign import Drop
from wentry_cli.pipeline import CampaignStage, Stage
from wentry_cli.provenance import digest_of, digest_of_file
from wentry_cli.records import read_stages
from wentry_cli.tables import table_path

S = TypeVar("S", Stage, CampaignStage)
CORRECTED = ("track", "cavity")
INTERRUPTED = "interrupted"  # in the place of an error while a stage runs
UNCHANGED = "nothing that it reads has changed"


@dataclass(frozen=True)
class Choice:
    """How the run goes: ``force`` is a stage name, ``all`` or ``None``; ``until`` the last stage to run."""

    force: str | None = None
    until: str | None = None
    verify: bool = False


@dataclass(frozen=True)
class Step(Generic[S]):
    """One stage of a drop or the campaign: ``action`` is ``run``, ``fresh`` or ``not_needed``; ``reason`` says why."""

    stage: S
    action: str
    reason: str


def as_read_by(stage: Stage, drop: Drop, results: Path) -> Drop:
    """``drop`` as ``stage`` sees it: a calibration in ``results`` counts for the stages of ``fit``."""
    return drop.with_calibration(results) if stage.command == "fit" else drop


def plan(results: Path, drop: Drop, stages: list[Stage], choice: Choice) -> list[Step[Stage]]:
    """The steps for ``drop``, in order. A stage downstream of one that runs runs too, if it reads what that writes."""
    folder = results / drop.name
    record = read_stages(folder)
    steps: list[Step[Stage]] = []
    changing: dict[str, str] = {}
    for stage in stages:
        step = _step(folder, as_read_by(stage, drop, results), stage, record, changing, choice)
        if step.action == "run":
            changing |= dict.fromkeys(stage.writes, stage.name)
        steps.append(step)
        if stage.name == choice.until:
            break
    return steps


def _step(
    folder: Path, drop: Drop, stage: Stage, record: dict[str, Any], changing: dict[str, str], choice: Choice
) -> Step[Stage]:
    why_not = stage.why_not(drop)
    if why_not is not None:
        return Step(stage, "not_needed", why_not)
    if choice.force in ("all", stage.name):
        return Step(stage, "run", "forced")
    above = next((changing[name] for name in stage.reads if name in changing), None)
    if above is not None:
        return Step(stage, "run", f"{above} runs before it")
    reason = why_stale(folder, drop, stage, record, verify=choice.verify)
    return Step(stage, "run" if reason else "fresh", reason or UNCHANGED)


def why_stale(folder: Path, drop: Drop, stage: Stage, record: dict[str, Any], *, verify: bool = False) -> str | None:
    """Why ``stage`` must run again, or ``None`` where its tables are those of today's inputs."""
    known: Any = record.get(stage.name)
    if (reason := not_complete(known)) is not None:
        return reason
    for name, digest in known.get("outputs", {}).items():
        if digest_of_file(table_path(folder, name)) != digest:
            return f"{name}.csv was changed or removed"
    before = known["fingerprint"]
    return first_change(before, fingerprint(folder, drop, stage, before, verify=verify))


def not_complete(known: Any) -> str | None:
    """Why what is recorded of a stage is no result, or ``None`` where it is one."""
    if isinstance(known, dict) and known.get("error"):
        return "interrupted last time" if known["error"] == INTERRUPTED else "failed last time"
    return None if isinstance(known, dict) and "fingerprint" in known else "not run yet"


def first_change(before: dict[str, Any], today: dict[str, Any]) -> str | None:
    """The first mark that is not what it was; ``None`` where all are."""
    return next((f"{what} changed" for what in {**today, **before} if before.get(what) != today.get(what)), None)


def fingerprint(
    folder: Path, drop: Drop, stage: Stage, before: Mapping[str, Any] | None = None, *, verify: bool = False
) -> dict[str, Any]:
    """Everything that the result of ``stage`` depends on, by a name that a reader understands.

    A recording that is still that of the fingerprint ``before`` keeps its mark.
    """
    marks: dict[str, Any] = {"version": __version__, **_by_hand(drop, stage)}
    for name in stage.reads:
        marks[f"{name}.csv"] = digest_of_file(table_path(folder, name))
    if stage.frames:
        for view in drop.experiment.sides:
            mark = f"recording {view}"
            marks[mark] = identity(drop.existing_source(view), verify, str((before or {}).get(mark, "")))
    return marks


def _by_hand(drop: Drop, stage: Stage) -> dict[str, Any]:
    marks: dict[str, Any] = {}
    for key in stage.keys:
        marks[key if key.startswith("material") else f"configuration {key}"] = digest_of(_part(drop, key))
    if stage.name in CORRECTED:
        marks["corrections"] = digest_of(_corrections(drop, stage))
    return marks


def changed_by_hand(results: Path, drop: Drop, stages: list[Stage]) -> Step[Stage] | None:
    """The first of ``stages`` that was done with other files of the user's than those of ``drop``, and which part.

    What became of tables and recordings since then does not matter.
    """
    record = read_stages(results / drop.name)
    for stage in stages:
        known: Any = record.get(stage.name)
        if stage.why_not(drop) is not None or not_complete(known) is not None:
            continue
        marks = _by_hand(as_read_by(stage, drop, results), stage)
        before = {what: mark for what, mark in known["fingerprint"].items() if what in marks}
        reason = first_change(before, {what: marks[what] for what in before})
        if reason is not None:
            return Step(stage, "run", reason)
    return None


def _part(drop: Drop, key: str) -> Any:
    """What ``key`` stands for, as plain data; ``None`` for a part of a material that is not known."""
    part: Any = drop if key.startswith("material") else drop.experiment
    for name in key.split("."):
        part = None if part is None else getattr(part, name)
    return part.model_dump(mode="json") if isinstance(part, BaseModel) else part


def _corrections(drop: Drop, stage: Stage) -> Any:
    """What of the corrections the stage's tables hold: frames and impact, or the events."""
    given = drop.corrections.model_dump(mode="json")
    if stage.name == "cavity":
        return given["events"]
    return [given["frames"], [event for event in given["events"] if event["event"] == "impact"]]


@cache
def identity(path: Path, verify: bool, before: str = "") -> str:
    """What identifies the recording at ``path``; ``before`` where it is the one that this stood for.

    That is told by names, sizes, times and a few samples; where these differ, by what all files hold, since a copy or
    a touch changes the times alone. With ``verify`` every byte counts, and a run without it knows the recording again.
    One look at a recording serves all stages of a run.
    """
    from wentry_cli.frames.identity import recording_bytes, recording_content, recording_identity

    known = before.split()
    if verify:
        whole = recording_bytes(path)
        return before if whole in known else f"{recording_identity(path)} {recording_content(path)} {whole}"
    seen = recording_identity(path)
    if seen in known:
        return before
    content = recording_content(path)
    return before if content in known else f"{seen} {content}"
