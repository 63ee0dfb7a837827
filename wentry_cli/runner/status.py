"""The state of each stage of each drop, as a table for the user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.errors import LockedError, WentryError
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.runner.drop import INTERRUPTED
from wentry_cli.runner.lock import locked
from wentry_cli.runner.plan import Choice, Step, plan
from wentry_cli.runner.record import STAGES, read_drops, read_json


def drop_status(results: Path) -> dict[str, dict[str, tuple[str, str]]]:
    """State and reason by drop and stage: ``fresh``, ``stale``, ``failed``, ``running``, ``not needed``."""
    drops = read_drops(results)
    busy = _is_locked(results)
    return {drop.name: _states(results, _as_configured_today(drop), busy) for drop in drops}


def _is_locked(results: Path) -> bool:
    try:
        with locked(results):
            return False
    except LockedError:
        return True


def _as_configured_today(drop: Drop) -> Drop:
    """The drop as its ``experiment.yaml`` describes it now, where that file is still there and right."""
    try:
        return read_drop(drop.name, drop.folder)
    except WentryError:
        return drop


def _states(results: Path, drop: Drop, busy: bool) -> dict[str, tuple[str, str]]:
    record = read_json(results / drop.name / STAGES)
    try:
        steps = plan(results, drop.with_calibration(results), list(ALL_STAGES), Choice())
    except WentryError as gone:
        return {stage.name: ("stale", str(gone)) for stage in ALL_STAGES}
    return {step.stage.name: _state(step, record.get(step.stage.name), busy) for step in steps}


def _state(step: Step, known: Any, busy: bool) -> tuple[str, str]:
    if step.action == "not_needed":
        return "not needed", step.reason
    error = known.get("error") if isinstance(known, dict) else None
    if error == INTERRUPTED:
        return ("running", "") if busy else ("stale", INTERRUPTED)
    if error:
        return "failed", str(error)
    return ("fresh", "") if step.action == "fresh" else ("stale", step.reason)
