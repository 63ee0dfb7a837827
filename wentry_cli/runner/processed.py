"""The drops that stand in a RESULTS folder, and what is known of those that are not complete."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError, NoDropError
from wentry_cli.pipeline import stages_of
from wentry_cli.records import RUN, read_json, read_stages
from wentry_cli.runner.drop import Failure
from wentry_cli.runner.edited import warn_of_edits
from wentry_cli.runner.plan import INTERRUPTED
from wentry_cli.runner.record import read_drops
from wentry_cli.tables import has_table

CONFIGURATION = "configuration"  # in the place of a stage's name


@dataclass
class Campaign:
    """The drops that can be run, the failures so far, and what the user should hear at the start.

    ``to_show`` is what a report says of tables that are not those of today's files: drop, stage and sentence.
    """

    drops: list[Drop]
    failures: list[Failure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    to_show: list[list[str]] = field(default_factory=list)

    @property
    def size(self) -> int:
        """All drops, good and failed."""
        return len({drop.name for drop in self.drops} | {failure.drop for failure in self.failures})


def selected(names: list[str], only: tuple[str, ...], where: Path) -> list[str]:
    """Those of ``names`` that ``only`` asks for, all where it is empty; ``InputError`` for one that is not there."""
    unknown = [name for name in only if name not in names]
    if unknown:
        raise InputError(f"{where}: has no drop {unknown[0]}; its drops are {', '.join(names)}")
    return [name for name in names if not only or name in only]


def processed(results: Path, only: tuple[str, ...] = ()) -> Campaign:
    """The drops that were processed into ``results``; one that could not be measured is a failure from the start."""
    drops, damaged = read_drops(results)
    names = selected(sorted([*(drop.name for drop in drops), *damaged]), only, results)
    drops = [drop for drop in drops if drop.name in names]
    edits = [note for drop in drops for note in warn_of_edits(results / drop.name)]
    failures = [Failure(name, "", InputError.exit_code, told) for name, told in damaged.items() if name in names]
    failures += [failure for drop in drops for failure in _failed_before(results, drop, "process")]
    return Campaign(drops, failures, edits)


def shown(results: Path, only: tuple[str, ...] = ()) -> Campaign:
    """What a report is on: the drops of ``processed``, or none where ``results`` holds a compression test alone."""
    try:
        return processed(results, only)
    except NoDropError:
        if only or not has_table(results, "compression"):
            raise
        return Campaign([])


def incomplete(campaign: Campaign, results: Path, only: tuple[str, ...] = ()) -> list[Failure]:
    """The drops that a report on ``results`` cannot show as a whole, and why: not measured, not fitted, or refused."""
    fits = [failure for drop in campaign.drops for failure in _failed_before(results, drop, "fit")]
    told = {} if only else read_json(results / RUN).get("failures", {})
    refused = [
        Failure(name, str(one.get("stage")), int(one.get("exit_code", 1)), str(one.get("sentence")))
        for name, one in told.items()
        if name not in {drop.name for drop in campaign.drops}  # it left nothing there
    ]
    found = {failure.drop: failure for failure in [*refused, *fits, *campaign.failures]}
    return [found[name] for name in sorted(found)]


def _failed_before(results: Path, drop: Drop, command: str) -> list[Failure]:
    told = read_json(results / RUN).get("failures", {}).get(drop.name, {})
    if told.get("stage") == CONFIGURATION:
        return [Failure(drop.name, CONFIGURATION, int(told["exit_code"]), str(told["sentence"]))]
    record = read_stages(results / drop.name)
    for stage in stages_of(command):
        known = record.get(stage.name)
        if stage.why_not(drop) is not None:
            continue
        if not isinstance(known, dict):
            if told.get("sentence"):  # what failed before this stage could begin
                return [Failure(drop.name, str(told["stage"]), int(told["exit_code"]), str(told["sentence"]))]
            sentence = f"stage {stage.name} has not run; run `wentry {command}` first"
            return [Failure(drop.name, stage.name, InputError.exit_code, sentence)]
        if known.get("error") == INTERRUPTED:
            sentence = f"stage {stage.name} was interrupted; run `wentry {command}` again"
            return [Failure(drop.name, stage.name, InputError.exit_code, sentence)]
        if known.get("error"):
            return [Failure(drop.name, stage.name, int(known.get("exit_code", 1)), str(known["error"]))]
        missing = [name for name in known.get("outputs", {}) if not has_table(results / drop.name, name)]
        if missing:
            sentence = f"{results / drop.name / missing[0]}.csv: missing; run `wentry {command}` again"
            return [Failure(drop.name, stage.name, InputError.exit_code, sentence)]
    return []
