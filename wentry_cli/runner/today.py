"""The files of a drop as they are now, after it was processed: what follows them, and what was measured by others."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from wentry_cli.config.campaign import EXPERIMENT, Drop, read_drop
from wentry_cli.config.places import Document
from wentry_cli.errors import ConfigurationError, Gathered, InputError, WentryError
from wentry_cli.pipeline import Stage, stages_of
from wentry_cli.records import DROP, read_json
from wentry_cli.runner.drop import Failure
from wentry_cli.runner.edited import edited_tables, edits_to_show
from wentry_cli.runner.plan import Choice, Step, changed_by_hand, plan
from wentry_cli.runner.processed import Campaign, processed


def as_configured_today(results: Path, drop: Drop) -> Drop:
    """The drop as its files describe it now, under the ``--set`` of its last run; as it was where they have gone.

    Raises ``ConfigurationError`` where they are wrong.
    """
    if not (drop.folder / EXPERIMENT).is_file():
        return Drop.from_record(read_json(results / drop.name / DROP))
    overrides = Document(drop.overrides) if drop.overrides else None
    return read_drop(drop.name, drop.folder, overrides, drop.top)


def look_at_input(drop: Drop) -> None:
    """Raise ``InputError`` with every recording of ``drop`` of which a file is missing; nothing is read."""
    from wentry_cli.frames.identity import recording_files

    problems = Gathered()
    for view in drop.experiment.sides:
        with problems.part():
            recording_files(drop.existing_source(view))
    problems.complain()


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
    for drop, step, wrong in _changes(results, campaign.drops, {failure.drop for failure in campaign.failures}):
        if step is None:
            notes.append(f"{wrong}; the report shows what was measured before")
        else:
            command = f"wentry fit {results}" if step.stage.command == "fit" else _process(results, drop)
            notes.append(f"{_changed(drop, step)}; the report shows what was there before: run `{command}`")
    return notes


def notes_to_show(results: Path, drops: Iterable[Drop], failed: Collection[str] = ()) -> list[list[str]]:
    """What a report says of tables that are not those of today's files: drop, stage and sentence, by drop.

    Those of ``failed`` drops it shows as they are, and says why they failed. No sentence depends on where RESULTS is.
    """
    drops = list(drops)
    rows = [[drop.name, stage, told] for drop in drops for stage, told in edits_to_show(results / drop.name)]
    for drop, step, wrong in _changes(results, drops, failed):
        if step is None:
            rows.append([drop.name, "", f"{'; '.join(wrong.splitlines())}; what was measured before is shown"])
        else:
            rows.append([drop.name, step.stage.name, f"{step.reason} since; what was there before is shown"])
    return sorted(rows, key=lambda row: row[0])


def _changes(
    results: Path, drops: Iterable[Drop], failed: Collection[str]
) -> Iterator[tuple[Drop, Step[Stage] | None, str]]:
    """The drops but those that ``failed`` whose files say otherwise than when a step was done, or are wrong now."""
    for drop in drops:
        if drop.name in failed:
            continue
        try:
            today = as_configured_today(results, drop)
            step = changed_by_hand(results, today, stages_of("process", "fit"))
            for view in today.experiment.sides if step is None else ():
                today.existing_source(view)
        except WentryError as error:
            yield drop, None, str(error)
        else:
            if step is not None:
                yield today, step, ""


def _measured_before(results: Path, today: Drop) -> list[str]:
    """Notes on what changed since ``today`` was measured; ``InputError`` where its own files say otherwise.

    They are asked first: a table that was edited, or another version, does not hide that a key was.
    """
    changed = changed_by_hand(results, today, stages_of("process"))
    if changed is not None:
        raise InputError(f"{_changed(today, changed)}; run `{_process(results, today)}` first")
    try:
        steps = plan(results, today, stages_of("process"), Choice())
    except InputError as gone:
        return [f"{today.name}: what was measured before is used as it is, though {gone}"]
    step = next((step for step in steps if step.action == "run"), None)
    if step is None or edited_tables(results / today.name):
        return []
    told = f"what was measured before is used as it is, `{_process(results, today)}` makes it anew"
    return [f"{_changed(today, step)}; {told}"]


def _changed(drop: Drop, step: Step[Stage]) -> str:
    return f"{drop.name}: {step.reason} since {step.stage.name} was done"


def _process(results: Path, drop: Drop) -> str:
    given = " with --set as before" if drop.overrides else ""
    return f"wentry process {drop.top} -o {results}{given}"
