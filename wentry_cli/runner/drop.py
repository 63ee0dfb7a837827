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
from wentry_cli.errors import TooFewMeasurementsError, WentryError
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.pipeline import Stage
from wentry_cli.provenance import digest_of_file, peak_memory_mb
from wentry_cli.runner.corrections import apply_corrections
from wentry_cli.runner.plan import Choice, fingerprint, plan
from wentry_cli.runner.record import STAGES, read_json, write_drop, write_json
from wentry_cli.tables import table_path, write_text

ERROR_LOG = "error.log"


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
    """Why a drop ended early: the stage, the exit code of its error and the sentence."""

    drop: str
    stage: str
    exit_code: int
    sentence: str


def run_drop(results: Path, drop: Drop, stages: list[Stage], choice: Choice, report: Report) -> Failure | None:
    """Run ``stages`` of ``drop`` into ``results``; the first failure ends the drop and is returned.

    A stage is recorded as running before it starts, so that an interrupted run is seen as such. A programmer's mistake
    ends the drop too; its traceback is kept in ``error.log`` beside the tables, and the other drops go on.
    """
    folder = results / drop.name
    sweep(folder)
    if any(stage.command == "process" for stage in stages):
        write_drop(results, drop)
    for step in plan(results, drop, stages, choice):
        stage = step.stage
        if step.action != "run":
            if step.action == "not_needed":
                _forget(folder, stage)
            report(Event(drop.name, stage.name, step.action, step.reason))
            continue
        report(Event(drop.name, stage.name, "start", step.reason))
        try:
            seconds = _run_stage(folder, drop, stage, report)
        except WentryError as error:
            _forget_later(folder, stage)
            sentence = str(error)
            report(Event(drop.name, stage.name, "failed", sentence))
            return Failure(drop.name, stage.name, error.exit_code, sentence)
        except Exception as bug:
            sentence = _keep_traceback(folder, stage, bug)
            report(Event(drop.name, stage.name, "failed", sentence))
            return Failure(drop.name, stage.name, 1, sentence)
        report(Event(drop.name, stage.name, "done", f"{seconds:.1f} s"))
    return None


def _keep_traceback(folder: Path, stage: Stage, bug: Exception) -> str:
    _remove_tables(folder, stage)
    _forget_later(folder, stage)
    log = folder / ERROR_LOG
    write_text(log, "".join(traceback.format_exception(bug)))
    sentence = f"{type(bug).__name__} in stage {stage.name}: a mistake in wentry; please report it with {log}"
    _record(folder, stage, {"error": sentence, "exit_code": 1})
    return sentence


def sweep(folder: Path) -> None:
    """Remove what a killed or broken run left behind."""
    (folder / ERROR_LOG).unlink(missing_ok=True)
    for leftover in folder.glob(".*.part"):
        leftover.unlink(missing_ok=True)


def _run_stage(folder: Path, drop: Drop, stage: Stage, report: Report) -> float:
    run = importlib.import_module(f"wentry_cli.stages.{stage.name}").run
    _forget(folder, stage)
    marks = fingerprint(folder, drop, stage)
    _record(folder, stage, {"error": "interrupted"})
    progress.listen(lambda done, total: report(Event(drop.name, stage.name, "tick", "", done, total)))
    started = time.perf_counter()
    error = _attempt(run, folder, drop)
    if error is None:
        apply_corrections(folder, stage, drop.corrections)
    seconds = time.perf_counter() - started
    progress.listen(None)
    if error is not None and not isinstance(error, TooFewMeasurementsError):
        _remove_tables(folder, stage)
    _record(folder, stage, _entry(folder, stage, marks, seconds, error))
    if error is not None:
        raise error
    return seconds


def _attempt(run: Callable[[Path, Drop], object], folder: Path, drop: Drop) -> WentryError | None:
    try:
        run(folder, drop)
    except WentryError as error:
        return error
    return None


def _entry(
    folder: Path, stage: Stage, marks: dict[str, Any], seconds: float, error: WentryError | None
) -> dict[str, Any]:
    written = {name: digest_of_file(table_path(folder, name)) for name in stage.writes}
    entry: dict[str, Any] = {
        "fingerprint": marks,
        "outputs": {name: digest for name, digest in written.items() if digest},
        "seconds": round(seconds, 3),
        "peak_memory_mb": peak_memory_mb(),
    }
    if error is not None:
        entry |= {"error": str(error), "exit_code": error.exit_code}
    return entry


def _record(folder: Path, stage: Stage, entry: dict[str, Any] | None) -> None:
    path = folder / STAGES
    record = read_json(path)
    record.pop(stage.name, None)
    if entry is not None:
        record[stage.name] = entry
    write_json(path, record)


def _forget(folder: Path, stage: Stage) -> None:
    """Remove what an earlier run of ``stage`` left, so that no table outlives its inputs."""
    _remove_tables(folder, stage)
    if stage.name in read_json(folder / STAGES):
        _record(folder, stage, None)


def _remove_tables(folder: Path, stage: Stage) -> None:
    for name in stage.writes:
        table_path(folder, name).unlink(missing_ok=True)


def _forget_later(folder: Path, failed: Stage) -> None:
    names = [stage.name for stage in ALL_STAGES]
    for stage in ALL_STAGES[names.index(failed.name) + 1 :]:
        _forget(folder, stage)
