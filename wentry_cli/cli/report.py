"""``wentry report``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="report")
@opt.options(opt.results_argument, opt.only, opt.quiet)
def command(results: Path, only: tuple[str, ...], quiet: bool) -> None:
    """Draw every figure that the tables in RESULTS allow: report.html, report.pdf and figures/."""
    from wentry_cli.runner import commands
    from wentry_cli.stages import report

    campaign = commands.processed(results, only)
    with commands.locked(results):
        report.run(results, campaign.drops)
    if not quiet:
        click.echo(f"{results / 'report.html'} and {results / 'report.pdf'}", err=True)
