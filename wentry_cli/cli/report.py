"""``wentry report``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt
from wentry_cli.cli.flow import Flow


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

    Nothing is drawn again where tables, configuration, recordings and version are those of the last report.
    """
    from wentry_cli.runner.commands import processed

    pages = f"{results / 'report.html'} and {results / 'report.pdf'}"
    Flow(results, **common).carry_out(
        processed(results, only),
        "report",
        lambda _, done: (
            f"{pages} show today's results already; --force draws them again" if done[0].action == "fresh" else pages
        ),
        only,
    )
