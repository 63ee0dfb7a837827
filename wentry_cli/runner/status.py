"""The state of each stage of each drop, as a table for the user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.errors import LockedError, WentryError
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.pipeline import Stage
from wentry_cli.runner.lock import locked
from wentry_cli.runner.plan import why_stale
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
    folder = results / drop.name
    record = read_json(folder / STAGES)
    return {stage.name: _state(folder, drop.with_calibration(results), stage, record, busy) for stage in ALL_STAGES}


def _state(folder: Path, drop: Drop, stage: Stage, record: dict[str, Any], busy: bool) -> tuple[str, str]:
    why_not = stage.why_not(drop)
    if why_not is not None:
        return "not needed", why_not
    error = record.get(stage.name, {}).get("error")
    if error == "interrupted":
        return ("running", "") if busy else ("stale", "interrupted")
    if error:
        return "failed", str(error)
    try:
        reason = why_stale(folder, drop, stage, record)
    except WentryError as gone:
        return "stale", str(gone)
    return ("stale", reason) if reason else ("fresh", "")
