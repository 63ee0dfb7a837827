"""``wentry check``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="check")
@opt.options(opt.video_dir, opt.settings, opt.only, opt.as_json, opt.quiet)
def command(video_dir: Path, settings: tuple[str, ...], only: tuple[str, ...], as_json: bool, quiet: bool) -> None:
    """Validate configuration and recordings of VIDEO_DIR; nothing is written."""
    from wentry_cli.cli.console import show_json
    from wentry_cli.runner import commands
    from wentry_cli.runner.inspect import inspect_sources

    campaign = commands.read_campaign(video_dir, settings, only)
    facts, failures = inspect_sources(campaign.drops)
    campaign.failures += failures
    if as_json:
        show_json({"drops": facts, "failures": {failure.drop: failure.sentence for failure in campaign.failures}})
    else:
        for failure in campaign.failures:
            click.echo(failure.sentence, err=True)
        if not quiet:
            for name, views in facts.items():
                for view, sentence in views.items():
                    click.echo(f"{name:24} {view:5} {sentence}")
    commands.raise_failures(campaign)
