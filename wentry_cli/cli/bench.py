"""``wentry bench``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from wentry_cli.cli import options as opt

if TYPE_CHECKING:
    from wentry_cli.bench.row import BenchRow

CHAPTERS = (
    "contours", "separation", "pinch_off", "top_clips", "sequences", "ball",
    "smoothers", "delta_u", "solvers", "extremes", "calibrations", "throughput",
)  # fmt: skip
PEERED = ("contours", "smoothers")  # compare ours with other packages
ALONE = ("throughput",)  # measures how fast the machine is when nothing else runs
OUTPUT = opt.Location(file_okay=False, path_type=Path)  # said before an hour is spent


@click.command(name="bench")
@click.option("--chapter", "chapters", multiple=True, type=click.Choice(CHAPTERS), help="This chapter only.")
@click.option("--quick", is_flag=True, help="Few items a case: a look, not a measurement.")
@click.option(
    "-j",
    "--jobs",
    default=1,
    show_default=True,
    type=click.IntRange(1, 64),
    help="Chapters at a time; whole recordings are measured alone.",
)
@click.option("--ours", is_flag=True, help="Without peers: of outlines and smoothers their rows in -o stay.")
@click.option("--seed", default=20170412, show_default=True, help="Seed of the test cases.")
@click.option("-o", "--output", type=OUTPUT, help="Renew accuracy.md in this folder; chapters not measured stay.")
@click.option(
    "--ball", type=click.Path(exists=True, path_type=Path), help="Recording of a falling ball (.cihx) for that chapter."
)
@opt.as_json
def command(
    chapters: tuple[str, ...],
    quick: bool,
    jobs: int,
    ours: bool,
    seed: int,
    output: Path | None,
    ball: Path | None,
    as_json: bool,
) -> None:
    """Measure speed against error: outlines, smoothers, ΔU, solvers and whole recordings, beside other methods."""
    from concurrent.futures import ProcessPoolExecutor
    from dataclasses import asdict
    from functools import partial
    from multiprocessing import get_context

    from wentry_cli.bench.kept import Chapter, check_folder, keep_peers, renew
    from wentry_cli.bench.page import write_page
    from wentry_cli.bench.table import HEAD, RULE, write_rows
    from wentry_cli.cli.console import show_json
    from wentry_cli.provenance import environment
    from wentry_cli.runner.work import single_threaded

    if output is not None:
        check_folder(output, quick)
    measure = partial(_chapter, quick=quick, seed=seed, ball=ball, peers=not ours)
    # without a recording of the ball that chapter of the page stays as it is
    wanted = chapters or tuple(name for name in CHAPTERS if ball is not None or name != "ball")
    found: dict[str, list[BenchRow]] = {}
    for count, group in ((jobs, [name for name in wanted if name not in ALONE]), (1, [*ALONE])):
        names = [name for name in group if name in wanted]
        with ProcessPoolExecutor(count, get_context("spawn"), initializer=single_threaded) as pool:
            found |= zip(names, pool.map(measure, names), strict=True)
    rows = [row for name in wanted for row in found[name]]
    if as_json:
        show_json([asdict(row) for row in rows])
    else:
        click.echo("\n".join([HEAD, RULE, *write_rows(rows)]))
    if output is not None:
        words = ["wentry bench", *(f"--chapter {name}" for name in chapters), *(["--quick"] if quick else [])]
        words += [f"-j {jobs}"] if jobs > 1 else []  # chapters beside each other share the caches: times are longer
        words += ["--ours"] if ours else []
        words += [f"--ball {ball.name}"] if ball is not None else []
        versions = ", ".join(f"{name} {version}" for name, version in environment().items())
        maker = (" ".join([*words, f"--seed {seed}"]), versions)
        fresh = [Chapter(name, found[name], maker) for name in wanted]
        if ours:
            fresh = [keep_peers(output, chapter) if chapter.name in PEERED else chapter for chapter in fresh]
        kept = renew(output, fresh, CHAPTERS)
        click.echo(str(write_page(kept, output, wanted)), err=True)


def _chapter(name: str, *, quick: bool, seed: int, ball: Path | None, peers: bool) -> list[BenchRow]:
    """Measure one chapter in a process of its own."""
    import importlib

    click.echo(f"{name} …", err=True)
    module = importlib.import_module(f"wentry_cli.bench.{name}")
    rows: list[BenchRow]
    if name == "ball":
        rows = module.run(ball)
    elif name in PEERED:
        rows = module.run(quick, seed, peers=peers)
    else:
        rows = module.run(quick, seed)
    return rows
