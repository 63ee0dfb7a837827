"""The files of a drop as they are now, after it was processed: what follows them, and what was measured by others."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.config.campaign import EXPERIMENT, Drop, read_drop
from wentry_cli.config.places import Document
from wentry_cli.errors import ConfigurationError, Gathered, InputError, WentryError
from wentry_cli.pipeline import Stage, stages_of
from wentry_cli.records import DROP, read_json
from wentry_cli.runner.commands import Campaign, processed
from wentry_cli.runner.drop import Failure
from wentry_cli.runner.edited import edited_tables
from wentry_cli.runner.plan import Choice, Step, plan

BY_HAND = ("configuration", "corrections", "material")  # how the marks of what a user writes begin


def as_configured_today(results: Path, drop: Drop) -> Drop:
    """The drop as its files describe it now, under the ``--set`` of its last run; as it was where they have gone.

    Raises ``ConfigurationError`` where they are wrong.
    """
    if not (drop.folder / EXPERIMENT).is_file():
        return Drop.from_record(read_json(results / drop.name / DROP))
    overrides = Document(drop.overrides) if drop.overrides else None
    return read_drop(drop.name, drop.folder, overrides, drop.top)


def to_fit(results: Path, only: tuple[str, ...] = ()) -> Campaign:
    """The drops of ``processed`` as they are configured today.

    One whose files are wrong, or say otherwise than what it was measured with, is a failure; where that leaves no drop
    its error is raised, before anything is touched. What else was measured before it changed is told in a note.
    """
    found = processed(results, only)
    failed = {failure.drop for failure in found.failures}
    campaign = Campaign([], found.failures, found.notes)
    refused = Gathered()
    for drop in found.drops:
        today = drop
        if drop.name not in failed:
            try:
                today = as_configured_today(results, drop)
                campaign.notes += _measured_before(results, today)
            except (ConfigurationError, InputError) as error:
                campaign.failures.append(Failure(drop.name, "", error.exit_code, str(error)))
                refused.errors.append(error)
        campaign.drops.append(today)
    if len(campaign.failures) == campaign.size:
        refused.complain()
    return campaign


def notes_to_report(results: Path, campaign: Campaign) -> list[str]:
    """A sentence for each complete drop of ``campaign`` whose tables are not those of today's files."""
    notes = []
    failed = {failure.drop for failure in campaign.failures}
    for drop in campaign.drops:
        if drop.name in failed or edited_tables(results / drop.name):
            continue
        try:
            today = as_configured_today(results, drop)
            step = _first_stale(results, today, "process", "fit")
        except WentryError as error:
            notes.append(f"{error}; the report shows what was measured before")
            continue
        if step is not None and step.reason.startswith(BY_HAND):
            command = f"wentry fit {results}" if step.stage.command == "fit" else _process(results, today)
            notes.append(f"{_changed(today, step)}; the report shows what was there before: run `{command}`")
    return notes


def _measured_before(results: Path, today: Drop) -> list[str]:
    """Notes on what changed since ``today`` was measured; ``InputError`` where its own files say otherwise."""
    try:
        step = _first_stale(results, today, "process")
    except InputError as gone:
        return [f"{today.name}: what was measured before is used as it is, though {gone}"]
    if step is None or edited_tables(results / today.name):
        return []
    if step.reason.startswith(BY_HAND):
        raise InputError(f"{_changed(today, step)}; run `{_process(results, today)}` first")
    told = f"what was measured before is used as it is, `{_process(results, today)}` makes it anew"
    return [f"{_changed(today, step)}; {told}"]


def _first_stale(results: Path, today: Drop, *commands: str) -> Step[Stage] | None:
    steps = plan(results, today, stages_of(*commands), Choice())
    return next((step for step in steps if step.action == "run"), None)


def _changed(drop: Drop, step: Step[Stage]) -> str:
    return f"{drop.name}: {step.reason} since {step.stage.name} was done"


def _process(results: Path, drop: Drop) -> str:
    given = " with --set as before" if drop.overrides else ""
    return f"wentry process {drop.top} -o {results}{given}"
