"""Run the stages of one drop: skip what is fresh, isolate what fails, record what was done."""

from __future__ import annotations

import importlib
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wentry_cli import progress
from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError, TooFewMeasurementsError, WentryError
from wentry_cli.frames.decoded import decoded_once
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.pipeline import Stage
from wentry_cli.provenance import digest_of_file, peak_memory_mb
from wentry_cli.records import ERROR_LOG, read_stages
from wentry_cli.runner.corrections import apply_corrections
from wentry_cli.runner.edited import edited_tables
from wentry_cli.runner.hearing import hear_warnings
from wentry_cli.runner.in_clip import check_before
from wentry_cli.runner.plan import INTERRUPTED, Choice, as_read_by, fingerprint, plan
from wentry_cli.runner.record import note_stage, write_drop
from wentry_cli.tables import table_path, write_text


@dataclass(frozen=True)
class Event:
    """What happened: ``what`` is ``start``, ``tick``, ``done``, ``fresh``, ``not_needed`` or ``failed``."""

    drop: str
    stage: str
    what: str
    text: str = ""
    done: int = 0
    total: int = 0


Report = Callable[[Event], None]


@dataclass(frozen=True)
class Failure:
    """Why a drop ended early: the stage, the exit code of its error and the sentence, without the drop's name."""

    drop: str
    stage: str
    exit_code: int
    sentence: str

    def __post_init__(self) -> None:
        """Take the drop's name off: errors have it for who calls a stage alone, a list of failures has it already."""
        object.__setattr__(self, "sentence", self.sentence.removeprefix(f"{self.drop}: "))


def run_drop(results: Path, drop: Drop, stages: list[Stage], choice: Choice, report: Report) -> Failure | None:
    """Run ``stages`` of ``drop`` into ``results``; the first failure ends the drop and is returned.

    A stage is recorded as running before it starts, so that an interrupted run is seen as such. A programmer's mistake
    ends the drop too; its traceback is kept in ``error.log`` beside the tables, and the other drops go on.
    """
    running = [stages[0].name if stages else ""]
    try:
        with decoded_once(results / drop.name):
            _run_steps(results, drop, stages, choice, report, running)
    except WentryError as error:
        failure = Failure(drop.name, running[0], error.exit_code, str(error))
    except Exception as bug:
        failure = _failure_of(bug, results / drop.name, running[0])
    else:
        return None
    report(Event(drop.name, failure.stage, "failed", failure.sentence))
    return failure


def _run_steps(
    results: Path, drop: Drop, stages: list[Stage], choice: Choice, report: Report, running: list[str]
) -> None:
    folder = results / drop.name
    sweep(folder)
    write_drop(results, drop)
    for step in plan(results, drop, stages, choice):
        stage = step.stage
        running[0] = stage.name
        if step.action == "run":
            report(Event(drop.name, stage.name, "start", step.reason))
            seconds = _run_stage(folder, as_read_by(stage, drop, results), stage, choice.verify, report)
            report(Event(drop.name, stage.name, "done", f"{seconds:.1f} s"))
            continue
        if step.action == "not_needed":
            _forget(folder, stage)
        report(Event(drop.name, stage.name, step.action, step.reason))


def _failure_of(bug: Exception, folder: Path, stage: str) -> Failure:
    """What is said of an error that nobody foresaw: a table that was edited explains it, else it is our mistake."""
    sentence = keep_traceback(folder, stage, bug)
    edited = edited_tables(folder)
    read = next((s.reads for s in ALL_STAGES if s.name == stage), ())
    for name in read:
        if name in edited:
            path, maker = table_path(folder, name), edited[name]
            sentence = f"{path}: not as the stage {maker} wrote it, and {stage} cannot use it; run {maker} again"
            return Failure(folder.name, stage, InputError.exit_code, sentence)
    return Failure(folder.name, stage, 1, sentence)


def keep_traceback(folder: Path, stage: str, bug: Exception) -> str:
    """Write the traceback of ``bug`` to ``error.log`` in ``folder``; the sentence for the user."""
    sentence = f"{type(bug).__name__} in stage {stage}: a mistake in wentry; please report it"
    log = folder / ERROR_LOG
    try:
        write_text(log, "".join(traceback.format_exception(bug)))
    except WentryError as full:
        return f"{sentence} ({full})"
    return f"{sentence} with {log}"


def sweep(folder: Path) -> None:
    """Remove what a killed or broken run left behind; raises ``InputError`` where the folder cannot be one."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file, but the drop's tables belong into a folder of that name; move it away")
    (folder / ERROR_LOG).unlink(missing_ok=True)
    for leftover in folder.glob(".*.part"):
        leftover.unlink(missing_ok=True)


def _run_stage(folder: Path, drop: Drop, stage: Stage, verify: bool, report: Report) -> float:
    run = importlib.import_module(f"wentry_cli.stages.{stage.name}").run
    _forget(folder, stage)
    marks = fingerprint(folder, drop, stage, verify=verify)
    note_stage(folder, stage.name, {"error": INTERRUPTED})
    progress.listen(lambda done, total: report(Event(drop.name, stage.name, "tick", "", done, total)))
    started = time.perf_counter()
    with hear_warnings(drop.name) as heard:

        def note(error: WentryError | None) -> float:
            seconds = time.perf_counter() - started
            told = {"seconds": round(seconds, 3), "warnings": heard.warnings, "doubts": heard.doubts}
            note_stage(folder, stage.name, _entry(folder, stage, marks, error) | told)
            return seconds

        try:
            check_before(folder, stage, drop)
            run(folder, drop)
            apply_corrections(folder, stage, drop)
        except TooFewMeasurementsError as few:
            note(few)
            _forget_later(folder, stage)
            raise
        except Exception as failed:
            _remove_tables(folder, stage)
            bug = WentryError(f"{type(failed).__name__}, see {ERROR_LOG}")
            note(failed if isinstance(failed, WentryError) else bug)
            _forget_later(folder, stage)
            raise
        finally:
            progress.listen(None)
        return note(None)


def _entry(folder: Path, stage: Stage, marks: dict[str, Any], error: WentryError | None) -> dict[str, Any]:
    written = {name: digest_of_file(table_path(folder, name)) for name in stage.writes}
    entry: dict[str, Any] = {
        "fingerprint": marks,
        "outputs": {name: digest for name, digest in written.items() if digest},
        "peak_memory_mb": peak_memory_mb(),
    }
    if error is not None:
        entry |= {"error": str(error), "exit_code": error.exit_code}
    return entry


def _forget(folder: Path, stage: Stage) -> None:
    """Remove what an earlier run of ``stage`` left, so that no table outlives its inputs."""
    _remove_tables(folder, stage)
    if stage.name in read_stages(folder):
        note_stage(folder, stage.name, None)


def _remove_tables(folder: Path, stage: Stage) -> None:
    for name in stage.writes:
        table_path(folder, name).unlink(missing_ok=True)


def _forget_later(folder: Path, failed: Stage) -> None:
    names = [stage.name for stage in ALL_STAGES]
    for stage in ALL_STAGES[names.index(failed.name) + 1 :]:
        _forget(folder, stage)
