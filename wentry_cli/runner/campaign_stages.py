"""The stages over all drops, scaling and report: what they read, whether they are fresh, and how they run."""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from wentry_cli import __version__, progress
from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError, WentryError
from wentry_cli.pipeline import CampaignStage, Stage
from wentry_cli.provenance import digest_of, digest_of_file, environment, peak_memory_mb
from wentry_cli.records import RUN, read_json, read_stages
from wentry_cli.runner.doubtful import warn_of_doubtful
from wentry_cli.runner.drop import Event, Report, keep_traceback, sweep
from wentry_cli.runner.plan import INTERRUPTED, UNCHANGED, Choice, Step, first_change, identity, not_complete
from wentry_cli.runner.record import note_stage
from wentry_cli.runner.today import notes_to_show
from wentry_cli.runner.twice import warn_of_twice
from wentry_cli.tables import has_table, table_path

ALL_DROPS = "*"  # in the place of a drop's name


@dataclass(frozen=True)
class Members:
    """The drops of a RESULTS folder that are asked for, and the names of those that failed."""

    results: Path
    drops: list[Drop]
    failed: frozenset[str] = frozenset()

    @cached_property
    def notes(self) -> list[list[str]]:
        """What a report says of tables that are not those of today's files: drop, stage and sentence."""
        return notes_to_show(self.results, self.drops, self.failed)

    def of(self, stage: CampaignStage) -> list[Drop]:
        """The drops that ``stage`` works on, by name."""
        drops = sorted(self.drops, key=lambda drop: drop.name)
        return drops if stage.shows_all else [drop for drop in drops if self._is_complete(drop, stage)]

    def why_none(self, stage: CampaignStage) -> str:
        """Why ``stage`` has no drop to work on."""
        name = stage.drop_reads[-1]
        there = any(has_table(self.results / drop.name, name) for drop in self.drops)
        return f"no drop that has a {name} is complete" if there else f"no drop has a {name} yet"

    def _is_complete(self, drop: Drop, stage: CampaignStage) -> bool:
        return drop.name not in self.failed and all(
            has_table(self.results / drop.name, name) for name in stage.drop_reads
        )


def plan_campaign(
    members: Members, stages: list[CampaignStage], choice: Choice, changing: Mapping[str, str] | None = None
) -> list[Step[CampaignStage]]:
    """The steps over all drops, in order; ``changing`` names what rewrites a table before, by file below RESULTS."""
    rewritten = dict(changing or {})
    steps = []
    for stage in stages:
        step = _step(members, stage, rewritten, choice)
        if step.action == "run":
            rewritten |= dict.fromkeys(stage.writes, stage.name)
        steps.append(step)
    return steps


def _step(members: Members, stage: CampaignStage, rewritten: Mapping[str, str], choice: Choice) -> Step[CampaignStage]:
    above = next((who for file, who in rewritten.items() if stage.uses(file)), None)
    if above is None and not members.of(stage) and not any(has_table(members.results, name) for name in stage.reads):
        return Step(stage, "not_needed", members.why_none(stage))
    if choice.force in ("all", stage.name):
        return Step(stage, "run", "forced")
    if above is not None:
        return Step(stage, "run", f"{above} runs before it")
    reason = why_stale(members, stage)
    return Step(stage, "run" if reason else "fresh", reason or UNCHANGED)


def rewritten_by(steps: Mapping[str, Iterable[Step[Stage]]]) -> dict[str, str]:
    """What the steps of the drops are going to rewrite: the stage and the drop, by file below RESULTS."""
    return {
        f"{name}/{table}.csv": f"{step.stage.name} of {name}"
        for name, own in steps.items()
        for step in own
        if step.action == "run"
        for table in step.stage.writes
    }


def why_stale(members: Members, stage: CampaignStage) -> str | None:
    """Why ``stage`` must run again, or ``None`` where what it wrote is that of today's tables."""
    known: Any = read_stages(members.results).get(stage.name)
    reason = not_complete(known)
    if reason is not None:
        return reason
    written = _written(members.results, stage)
    for name, digest in known.get("outputs", {}).items():
        if written.get(name) != digest:
            return f"{name} was changed or removed"
    return first_change(known["fingerprint"], fingerprint(members, stage, known["fingerprint"]))


