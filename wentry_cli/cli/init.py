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
    """Write an experiment.yaml to fill in into FOLDER; recordings that lie there are named in it.

    A FOLDER that does not exist is made, and that is said; the one above it must exist.
    """
    from wentry_cli.config.scaffold import HERE, write_scaffold

    written = write_scaffold(folder, kind)
    if written.made:
        told = "did not exist and was made, without a recording; remove it if its name was mistyped"
        click.echo(f"{folder}: {told}", err=True)
    for view, source in written.sources.items():
        if source == HERE or "*" in source:
            click.echo(f"{folder}: its own images are the {view} view, source: {source}", err=True)
    for name in written.not_named:
        click.echo(
            f"{folder / name}: not named in it, since its name does not tell the view; if it is the other view of this "
            "drop, name it under views: side: or top:",
            err=True,
        )
    parts = ["the sphere", *([] if kind == "free_flight" else ["its material"]), *(["fps"] if written.asks_fps else [])]
    listed = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
    click.echo(f"{written.path}: fill in {listed}, then `wentry check {folder}`", err=True)
