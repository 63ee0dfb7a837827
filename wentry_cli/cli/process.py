"""``wentry process``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


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
def command(
    video_dir: Path, results: Path, jobs: int, cluster: str | None, dry_run: bool, until: str | None, force: str | None,
    settings: tuple[str, ...], only: tuple[str, ...], verify: bool, as_json: bool, quiet: bool, verbose: bool,
) -> None:  # fmt: skip
    """Measure every drop in VIDEO_DIR and write its tables into RESULTS.

    VIDEO_DIR is a drop (a folder with experiment.yaml) or a campaign (a folder of drops, at any depth). What is done
    and unchanged is not done again.
    """
    from wentry_cli.cli.console import reporting, show_json, show_plan
    from wentry_cli.runner import commands
    from wentry_cli.runner.campaign import Hands
    from wentry_cli.runner.plan import Choice

    campaign = commands.read_campaign(video_dir, settings, only)
    choice = Choice(force, until, verify)
    if dry_run:
        show_plan(commands.plans(campaign, results, ("process",), choice), as_json=as_json)
        for failure in campaign.failures:
            click.echo(failure.sentence, err=True)
        commands.raise_failures(campaign)
        return
    with commands.locked(results):
        with reporting(quiet=quiet, verbose=verbose) as report:
            commands.tell_failures(campaign, report)
            commands.process(campaign, results, choice, Hands(jobs, cluster), report)
        record = commands.finish(campaign, results, "process")
    if as_json:
        show_json(record)
    commands.raise_failures(campaign)
    if not quiet and not as_json:
        click.echo(f"{opt.counted(len(campaign.drops), 'drop')} measured; next: wentry fit {results}", err=True)
