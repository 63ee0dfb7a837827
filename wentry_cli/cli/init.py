"""``wentry init``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="init")
@click.argument("folder", type=opt.FOLDER)
def command(folder: Path) -> None:
    """Write an experiment.yaml to fill in into FOLDER; recordings that lie there are named in it."""
    from wentry_cli.config.scaffold import write_scaffold

    path = write_scaffold(folder)
    click.echo(f"{path}: fill in the sphere and its material, then `wentry check {folder}`", err=True)
