"""What the commands do, in words in and failures out: read the campaign, run its stages, gather the record."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import EXPERIMENT, Drop, find_drops, missing_sources, read_drop
from wentry_cli.config.inheritance import find_materials, find_shared, notes_of
from wentry_cli.config.places import Document, Place, followed, read_value
from wentry_cli.errors import CampaignError, ConfigurationError, InputError, WentryError
from wentry_cli.pipeline import KERNELS, CampaignStage, Stage, campaign_stages_of, stages_of
from wentry_cli.runner.campaign import Hands, run_campaign
from wentry_cli.runner.campaign_stages import Members, plan_campaign, rewritten_by, run_campaign_stages
from wentry_cli.runner.drop import Event, Failure, Report
from wentry_cli.runner.lock import locked
from wentry_cli.runner.plan import Choice, Step, plan
from wentry_cli.runner.processed import CONFIGURATION, Campaign, incomplete, processed, selected, shown
from wentry_cli.runner.record import write_run
from wentry_cli.runner.work import Work

Plans = dict[str, list[Step[Stage]]]


@dataclass(frozen=True)
class Order:
    """What is asked for: a command, how and by whom; ``shown`` are the drops of a report (none: all)."""

    command: str
    choice: Choice = field(default_factory=Choice)
    hands: Hands = field(default_factory=Hands)
    shown: tuple[str, ...] = ()

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands that do it, in order."""
        return ("process", "fit", "report") if self.command == "run" else (self.command,)

    @property
    def stages(self) -> list[Stage]:
        """The stages of a drop that are asked for."""
        return stages_of(*self.commands, until=self.choice.until)

    @property
    def campaign_stages(self) -> list[CampaignStage]:
        """The stages over all drops that are asked for."""
        return campaign_stages_of(*self.commands, until=self.choice.until)

    @property
    def measures(self) -> bool:
        """Whether drops are worked on, so that a failed one fails the command; a report shows what there is."""
        return bool(self.stages)

    def kernels(self, campaign: Campaign) -> set[str]:
        """The rooms whose kernels the stages call that the drops of ``campaign`` need."""
        needed = (stage for stage in self.stages if any(stage.why_not(drop) is None for drop in campaign.drops))
        return {KERNELS[stage.name] for stage in needed if stage.name in KERNELS}


def overrides_document(settings: tuple[str, ...]) -> Document | None:
    """``key.path=value`` words as a document; values are read as YAML. Raises ``ConfigurationError``."""
    document = Document({})
    for setting in settings:
        key, separator, text = setting.partition("=")
        if not separator or not key:
            raise ConfigurationError(f"--set {setting}: write key.path=value, for example analysis.tracking=fast")
        value = read_value(text, Path(f"--set {key}"))
        parts = key.split(".")
        below: dict[str, Any] = {parts[-1]: value}
        for part in reversed(parts[:-1]):
            below = {part: below}
        place = Place(Path(f"--set {key}"), 0, 0)
        document = Document(below, {tuple(parts): place}).over(document)
    return document if settings else None


def read_campaign(video_dir: Path, settings: tuple[str, ...] = (), only: tuple[str, ...] = ()) -> Campaign:
    """Read every drop of ``video_dir``; a drop with a wrong configuration becomes a failure of its own.

    Raises ``ConfigurationError`` where no drop is right, and ``InputError`` for a drop that does not exist.
    """
    overrides = overrides_document(settings)
    found = find_drops(video_dir)
    names = selected(list(found), only, video_dir)
    told = [note for name in names for note in notes_of(find_shared(found[name], video_dir), video_dir)]
    campaign = Campaign([])
    for name in names:
        try:
            drop = read_drop(name, found[name], overrides, video_dir)
            campaign.drops.append(drop)
            if drop.material is not None:
                file = find_materials(drop.folder, video_dir, drop.shared.path)
                told += notes_of(file, video_dir, "the materials")
        except WentryError as error:
            sentence = "\n".join([str(error), *missing_sources(found[name], overrides)])
            campaign.failures.append(Failure(name, CONFIGURATION, error.exit_code, sentence))
    campaign.notes += dict.fromkeys(told)
    if not campaign.drops:
        lines = dict.fromkeys(line for failure in campaign.failures for line in failure.sentence.splitlines())
        raise ConfigurationError("\n".join([*lines, *campaign.notes]))
    return campaign


