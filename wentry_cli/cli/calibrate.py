"""``wentry calibrate impact`` and ``wentry calibrate compression``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.group(name="calibrate", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Material parameters from measured drops on a rigid surface, or from a compression test."""


@command.command(name="impact")
@opt.options(opt.results_argument, opt.only, opt.quiet)
def impact(results: Path, only: tuple[str, ...], quiet: bool) -> None:
    """Fit ε̇₀ and n of each sphere to its surface_impact drops in RESULTS, all heights together."""
    from wentry_cli.runner import commands
    from wentry_cli.stages import calibrate

    campaign = commands.processed(results, only)
    with commands.locked(results):
        warnings = calibrate.calibrate_impact(results, campaign.drops)
    for sentence in warnings:
        click.echo(f"warning: {sentence}", err=True)
    if not quiet:
        click.echo(f"{results / 'materials.csv'}; next: wentry fit {results}", err=True)


@command.command(name="compression")
@click.argument("csv", type=opt.FOLDER)
@click.option("--diameter-m", type=float, required=True, help="Undeformed diameter of the sphere.")
@click.option("--material", default="sphere", show_default=True, help="Key for the row in materials.csv.")
@opt.options(opt.results_option, opt.quiet)
def compression(csv: Path, diameter_m: float, material: str, results: Path, quiet: bool) -> None:
    """Fit G∞ to the force-displacement test in CSV (header force_N and displacement_m or displacement_mm)."""
    from wentry_cli.runner import commands
    from wentry_cli.stages import calibrate

    with commands.locked(results):
        calibrate.calibrate_compression(csv, diameter_m, results, material=material)
    if not quiet:
        click.echo(f"{results / 'materials.csv'}", err=True)
