"""``wentry status``."""

from __future__ import annotations

from pathlib import Path
from textwrap import shorten

import click

from wentry_cli.cli import options as opt

SHORT = 90  # letters of a warning beside a fresh stage


@click.command(name="status")
@opt.options(opt.results_argument, opt.only, opt.as_json)
def command(results: Path, only: tuple[str, ...], as_json: bool) -> None:
    """Show which stage of which drop in RESULTS is fresh, stale (and why), failed or not needed.

    Beside a fresh stage stands what it warned of, shortened; --json and the report have all of it.
    """
    from wentry_cli.cli.console import show_json, show_line
    from wentry_cli.runner.status import campaign_status

    states = campaign_status(results, only)
    if as_json:
        show_json(states)
        return
    for name, stages in states.items():
        for stage, (state, reason) in stages.items():
            show_line(name, stage, state, shorten(reason, SHORT, placeholder=" …") if state == "fresh" else reason)
