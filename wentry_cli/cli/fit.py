"""``wentry fit``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt
from wentry_cli.cli.flow import Flow


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
def command(results: Path, only: tuple[str, ...], **common: Any) -> None:
    """Fit model and numbers of each processed drop in RESULTS, then the regressions over all of them.

    The configuration is read again; where it changed in what a drop was measured with, `wentry process` comes first.
    """
    from wentry_cli.runner.today import to_fit

    Flow(results, **common).carry_out(
        to_fit(results, only),
        "fit",
        lambda *_: f"{results / 'summary.csv'} and {results / 'scaling.csv'}; next: wentry report {results}",
    )
