"""``wentry calibrate impact`` and ``wentry calibrate compression``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt


class Diameter(click.FloatRange):
    """A diameter in metres: above 0, at most 1; unlike the plain range it refuses NaN."""

    def __init__(self) -> None:
        """Set the bounds."""
        super().__init__(min=0.0, max=1.0, min_open=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, or a sentence that says what a diameter is."""
        number = float(click.FLOAT.convert(value, param, ctx))
        if not 0.0 < number <= 1.0:
            self.fail(f"{value} is no diameter in metres: it must be positive, finite and at most 1.", param, ctx)
        return number


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
@click.option("--diameter-m", type=Diameter(), required=True, help="Undeformed diameter of the sphere in metres.")
@click.option("--material", default="sphere", show_default=True, help="Key for the row in materials.csv.")
@opt.options(opt.results_option, opt.quiet)
def compression(csv: Path, diameter_m: float, material: str, results: Path, quiet: bool) -> None:
    """Fit G∞ to the force-displacement test in CSV (header force_N and displacement_m or displacement_mm)."""
    from wentry_cli.runner import commands
    from wentry_cli.stages import calibrate_compression as calibrate

    test = calibrate.read_compression(csv)  # before the lock, which makes the folder
    if test.warning:
        click.echo(f"warning: {test.warning}", err=True)
    with commands.locked(results):
        calibrate.calibrate_compression(test, diameter_m, results, material=material)
    if not quiet:
        click.echo(f"{results / 'materials.csv'}", err=True)
