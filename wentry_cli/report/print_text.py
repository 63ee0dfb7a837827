"""Title page and tables of the PDF: lines of cells put on A4 pages."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from matplotlib.figure import Figure

from wentry_cli.report import tabulation
from wentry_cli.report.campaign import as_text
from wentry_cli.report.light_limit import light_limit_table
from wentry_cli.report.numbers import DASH
from wentry_cli.report.page import UNCERTAINTIES, Content, headline, page_title
from wentry_cli.report.style import plain
from wentry_cli.report.tabulation import TextTable

A4 = (8.27, 11.69)
LYING = A4[::-1]  # tables are wide
LEFT, RIGHT = 0.075, 0.925
TOP, BOTTOM = 0.94, 0.06
FOLLOWING = 4  # lines that go with a heading: itself, the header of its table and a row
LETTERS = 180  # of a line of text in the plain size
PLAIN = 7.0
SMALLEST = 5.8  # points; a table that needs smaller letters is printed as blocks
LETTER = 0.60  # mean width of a letter over its size


@dataclass(frozen=True)
class Line:
    """One line: cells with their place across the page (0 to 1), in one size."""

    cells: tuple[tuple[float, str], ...]
    size: float = PLAIN
    bold: bool = False

    @property
    def height(self) -> float:
        """Part of the page's height that the line takes."""
        return 1.62 * self.size / 72.0 / LYING[1]


def text_pages(content: Content) -> Iterator[Figure]:
    """Make the pages of text: title, drops, regressions, materials, failures, what is not drawn."""
    figure, y = Figure(figsize=LYING), TOP
    for line in _lines(content):
        needed = FOLLOWING * line.height if line.bold else line.height  # a heading is not left alone at the foot
        if y - needed < BOTTOM:
            yield figure
            figure, y = Figure(figsize=LYING), TOP
        for x, text in line.cells:
            weight = "bold" if line.bold else "normal"
            figure.text(x, y, plain(text), va="top", fontsize=line.size, fontweight=weight)
        y -= line.height
    yield figure


def _lines(content: Content) -> Iterator[Line]:
    campaign = content.campaign
    yield _text(page_title(campaign), 17.0, bold=True)
    version = as_text(campaign.run.get("version"))
    yield _text(f"wentry {version} report, {headline(campaign)}".replace("  ", " "), 9.0)
    for title, table in (
        ("Drops: value ± standard uncertainty (k = 1); a dash is not measured", tabulation.drop_table(campaign)),
        ("Pinch-off and loss of velocity", tabulation.entry_table(campaign)),
        ("Regressions", tabulation.regression_table(campaign)),
        ("Materials, calibrated", tabulation.material_table(campaign.materials)),
        ("Materials, used by the model", tabulation.material_table(campaign.table_1)),
        ("Stated uncertainty and the Cramér–Rao bound, medians over frames", light_limit_table(campaign)),
        ("Failures", tabulation.failure_table(campaign)),
        ("Provenance", tabulation.provenance_table(campaign)),
    ):
        if table.rows:
            yield from _head(title)
            yield from _table(table)
    if content.missing:
        yield from _head("Not drawn")
        for panel in content.missing:
            yield from _wrapped(f"{panel.key}, {panel.title}: {panel.reason}.")
    yield from _head("Uncertainties")
    yield from _wrapped(UNCERTAINTIES)


def _text(text: str, size: float = PLAIN, *, bold: bool = False) -> Line:
    return Line(((LEFT, text),), size, bold)


def _head(title: str) -> list[Line]:
    return [_text(""), _text(title, 10.0, bold=True)]


def _wrapped(text: str, indent: str = "") -> list[Line]:
    return [_text(line) for line in textwrap.wrap(text, LETTERS, initial_indent=indent, subsequent_indent=indent)]


def _table(table: TextTable) -> list[Line]:
    """Print a table in columns where it fits the page, else as a block for each row."""
    rows = [table.header, *table.rows]
    widths = [max(len(row[place]) for row in rows) + 2 for place in range(len(table.header))]
    size = min(PLAIN, (RIGHT - LEFT) * LYING[0] * 72.0 / (LETTER * sum(widths)))
    if size < SMALLEST:
        return _blocks(table)
    share = LETTER * size / 72.0 / LYING[0]
    places = [LEFT + share * sum(widths[:place]) for place in range(len(widths))]
    return [
        Line(tuple((x, text) for x, text in zip(places, row, strict=True) if text), size, row is table.header)
        for row in rows
    ]


def _blocks(table: TextTable) -> list[Line]:
    lines: list[Line] = []
    for row in table.rows:
        lines += [_text(part, bold=True) for part in textwrap.wrap(row[0], LETTERS) or [""]]
        cells = [f"{name} {cell}" for name, cell in zip(table.header[1:], row[1:], strict=True) if cell != DASH]
        lines += _wrapped("   ".join(cells), indent="    ")
    return lines