def fingerprint(members: Members, stage: CampaignStage, before: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Everything that the result of ``stage`` depends on, by a name that a reader understands.

    A recording that is still that of the fingerprint ``before`` keeps its mark.
    """
    results, drops = members.results, members.of(stage)
    marks: dict[str, Any] = {"version": __version__, "list of drops": digest_of([drop.name for drop in drops])}
    for name in stage.reads:
        marks[f"{name}.csv"] = digest_of_file(table_path(results, name))
    for drop in drops:
        for name in stage.drop_reads:
            marks[f"{drop.name}/{name}.csv"] = digest_of_file(table_path(results / drop.name, name))
        if stage.shows_all:
            marks[f"configuration of {drop.name}"] = digest_of(drop.record())
            for view in drop.experiment.sides:
                mark = f"recording {view} of {drop.name}"
                marks[mark] = _identity(drop, view, str((before or {}).get(mark, "")))
    if stage.shows_all:
        marks["software beside wentry"] = digest_of(environment())
        failures = read_json(results / RUN).get("failures")
        marks["list of failures"] = digest_of([failures, *_told(results, drops, "error")])
        marks["list of warnings"] = digest_of(_told(results, drops, "warnings"))
        marks["list of notes"] = digest_of(members.notes) if members.notes else None
    return {what: mark for what, mark in marks.items() if mark is not None}


def _identity(drop: Drop, view: str, before: str) -> str | None:
    """``None`` for a recording that is gone: its tables are still there to be shown."""
    try:
        return identity(drop.source_path(view), False, before)
    except InputError:
        return None


def _told(results: Path, drops: list[Drop], what: str) -> list[Any]:
    """``what`` (``error`` or ``warnings``) the stages of each drop have left in its record."""
    records = [read_stages(results / drop.name) for drop in drops]
    return [[entry.get(what) for _, entry in sorted(one.items()) if isinstance(entry, dict)] for one in records]


def _written(results: Path, stage: CampaignStage) -> dict[str, str]:
    """Hash of each file that ``stage`` wrote, by name below RESULTS."""
    found = {}
    for pattern in stage.writes:
        for path in sorted(results.glob(pattern)):
            digest = digest_of_file(path)
            if digest is not None:
                found[path.relative_to(results).as_posix()] = digest
    return found


def run_campaign_stages(
    members: Members, stages: list[CampaignStage], choice: Choice, report: Report
) -> list[Step[CampaignStage]]:
    """Run what is stale of ``stages``; returns what was done and why.

    Raises ``WentryError`` where a stage fails; a programmer's mistake leaves its traceback in ``error.log``.
    """
    sweep(members.results)
    done = []
    for stage in stages:
        (step,) = plan_campaign(members, [stage], choice)
        if step.action == "run":
            report(Event("", stage.name, "start", step.reason))
            seconds = _run(members, stage, report)
            report(Event("", stage.name, "done", f"{seconds:.1f} s"))
        else:
            if step.action == "not_needed":
                _forget(members.results, stage)
            report(Event("", stage.name, step.action, step.reason))
        done.append(step)
    return done


def _run(members: Members, stage: CampaignStage, report: Report) -> float:
    run = importlib.import_module(f"wentry_cli.stages.{stage.name}").run
    results, marks = members.results, fingerprint(members, stage)
    note_stage(results, stage.name, {"error": INTERRUPTED})
    progress.listen(lambda done, total: report(Event("", stage.name, "tick", "", done, total)))
    started = time.perf_counter()
    try:
        run(results, members.of(stage))
    except WentryError as failed:
        note_stage(results, stage.name, {"error": str(failed), "exit_code": failed.exit_code})
        raise
    except Exception as bug:
        sentence = keep_traceback(results, stage.name, bug)
        note_stage(results, stage.name, {"error": sentence, "exit_code": WentryError.exit_code})
        raise WentryError(sentence) from bug
    finally:
        progress.listen(None)
    seconds = time.perf_counter() - started
    entry = {"fingerprint": marks, "outputs": _written(results, stage), "seconds": round(seconds, 3)}
    if not stage.shows_all:  # what counts drops says which of them are one
        twice = warn_of_twice(results, tuple(drop.name for drop in members.of(stage)))
        entry["warnings"] = [*twice, *warn_of_doubtful(results)]
    note_stage(results, stage.name, entry | {"peak_memory_mb": peak_memory_mb()})
    return seconds


def _forget(results: Path, stage: CampaignStage) -> None:
    """Remove what an earlier run of ``stage`` left, so that no table outlives its inputs."""
    known = read_stages(results).get(stage.name)
    for name in known.get("outputs", ()) if isinstance(known, dict) else ():
        (results / name).unlink(missing_ok=True)
    if known is not None:
        note_stage(results, stage.name, None)
