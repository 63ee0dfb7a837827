"""Speed-against-error rows as a markdown page and as a figure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from wentry_cli.bench.row import BenchRow
from wentry_cli.provenance import environment
from wentry_cli.tables import write_text

HEAD = "| case | method | quantity | bias | RMSE | RMSE / bound | failures | µs per item | time / fastest | note |"
RULE = "|" + "---|" * 10
MARKS = "osD^vP*X<>"


def write_page(rows: list[BenchRow], folder: Path, command: str) -> Path:
    """Write ``accuracy.md`` and one ``accuracy_<chapter>.svg`` per chapter into ``folder``; returns the page."""
    parts = [
        "# Speed against error",
        f"Made by `{command}`; errors are against truths that the methods did not see, times are medians on one core "
        "of the machine named below and count only as ratios within one table.",
        "",
        ", ".join(f"{name} {version}" for name, version in environment().items()),
    ]
    for chapter, group in _by_chapter(rows):
        figure = folder / f"accuracy_{chapter}.svg"
        _draw(list(group), figure)
        parts += ["", f"## {chapter.capitalize()}", "", f"![time against error]({figure.name})", "", HEAD, RULE]
        parts += write_rows(group)
    page = folder / "accuracy.md"
    write_text(page, "\n".join(parts) + "\n")
    return page


def _by_chapter(rows: Iterable[BenchRow]) -> list[tuple[str, list[BenchRow]]]:
    return [(chapter, list(group)) for chapter, group in groupby(rows, key=lambda row: row.chapter)]


def write_rows(rows: list[BenchRow]) -> list[str]:
    """Markdown rows, with each time as a ratio to the fastest method of the same case."""
    fastest: dict[tuple[str, str], float] = {}
    for row in rows:
        key = (row.case, row.quantity)
        fastest[key] = min(fastest.get(key, math.inf), row.time_us)
    return [
        f"| {row.case} | {row.method} | {row.quantity}, {row.unit} | {_figure(row.bias)} | {_figure(row.rmse)} | "
        f"{_figure(row.ratio_to_bound)} | {row.failures:.1%} | {_figure(row.time_us)} | "
        f"{_figure(row.time_us / fastest[row.case, row.quantity])} | {row.note} |"
        for row in rows
    ]


def _figure(value: float) -> str:
    return "–" if not math.isfinite(value) else f"{value:.3g}"


def _draw(rows: list[BenchRow], path: Path) -> None:
    """Time per item against error, one mark a method, one panel a case of the first quantity."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    quantity = rows[0].quantity
    shown = [row for row in rows if row.quantity == quantity and math.isfinite(row.rmse) and row.time_us > 0]
    cases = list(dict.fromkeys(row.case for row in shown))[:6]
    methods = list(dict.fromkeys(row.method for row in rows))
    columns = min(3, len(cases)) or 1
    lines = math.ceil(len(cases) / columns) or 1
    with mpl.rc_context({"svg.hashsalt": "wentry", "svg.fonttype": "none", "font.size": 8}):
        figure = Figure(figsize=(3.0 * columns, 2.6 * lines + 0.8), layout="constrained")
        grid = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
        for axes in grid.ravel()[len(cases) :]:
            axes.axis("off")
        for axes, case in zip(grid.ravel(), cases, strict=False):
            axes.set_title(case, fontsize=8)
            for row in (row for row in shown if row.case == case):
                number = methods.index(row.method)
                axes.loglog(
                    row.time_us, row.rmse, MARKS[number % len(MARKS)], color=f"C{number % 10}", label=row.method
                )
            axes.set_xlabel("time per item, µs")
        grid[0, 0].set_ylabel(f"RMSE of {quantity}, {rows[0].unit}")
        handles = {
            label: handle
            for axes in grid.ravel()
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None})
