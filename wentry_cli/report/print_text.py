"""Title, tables and words of the PDF: lines of cells to be put on A4 pages."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from wentry_cli.report import tabulation
from wentry_cli.report.light_limit import light_limit_table
from wentry_cli.report.numbers import DASH
from wentry_cli.report.page import UNCERTAINTIES, Content, headline, page_title
from wentry_cli.report.tabulation import TextTable
from wentry_cli.report.words import MEANINGS

A4 = (8.27, 11.69)
LEFT, RIGHT = 0.075, 0.925
PLAIN = 7.0
SMALLEST = 5.8  # points; a table that needs smaller letters is printed in parts
LETTER = 0.60  # mean width of a letter over its size
WIDTH_PT = (RIGHT - LEFT) * A4[0] * 72.0
LETTERS = 127  # of a line of text in the plain size


@dataclass(frozen=True)
class Line:
    """One line: cells with their place across the page (0 to 1), in one size."""

    cells: tuple[tuple[float, str], ...]
    size: float = PLAIN
    bold: bool = False

    @property
    def height(self) -> float:
        """Inches of the page that the line takes."""
        return 1.62 * self.size / 72.0


def title_lines(content: Content) -> list[Line]:
    """What the report is about, and of how many drops."""
    campaign = content.campaign
    return [_text(page_title(campaign), 17.0, bold=True), _text(headline(campaign), 9.0), _text("")]


def number_lines(content: Content) -> Iterator[Line]:
    """Drops, regressions and materials, as far as there are any."""
    campaign = content.campaign
    for title, table in (
        ("Drops: value ± standard uncertainty (k = 1); a dash is not measured", tabulation.drop_table(campaign)),
        ("Pinch-off and loss of velocity", tabulation.entry_table(campaign)),
        ("Regressions", tabulation.regression_table(campaign)),
        ("Materials, calibrated", tabulation.material_table(campaign.materials)),
        ("Materials, used by the model", tabulation.material_table(campaign.table_1)),
    ):
        yield from _titled(title, table)


def closing_lines(content: Content) -> Iterator[Line]:
    """What is not drawn and what failed, status words, uncertainties and provenance."""
    campaign = content.campaign
    if content.missing:
        yield from heading("Not drawn")
        for panel in content.missing:
            yield from _wrapped(f"{panel.key}, {panel.title}: {panel.reason}.")
    yield from heading("Failures")
    failures = tabulation.failure_table(campaign)
    yield from _table(failures) if failures.rows else [_text("None.")]
    yield from heading("Warnings")
    warnings = tabulation.warning_table(campaign)
    yield from _table(warnings) if warnings.rows else [_text("None.")]
    if campaign.drops:
        yield from heading("Status words")
        counts = tabulation.status_table(campaign)
        yield from [*_table(counts), _text("")] if counts.rows else []
        yield from _table(TextTable(("word", "meaning"), tuple(MEANINGS.items())))
    yield from heading("Uncertainties")
    yield from _wrapped(UNCERTAINTIES)
    yield from _titled("Stated uncertainty and the Cramér–Rao bound, medians over frames", light_limit_table(campaign))
    yield from _titled("Provenance", tabulation.provenance_table(campaign))
    yield from _titled("Recordings", tabulation.input_table(campaign))


def heading(title: str) -> list[Line]:
    """A heading with room above it."""
    return [_text(""), _text(title, 10.0, bold=True)]


def _titled(title: str, table: TextTable) -> list[Line]:
    return [*heading(title), *_table(table)] if table.rows else []


def _text(text: str, size: float = PLAIN, *, bold: bool = False) -> Line:
    return Line(((LEFT, text),), size, bold)


def _wrapped(text: str, indent: str = "") -> list[Line]:
    return [_text(line) for line in textwrap.wrap(text, LETTERS, initial_indent=indent, subsequent_indent=indent)]


def _table(table: TextTable) -> list[Line]:
    """Print a table in columns where it fits the page, else its columns in parts, else a block for each row."""
    rows = [table.header, *table.rows]
    widths = [max(len(row[place]) for row in rows) + 2 for place in range(len(table.header))]
    size = min(PLAIN, WIDTH_PT / (LETTER * sum(widths)))
    if size < SMALLEST:
        parts = _parts(widths)
        if len(parts) == 1:
            return _blocks(table)
        return [line for part in parts for line in [*_table(_columns(table, part)), _text("", 4.0)]]
    share = LETTER * size / 72.0 / A4[0]
    places = [LEFT + share * sum(widths[:place]) for place in range(len(widths))]
    return [
        Line(tuple((x, text) for x, text in zip(places, row, strict=True) if text), size, row is table.header)
        for row in rows
    ]


def _parts(widths: list[int]) -> list[list[int]]:
    """Share columns among parts that fit the page, each with the first column; a single part where one cannot fit."""
    room = WIDTH_PT / (LETTER * PLAIN) - widths[0]
    parts: list[list[int]] = [[0]]
    left = room
    for place in range(1, len(widths)):
        if widths[place] > room:
            return [list(range(len(widths)))]
        if widths[place] > left:
            parts.append([0])
            left = room
        parts[-1].append(place)
        left -= widths[place]
    return parts


def _columns(table: TextTable, places: list[int]) -> TextTable:
    header, *rows = (tuple(row[i] for i in places) for row in (table.header, *table.rows))
    return TextTable(header, tuple(rows))


def _blocks(table: TextTable) -> list[Line]:
    lines: list[Line] = []
    for row in table.rows:
        lines += [_text(part, bold=True) for part in textwrap.wrap(row[0], LETTERS) or [""]]
        cells = [f"{name} {cell}" for name, cell in zip(table.header[1:], row[1:], strict=True) if cell != DASH]
        lines += _wrapped("   ".join(cells), indent="    ")
    return lines
