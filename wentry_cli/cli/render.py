"""``wentry render``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="render")
@click.argument("scenes", type=opt.FOLDER)
@click.option("-o", "--output", type=opt.FOLDER, default=Path("demo"), show_default=True, help="Folder to write into.")
@opt.options(opt.jobs, opt.only, opt.quiet)
def command(scenes: Path, output: Path, jobs: int, only: tuple[str, ...], quiet: bool) -> None:
    """Draw the synthetic drops of the YAML file SCENES, both views, with experiment.yaml and truth/ beside them."""
    from wentry_cli.runner.lock import locked
    from wentry_cli.synthetic.campaign import render_campaign
    from wentry_cli.synthetic.drop_folder import refuse_recordings
    from wentry_cli.synthetic.scenes_file import load_scenes

    def progress(done: int, total: int) -> None:
        if not quiet:
            click.echo(f"{done} of {opt.counted(total, 'drop')} drawn", err=True)

    load_scenes(scenes)  # before anything is written
    refuse_recordings(output)
    with locked(output):
        names = render_campaign(scenes, output, jobs=jobs, only=only, progress=progress)
    if not quiet:
        click.echo(f"{opt.counted(len(names), 'drop')} in {output}; next: wentry run {output}", err=True)
