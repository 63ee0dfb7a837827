"""``wentry run``: process, fit and report in a row."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt
from wentry_cli.cli.flow import Flow


@click.command(name="run")
@opt.options(
    opt.video_dir,
    opt.results_option,
    opt.jobs,
    opt.cluster,
    opt.dry_run,
    opt.until("process", "fit", "report"),
    opt.force("process", "fit", "report"),
    opt.settings,
    opt.only,
    opt.verify,
    opt.as_json,
    opt.quiet,
    opt.verbose,
)
def command(video_dir: Path, settings: tuple[str, ...], only: tuple[str, ...], **common: Any) -> None:
    """Process VIDEO_DIR into RESULTS, fit and report. Drops that fail do not stop the others."""
    from wentry_cli.runner.commands import read_campaign

    flow = Flow(**common)
    then = f"stopped after {flow.until}" if flow.until else f"open {flow.results / 'report.html'}"
    flow.carry_out(
        read_campaign(video_dir, settings, only),
        "run",
        lambda campaign, _: f"{opt.counted(len(campaign.drops), 'drop')} done; {then}",
    )
