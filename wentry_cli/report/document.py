"""``report.pdf``: the same panels on A4 pages, made with matplotlib alone."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure, SubFigure

from wentry_cli.report import tabulation
from wentry_cli.report.drawing import styled
from wentry_cli.report.numbers import DASH
from wentry_cli.report.page import Content, headline
from wentry_cli.report.panel import Panel
from wentry_cli.report.style import Look, plain
from wentry_cli.report.tabulation import TextTable
from wentry_cli.tables import replacing

A4 = (8.27, 11.69)
NO_METADATA = {"CreationDate": None, "ModDate": None, "Producer": None, "Creator": "wentry", "Title": "wentry report"}
CAPTION: Look = {"fontsize": 6.3, "color": "#444444", "va": "top", "linespacing": 1.25}
USED = 10.4  # inches of a page's height that panels may take
LINES = 66  # of a page of text
LETTERS = 118


def write_document(content: Content, path: Path) -> None:
    """Write title page, tables, figures, then the drops one by one; without dates, so that the bytes repeat."""
    with replacing(path) as temporary, styled(), PdfPages(temporary, metadata=NO_METADATA) as pages:
        for figure in _pages(content):
            pages.savefig(figure)


def _pages(content: Content) -> Iterator[Figure]:
    yield from _text_pages(_front(content))
    for group in _onto_pages([drawn.panel for drawn in content.figures]):
        yield _panel_page(group)
    for group in _onto_pages([drawn.panel for drawn in content.details]):
        yield _panel_page(group)


def _front(content: Content) -> list[str]:
    campaign = content.campaign
    version = campaign.run.get("version", "")
    lines = ["# Water entry of deformable spheres", f"wentry {version} report: {headline(campaign)}", ""]
    for title, table in (
        ("Drops", tabulation.drop_table(campaign)),
        ("Regressions", tabulation.regression_table(campaign)),
        ("Failures", tabulation.failure_table(campaign)),
    ):
        if table.rows:
            lines += ["", f"# {title}", *_as_lines(table)]
    if content.missing:
        lines += ["", "# Not drawn"]
        for panel in content.missing:
            lines += textwrap.wrap(f"{panel.key}, {panel.title}: {panel.reason}.", LETTERS, subsequent_indent="   ")
    lines += ["", "± is a standard uncertainty (k = 1); intervals of regressions are 95 % bootstrap intervals."]
    return lines


def _as_lines(table: TextTable) -> list[str]:
    """Print a table as a block for each row: wide tables do not fit a page."""
    lines: list[str] = []
    for row in table.rows:
        cells = [f"{name} {cell}" for name, cell in zip(table.header[1:], row[1:], strict=True) if cell != DASH]
        lines.append(f"* {row[0]}")
        lines += textwrap.wrap("   ".join(cells), LETTERS - 4, initial_indent="    ", subsequent_indent="    ")
    return lines


def _text_pages(lines: list[str]) -> Iterator[Figure]:
    for start in range(0, len(lines), LINES):
        figure = Figure(figsize=A4)
        for place, line in enumerate(lines[start : start + LINES]):
            head = line.startswith("# ")
            text = plain(line.removeprefix("# ").replace("* ", "", 1) if line.startswith(("# ", "* ")) else line)
            look: Look = {
                "fontsize": 11.0 if head else 7.0,
                "fontweight": "bold" if line[:2] in {"# ", "* "} else "normal",
            }
            figure.text(0.08, 0.95 - 0.0137 * place, text, va="top", **look)
        yield figure


def _onto_pages(panels: Sequence[Panel]) -> Iterator[list[list[Panel]]]:
    """Group panels into rows (two narrow ones or a wide one) and rows into pages."""
    rows: list[list[Panel]] = []
    for panel in panels:
        narrow = panel.size[0] < 5.0
        if narrow and rows and len(rows[-1]) == 1 and rows[-1][0].size[0] < 5.0:
            rows[-1].append(panel)
        else:
            rows.append([panel])
    page: list[list[Panel]] = []
    for row in rows:
        if page and sum(map(_row_height, [*page, row])) > USED:
            yield page
            page = []
        page.append(row)
    if page:
        yield page


def _caption_lines(panel: Panel) -> list[str]:
    return textwrap.wrap(panel.caption, 82 if panel.size[0] < 5.0 else 165)


def _row_height(row: list[Panel]) -> float:
    tallest = max(panel.size[1] for panel in row)
    lines = max(len(_caption_lines(panel)) for panel in row)
    return tallest + 0.36 + 0.115 * lines


def _panel_page(rows: list[list[Panel]]) -> Figure:
    figure = Figure(figsize=A4, layout="constrained")
    heights = [*map(_row_height, rows)]
    rest = max(A4[1] - sum(heights), 0.01)
    parts = figure.subfigures(len(rows) + 1, 1, height_ratios=[*heights, rest], squeeze=False)[:, 0]
    for part, row, height in zip(parts, rows, heights, strict=False):
        wide = row[0].size[0] >= 5.0
        cells = part.subfigures(1, 1 if wide else 2, squeeze=False)[0]
        for cell, panel in zip(cells, row, strict=False):
            _panel_cell(cell, panel, height)
    return figure


def _panel_cell(cell: SubFigure, panel: Panel, height: float) -> None:
    lines = _caption_lines(panel)
    text = 0.115 * len(lines) + 0.06
    heights = [0.24, max(height - 0.24 - text, 0.5), text]
    head, body, foot = cell.subfigures(3, 1, height_ratios=heights, squeeze=False)[:, 0]
    name = f"{panel.key}  {panel.title}" if panel.key[0].isdigit() else panel.title
    head.text(0.04, 0.25, plain(name), fontsize=8.5, fontweight="bold", va="bottom")
    panel.draw(body)
    foot.text(0.04, 0.98, "\n".join(map(plain, lines)), **CAPTION)
