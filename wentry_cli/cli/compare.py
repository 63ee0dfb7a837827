"""``wentry compare``."""

from __future__ import annotations

import math
from pathlib import Path

import click

from wentry_cli.cli import options as opt


@click.command(name="compare")
@click.argument("results", type=opt.FOLDER)
@click.argument("truth", type=opt.FOLDER)
@opt.options(opt.only, opt.as_json)
def command(results: Path, truth: Path, only: tuple[str, ...], as_json: bool) -> None:
    """Errors of RESULTS against TRUTH: a rendered campaign, or a CSV with `frame` or `t_s` and
    hand-tracked columns such as y_b_m.

    n: values measured of those that can be; pull: rms of the errors over the stated uncertainties, 1 where these are
    honest; >3u: share of errors beyond three of them; – where no uncertainty is stated. What errs by the
    same in all frames (row of the surface, moment of impact, scale) is in the uncertainty of each row, so that the
    pull of a single drop may lie far below 1: it is the campaign that tells.
    """
    from wentry_cli.cli.console import show_json
    from wentry_cli.comparison.campaign import compare

    lines = [line.row() for line in compare(results, truth, only)]
    if as_json:
        show_json(lines)
        return
    width = max([len(line["drop"]) for line in lines], default=4)
    click.echo(
        f"{'drop':{width}} {'table':16} {'quantity':22} {'n':>9} {'bias':>11} {'rmse':>11} {'pull':>6} {'>3u':>6}  unit"
    )
    for line in lines:
        share = f"{line['measured']}/{line['measurable']}"
        numbers = [
            f"{_or_dash(line['bias'], '.3g'):>11}",
            f"{_or_dash(line['rmse'], '.3g'):>11}",
            f"{_or_dash(line['pull'], '.2f'):>6}",
            f"{_or_dash(line['beyond_3'], '.1%'):>6}",
        ]
        named = f"{line['drop']:{width}} {line['table']:16} {line['quantity']:22} {share:>9}"
        click.echo(f"{named} {' '.join(numbers)}  {line['unit']} {line['note']}".rstrip())


def _or_dash(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"
