"""``wentry report``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wentry_cli.cli import options as opt
from wentry_cli.cli.flow import Flow

if TYPE_CHECKING:
    from wentry_cli.pipeline import CampaignStage
    from wentry_cli.runner.commands import Campaign
    from wentry_cli.runner.drop import Failure
    from wentry_cli.runner.plan import Step


@click.command(name="report")
@opt.options(
    opt.results_argument,
    opt.dry_run,
    opt.force("report"),
    opt.only,
    opt.as_json,
    opt.quiet,
    opt.verbose,
)
def command(results: Path, only: tuple[str, ...], **common: Any) -> None:
    """Draw every figure that the tables in RESULTS allow: report.html, report.pdf and figures/.

    Nothing is drawn again where tables, configuration, recordings and version are those of the last report. Drops that
    are not complete are named, with what they lack; the report itself is complete then, and its exit code 0.
    """
    from wentry_cli.runner.commands import incomplete, shown
    from wentry_cli.runner.today import notes_to_report

    pages = f"{results / 'report.html'} and {results / 'report.pdf'}"

    def farewell(campaign: Campaign, done: list[Step[CampaignStage]]) -> str:
        fresh = f"{pages} show today's results already; --force draws them again"
        lacking = [_told(failure) for failure in incomplete(campaign, results, only)]
        return "\n".join([*lacking, fresh if done[0].action == "fresh" else pages])

    campaign = shown(results, only)
    campaign.notes += notes_to_report(results, campaign)
    Flow(results, **common).carry_out(campaign, "report", farewell, only)


def _told(failure: Failure) -> str:
    return ": ".join(part for part in (failure.drop, "not complete", failure.stage, failure.sentence) if part)
