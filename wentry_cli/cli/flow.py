"""What ``process``, ``fit``, ``report`` and ``run`` have in common: plan or work, tell, record, exit code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from wentry_cli.pipeline import CampaignStage
    from wentry_cli.runner.commands import Campaign, Order
    from wentry_cli.runner.plan import Step

Farewell = Callable[["Campaign", "list[Step[CampaignStage]]"], str]


@dataclass(frozen=True)
class Flow:
    """The common options of a command, as the user gave them."""

    results: Path
    jobs: int = 1
    cluster: str | None = None
    dry_run: bool = False
    until: str | None = None
    force: str | None = None
    verify: bool = False
    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    def carry_out(self, campaign: Campaign, command: str, farewell: Farewell, shown: tuple[str, ...] = ()) -> None:
        """Do ``command`` for ``campaign``, or show what would be done; ``farewell`` says what is there now."""
        from wentry_cli.runner.campaign import Hands
        from wentry_cli.runner.commands import Order, raise_failures
        from wentry_cli.runner.plan import Choice

        if not self.quiet:
            for note in campaign.notes:
                click.echo(note, err=True)
        choice = Choice(self.force, self.until, self.verify)
        order = Order(command, choice, Hands(self.jobs, self.cluster), shown)
        if self.dry_run:
            self._show(campaign, order)
        else:
            self._work(campaign, order, farewell)
        if order.measures:
            verb = "fitted" if command == "fit" else "processed"
            raise_failures(campaign, verb if self.dry_run else "")

    def _show(self, campaign: Campaign, order: Order) -> None:
        from wentry_cli.cli.console import show_plan
        from wentry_cli.runner.commands import plans

        show_plan(*plans(campaign, self.results, order), as_json=self.as_json)
        for failure in campaign.failures if order.measures else ():
            click.echo(f"{failure.drop}: {failure.sentence}", err=True)

    def _work(self, campaign: Campaign, order: Order, farewell: Farewell) -> None:
        from wentry_cli.cli.console import reporting, show_json
        from wentry_cli.compiled import FIRST_RUN, compiles_anew
        from wentry_cli.runner.commands import finish, keep_raw_data, locked, tell_failures, work
        from wentry_cli.runner.doubtful import warn_of_doubtful
        from wentry_cli.runner.twice import warn_of_twice

        keep_raw_data(campaign, self.results)  # before the lock, which makes the folder
        with locked(self.results):
            if not self.quiet and compiles_anew(order.kernels(campaign)):
                click.echo(FIRST_RUN, err=True)
            with reporting(quiet=self.quiet, verbose=self.verbose) as report:
                if order.measures:
                    tell_failures(campaign, report)
                done = work(campaign, self.results, order, report)
            record = finish(campaign, self.results, order)
            told = [] if self.quiet else warn_of_twice(self.results, order.shown)
            told += warn_of_doubtful(self.results) if order.campaign_stages and not self.quiet else []
        for sentence in told:
            click.echo(f"warning: {sentence}", err=True)
        if self.as_json:
            show_json(record)
        elif not self.quiet and not (order.measures and campaign.failures):
            click.echo(farewell(campaign, done), err=True)
        elif not self.quiet and any(step.stage.name == "report" for step in done):
            click.echo(f"what failed, and what there is: {self.results / 'report.html'}", err=True)
