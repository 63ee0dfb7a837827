"""``wentry check``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="check")
@click.option("--frames", is_flag=True, help="Also read every frame, and tell those that are damaged or missing.")
@opt.options(opt.video_dir, opt.settings, opt.only, opt.as_json, opt.quiet)
def command(
    video_dir: Path, frames: bool, settings: tuple[str, ...], only: tuple[str, ...], as_json: bool, quiet: bool
) -> None:
    """Validate configuration and recordings of VIDEO_DIR; nothing is written.

    Of a recording the headers are read; with --frames every frame is, as `wentry process` does it.
    """
    from wentry_cli.cli.console import reporting, show_json
    from wentry_cli.runner import commands
    from wentry_cli.runner.inspect import inspect_sources

    campaign = commands.read_campaign(video_dir, settings, only)
    shared = {drop.name: None if drop.shared.path is None else str(drop.shared.path) for drop in campaign.drops}
    materials = {drop.name: str(drop.materials_path) if drop.material else None for drop in campaign.drops}
    with reporting(quiet=quiet, verbose=False) as report:
        seen = inspect_sources(campaign.drops, report if frames else None)
    campaign.failures += seen.failures
    if as_json:
        told = {failure.drop: failure.sentence for failure in campaign.failures}
        looked = {"damage": seen.damage} if frames else {}
        show_json({"drops": seen.facts, "campaign": shared, "materials": materials, "failures": told, **looked})
    else:
        for sentence in () if quiet else campaign.notes:
            click.echo(sentence, err=True)
        for failure in campaign.failures:
            named = "" if failure.stage == commands.CONFIGURATION else f"{failure.drop}: "  # else it names the file
            for line in failure.sentence.splitlines():
                click.echo(named + line, err=True)
        if not quiet:
            _show(seen.facts, {"campaign.yaml": shared, "materials.yaml": materials})
            if seen.facts and not frames:
                thorough = f"wentry check {video_dir} --frames"
                click.echo(f"headers alone were read; {thorough} reads every frame and names damaged ones", err=True)
    commands.raise_failures(campaign, "processed")


def _show(facts: dict[str, dict[str, str]], files: dict[str, dict[str, str | None]]) -> None:
    for name, views in facts.items():
        for file, used in files.items():
            click.echo(f"{name:24} {file}: {used[name] or 'none'}")
        for view, sentence in views.items():
            click.echo(f"{name:24} {view:5} {sentence}")
