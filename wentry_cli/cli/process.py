"""``wentry process``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt
from wentry_cli.cli.flow import Flow


@click.command(name="process")
@opt.options(
    opt.video_dir,
    opt.results_option,
    opt.jobs,
    opt.cluster,
    opt.dry_run,
    opt.until("process"),
    opt.force("process"),
    opt.settings,
    opt.only,
    opt.verify,
    opt.as_json,
    opt.quiet,
    opt.verbose,
)
def command(video_dir: Path, settings: tuple[str, ...], only: tuple[str, ...], **common: Any) -> None:
    """Measure every drop in VIDEO_DIR and write its tables into RESULTS.

    VIDEO_DIR is a drop (a folder with experiment.yaml) or a campaign (a folder of drops, at any depth). What is done
    and unchanged is not done again.
    """
    from wentry_cli.runner.commands import read_campaign

    flow = Flow(**common)
    flow.carry_out(
        read_campaign(video_dir, settings, only),
        "process",
        lambda campaign, _: _farewell(flow, len(campaign.drops), video_dir),
    )


def _farewell(flow: Flow, drops: int, video_dir: Path) -> str:
    from wentry_cli.pipeline import stages_of

    counted = opt.counted(drops, "drop")
    if flow.until not in (None, stages_of("process")[-1].name):
        return f"{counted}: done as far as {flow.until}; next: wentry process {video_dir} -o {flow.results}"
    return f"{counted} measured; next: wentry fit {flow.results}"
