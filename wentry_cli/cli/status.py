"""``wentry status``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="status")
@opt.options(opt.results_argument, opt.only, opt.as_json)
def command(results: Path, only: tuple[str, ...], as_json: bool) -> None:
    """Show which stage of which drop in RESULTS is fresh, stale (and why), failed or not needed."""
    from wentry_cli.cli.console import show_json, show_line
    from wentry_cli.runner.status import campaign_status

    states = campaign_status(results, only)
    if as_json:
        show_json(states)
        return
    for name, stages in states.items():
        for stage, (state, reason) in stages.items():
            show_line(name, stage, state, reason)
