"""``wentry run``: process, fit and report in a row."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="run")
@opt.options(
    opt.video_dir,
    opt.results_option,
    opt.jobs,
    opt.cluster,
    opt.dry_run,
    opt.force("process", "fit"),
    opt.settings,
    opt.only,
    opt.as_json,
    opt.quiet,
    opt.verbose,
)
def command(
    video_dir: Path, results: Path, jobs: int, cluster: str | None, dry_run: bool, force: str | None,
    settings: tuple[str, ...], only: tuple[str, ...], as_json: bool, quiet: bool, verbose: bool,
) -> None:  # fmt: skip
    """Process VIDEO_DIR into RESULTS, fit and report. Drops that fail do not stop the others."""
    from wentry_cli.cli.console import reporting, show_json, show_plan
    from wentry_cli.runner import commands
    from wentry_cli.runner.campaign import Hands
    from wentry_cli.runner.plan import Choice
    from wentry_cli.stages import report as report_stage

    campaign = commands.read_campaign(video_dir, settings, only)
    choice = Choice(force)
    if dry_run:
        show_plan(commands.plans(campaign, results, ("process", "fit"), choice), as_json=as_json)
        for failure in campaign.failures:
            click.echo(failure.sentence, err=True)
        commands.raise_failures(campaign)
        return
    with commands.locked(results):
        with reporting(quiet=quiet, verbose=verbose) as report:
            commands.tell_failures(campaign, report)
            commands.process(campaign, results, choice, Hands(jobs, cluster), report)
            campaign.drops = [drop.with_calibration(results) for drop in campaign.drops]
            commands.fit(campaign, results, choice, Hands(jobs, cluster), report)
        record = commands.finish(campaign, results, "run")
        report_stage.run(results, commands.processed(results).drops)
    if as_json:
        show_json(record)
    commands.raise_failures(campaign)
    if not quiet and not as_json:
        click.echo(f"{opt.counted(len(campaign.drops), 'drop')} done; open {results / 'report.html'}", err=True)
