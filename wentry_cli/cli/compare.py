"""``wentry compare``."""

from __future__ import annotations

from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="compare")
@click.argument("results", type=opt.FOLDER)
@click.argument("truth", type=opt.FOLDER)
@opt.options(opt.only, opt.as_json)
def command(results: Path, truth: Path, only: tuple[str, ...], as_json: bool) -> None:
    """Errors of RESULTS against TRUTH: a rendered campaign, or a CSV with `frame` and hand-tracked columns."""
    from wentry_cli.cli.console import show_json
    from wentry_cli.comparison.campaign import compare

    lines = [line.row() for line in compare(results, truth, only)]
    if as_json:
        show_json(lines)
        return
    click.echo(
        f"{'drop':20} {'table':16} {'quantity':18} {'n':>9} {'bias':>11} {'rmse':>11} {'pull':>6} {'>3u':>6}  unit"
    )
    for line in lines:
        share = f"{line['measured']}/{line['measurable']}"
        click.echo(
            f"{line['drop']:20} {line['table']:16} {line['quantity']:18} {share:>9} {line['bias']:11.3g} "
            f"{line['rmse']:11.3g} {line['pull']:6.2f} {line['beyond_3']:6.1%}  {line['unit']} {line['note']}"
        )
