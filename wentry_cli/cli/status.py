"""``wentry status``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="status")
@opt.options(opt.results_argument, opt.as_json)
def command(results: Path, as_json: bool) -> None:
    """Show which stage of which drop in RESULTS is fresh, stale (and why), failed or not needed."""
    from wentry_cli.cli.console import show_json
    from wentry_cli.runner.status import drop_status

    states = drop_status(results)
    if as_json:
        show_json(states)
        return
    for name, stages in states.items():
        for stage, (state, reason) in stages.items():
            click.echo(f"{name:24} {stage:12} {state:11} {reason}")
