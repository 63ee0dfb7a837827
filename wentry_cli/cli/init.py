"""``wentry init``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="init")
@click.argument("folder", type=opt.FOLDER)
@click.option(
    "--kind",
    type=click.Choice(["water_entry", "surface_impact", "free_flight"]),
    default="water_entry",
    show_default=True,
    help="What the drop is: into water, onto a rigid surface, or a flight alone.",
)
def command(folder: Path, kind: str) -> None:
    """Write an experiment.yaml to fill in into FOLDER; recordings that lie there are named in it."""
    from wentry_cli.config.scaffold import write_scaffold

    path = write_scaffold(folder, kind)
    parts = "the sphere" if kind == "free_flight" else "the sphere and its material"
    click.echo(f"{path}: fill in {parts}, then `wentry check {folder}`", err=True)
