"""``wentry fit``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="fit")
@opt.options(
    opt.results_argument,
    opt.jobs,
    opt.cluster,
    opt.dry_run,
    opt.until("fit"),
    opt.force("fit"),
    opt.only,
    opt.as_json,
    opt.quiet,
    opt.verbose,
)
def command(
    results: Path, jobs: int, cluster: str | None, dry_run: bool, until: str | None, force: str | None,
    only: tuple[str, ...], as_json: bool, quiet: bool, verbose: bool,
) -> None:  # fmt: skip
    """Fit model and numbers of each processed drop in RESULTS, then the regressions over all of them."""
    from wentry_cli.cli.console import reporting, show_json, show_plan
    from wentry_cli.runner import commands
    from wentry_cli.runner.campaign import Hands
    from wentry_cli.runner.plan import Choice

    campaign = commands.processed(results, only)
    choice = Choice(force, until)
    if dry_run:
        show_plan(commands.plans(campaign, results, ("fit",), choice), as_json=as_json)
        return
    with commands.locked(results):
        with reporting(quiet=quiet, verbose=verbose) as report:
            commands.tell_failures(campaign, report)
            commands.fit(campaign, results, choice, Hands(jobs, cluster), report)
        record = commands.finish(campaign, results, "fit")
    if as_json:
        show_json(record)
    commands.raise_failures(campaign)
    if not quiet and not as_json:
        click.echo(f"{results / 'summary.csv'} and {results / 'scaling.csv'}; next: wentry report {results}", err=True)