def keep_raw_data(campaign: Campaign, results: Path) -> None:
    """Raise ``InputError`` where ``results``, or what a drop writes there, would lie among frames of a recording.

    Below frames that lie beside their ``experiment.yaml`` a folder is no harm, but nothing may be written beside that,
    as where ``results`` is the drop or the campaign itself.
    """
    for drop in campaign.drops:
        home, tables = followed(drop.folder), followed(results / drop.name)
        if home in (tables, followed(results)):
            told = f"the {'tables' if tables == home else 'results'} of {drop.name} would lie beside its {EXPERIMENT}"
            raise InputError(f"{results}: {told}; choose another folder with -o")
        for view in drop.experiment.sides:
            frames = _folder_of_frames(drop, view)
            if frames is None or frames == home:
                continue
            if any(path.is_relative_to(frames) for path in (followed(results), tables)):
                raise InputError(f"{results}: lies among the frames of {frames}; choose another folder with -o")


def _folder_of_frames(drop: Drop, view: str) -> Path | None:
    """The folder that holds the images of a view, itself named or by a pattern; ``None`` where a file holds them."""
    source = drop.source_path(view)
    if set(source.name) & set("*?["):
        source = source.parent
    return followed(source) if source.is_dir() else None


def work(campaign: Campaign, results: Path, order: Order, report: Report) -> list[Step[CampaignStage]]:
    """Do what is ordered, one command after another; failures of drops are added to ``campaign``.

    The record of the run is written before the report, which shows it. Returns the steps over all drops.
    """
    for name in order.commands:
        stages = stages_of(name, until=order.choice.until)
        if stages:
            todo = Work(results, stages, order.choice)
            campaign.failures += run_campaign(todo, _without_failures(campaign), order.hands, report)
    done = []
    for stage in order.campaign_stages:
        finish(campaign, results, order)  # the drops that failed before today, but not now, take part
        members = _members(campaign, results, order)
        if stage.shows_all:
            campaign.to_show = members.notes
            finish(campaign, results, order)
        done += run_campaign_stages(members, [stage], order.choice, report)
    return done


def plans(campaign: Campaign, results: Path, order: Order) -> tuple[Plans, list[Step[CampaignStage]]]:
    """What would run for each drop and over all drops, and why; nothing is done."""
    found: Plans = {}
    for drop in _without_failures(campaign) if order.measures else []:
        try:
            found[drop.name] = plan(results, drop, order.stages, order.choice)
        except WentryError as error:
            campaign.failures.append(Failure(drop.name, "ingest", error.exit_code, str(error)))
    over_all = order.campaign_stages
    if not over_all:
        return found, []
    return found, plan_campaign(_members(campaign, results, order), over_all, order.choice, rewritten_by(found))


def _members(campaign: Campaign, results: Path, order: Order) -> Members:
    """What a stage over all drops works on: all that is in ``results``, not only the drops of this run."""
    try:
        everything = processed(results, order.shown)
    except InputError:
        everything = Campaign([])
    failed = frozenset(failure.drop for failure in (*campaign.failures, *everything.failures))
    return Members(results, everything.drops, failed)


def _without_failures(campaign: Campaign) -> list[Drop]:
    failed = {failure.drop for failure in campaign.failures}
    return [drop for drop in campaign.drops if drop.name not in failed]


def finish(campaign: Campaign, results: Path, order: Order) -> dict[str, Any]:
    """Write ``run.json`` and return it."""
    if not order.measures:
        return write_run(results, None, {}, set(), campaign.to_show)
    failures = {
        failure.drop: {"stage": failure.stage, "exit_code": failure.exit_code, "sentence": failure.sentence}
        for failure in campaign.failures
    }
    return write_run(results, order.command, failures, {drop.name for drop in campaign.drops}, campaign.to_show)


def tell_failures(campaign: Campaign, report: Report) -> None:
    """Report the failures that are known before anything runs."""
    for failure in campaign.failures:
        report(Event(failure.drop, failure.stage, "failed", failure.sentence))


def raise_failures(campaign: Campaign, only_looked: str = "") -> None:
    """End with the exit code of the contract: a single drop's own, ``CampaignError`` (6) for a campaign.

    Each failure has been told when it happened; a single drop's error has no words left. Where nothing ran,
    ``only_looked`` says what cannot be done with the drops that failed.
    """
    if not campaign.failures:
        return
    if campaign.size == 1:
        error = WentryError()
        error.exit_code = campaign.failures[0].exit_code
        raise error
    names = ", ".join(failure.drop for failure in campaign.failures)
    share = f"{len(campaign.failures)} of {campaign.size} drops"
    if only_looked:
        raise CampaignError(f"{share} cannot be {only_looked}: {names}; nothing was run")
    rest = "the others are complete" if len(campaign.failures) < campaign.size else "no drop is complete"
    raise CampaignError(f"{share} failed: {names}; {rest}")


__all__ = [
    "CONFIGURATION",
    "Campaign",
    "Order",
    "finish",
    "incomplete",
    "keep_raw_data",
    "locked",
    "plans",
    "processed",
    "raise_failures",
    "read_campaign",
    "shown",
    "tell_failures",
    "work",
]
