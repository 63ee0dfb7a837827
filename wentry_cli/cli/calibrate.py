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


def _key(_ctx: click.Context, _param: click.Parameter, value: str) -> str:
    """A key for ``materials.csv``: one line of text that no spreadsheet takes for a formula."""
    from wentry_cli.config.values import is_formula, is_one_line

    if not value.strip() or not is_one_line(value) or is_formula(value):
        raise click.BadParameter(f"{value!r} is no key: it must be one line of text that does not begin with = + - @.")
    return value


@click.group(name="calibrate", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Material parameters from measured drops on a rigid surface, or from a compression test."""


@command.command(name="impact")
@opt.options(opt.results_argument, opt.dry_run, opt.only, opt.as_json, opt.quiet, opt.verbose)
def impact(
    results: Path, dry_run: bool, only: tuple[str, ...], as_json: bool, quiet: bool, verbose: bool
) -> None:  # fmt: skip
    """Fit ε̇₀ and n of each sphere to its surface impacts.

    All surface_impact drops in RESULTS of a sphere are fitted together, whatever their heights.
    """
    from wentry_cli.runner import commands
    from wentry_cli.stages import calibrate
    from wentry_cli.stages.calibrate.rows import rows_of

    campaign = commands.processed(results, only)
    spheres = calibrate.drops_by_sphere(results, campaign.drops)
    uses = {
        sphere: {drop.name: calibrate.why_unused(results, drop) for drop in drops} for sphere, drops in spheres.items()
    }
    if dry_run:
        _show_uses(uses, as_json)
        return
    if verbose:
        for line in _lines(uses):
            click.echo(line, err=True)
    with commands.locked(results):
        warnings = calibrate.calibrate_impact(results, campaign.drops)
    for sentence in warnings:
        click.echo(f"warning: {sentence}", err=True)
    _show_rows(rows_of(results, "impact", list(spheres)), as_json, quiet)
    if not quiet:
        click.echo(f"{results / 'materials.csv'}; next: wentry fit {results}", err=True)


@command.command(name="compression")
@click.argument("csv", type=opt.FOLDER)
@click.option("--diameter-m", type=Diameter(), required=True, help="Undeformed diameter of the sphere in metres.")
@click.option(
    "--material", callback=_key, default="sphere", show_default=True, help="Key for the row in materials.csv."
)
@opt.options(opt.results_option, opt.dry_run, opt.as_json, opt.quiet, opt.verbose)
def compression(
    csv: Path, diameter_m: float, material: str, results: Path, dry_run: bool, as_json: bool, quiet: bool, verbose: bool
) -> None:
    """Fit G∞ to a compression test.

    CSV holds force over displacement, with the header force_N and displacement_m or displacement_mm.
    """
    from wentry_cli.cli.console import show_json
    from wentry_cli.records import DROP
    from wentry_cli.runner import commands
    from wentry_cli.stages.calibrate import compression as calibrate
    from wentry_cli.stages.calibrate.rows import rows_of

    test = calibrate.read_compression(csv)  # before the lock, which makes the folder
    for sentence in test.warnings:
        click.echo(f"warning: {sentence}", err=True)
    facts = {
        "points": int(test.force_n.size),
        "greatest_displacement_m": float(test.displacement_m.max(initial=0.0)),
        "greatest_force_n": float(test.force_n.max(initial=0.0)),
        "material": material,
        "writes": str(results / "materials.csv"),
    }
    if dry_run and as_json:
        show_json(facts)
    elif dry_run or verbose:
        click.echo(
            f"{csv}: {facts['points']} points up to {facts['greatest_displacement_m']:.6g} m and "
            f"{facts['greatest_force_n']:.6g} N, for material {material} in {facts['writes']}",
            err=not dry_run,
        )
    if dry_run:
        return
    with commands.locked(results):
        fit = calibrate.calibrate_compression(test, diameter_m, results, material=material)
    if doubt := calibrate.doubt_of(fit):
        click.echo(f"warning: {csv}: {doubt}", err=True)
    (row,) = rows_of(results, "compression", [material])
    _show_rows([row | {"zero_m": fit.zero_offset_m, "zero_m_unc": fit.zero_offset_m_unc}], as_json, quiet)
    if not quiet:
        first = f"next: wentry fit {results}, then " if any(results.glob(f"*/{DROP}")) else ""
        click.echo(f"{results / 'materials.csv'}; {first}wentry report {results} draws the test", err=True)


Uses = dict[str, dict[str, str | None]]


def _lines(uses: Uses) -> list[str]:
    return [
        f"{sphere:24} {drop:24} {'used' if reason is None else f'not used: {reason}'}"
        for sphere, drops in uses.items()
        for drop, reason in drops.items()
    ]


def _show_uses(uses: Uses, as_json: bool) -> None:
    from wentry_cli.cli.console import show_json

    if as_json:
        show_json(uses)
    else:
        click.echo("\n".join(_lines(uses)))


def _show_rows(rows: list[dict[str, Any]], as_json: bool, quiet: bool) -> None:
    """What was found: as JSON, or a line a row with the fitted numbers."""
    from wentry_cli.cli.console import show_json
    from wentry_cli.stages.calibrate.rows import fitted_numbers

    if as_json:
        show_json(rows)
        return
    for row in rows if not quiet else ():
        click.echo(f"{row['sphere_id'] or row['material']} {fitted_numbers(row) or 'no number'} ({row['status']})")
