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
    shared = {drop.name: None if drop.shared.path is None else str(drop.shared.path) for drop in campaign.drops}
    facts, failures = inspect_sources(campaign.drops)
    campaign.failures += failures
    if as_json:
        told = {failure.drop: failure.sentence for failure in campaign.failures}
        show_json({"drops": facts, "campaign": shared, "failures": told})
    else:
        for sentence in [*(() if quiet else campaign.notes), *(failure.sentence for failure in campaign.failures)]:
            click.echo(sentence, err=True)
        if not quiet:
            for name, views in facts.items():
                click.echo(f"{name:24} campaign.yaml: {shared[name] or 'none'}")
                for view, sentence in views.items():
                    click.echo(f"{name:24} {view:5} {sentence}")
    commands.raise_failures(campaign)
