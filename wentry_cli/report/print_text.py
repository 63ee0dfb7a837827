"""Title, tables and words of the PDF: lines of cells to be put on A4 pages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest

from wentry_cli.report import regressions, run_tables, tabulation
from wentry_cli.report.letters import lines_within, width_em
from wentry_cli.report.light_limit import light_limit_table
from wentry_cli.report.page import UNCERTAINTIES, Content, headline, page_title
from wentry_cli.report.tabulation import TextTable
from wentry_cli.report.words import MEANINGS

A4 = (8.27, 11.69)
LEFT, RIGHT = 0.075, 0.925
TITLE, PLAIN = 17.0, 7.0
SMALLEST = 5.8  # points; a table that needs smaller letters is printed in parts
WIDTH_PT = (RIGHT - LEFT) * A4[0] * 72.0
GAP = 1.2  # between columns; like the two below in sizes of a letter
NARROWEST = 16.0  # of a column whose cells are broken into lines
WIDEST_NAME = 24.0  # of the first column of a table that is printed in parts; wider columns may be narrowed to it


@dataclass(frozen=True)
class Line:
    """One line: cells with their place across the page (0 to 1), in one size."""

    cells: tuple[tuple[float, str], ...]
    size: float = PLAIN
    bold: bool = False
    followed: int = 0  # lines that belong to the same row
    header: tuple[Line, ...] = ()  # of a row of a table: to be repeated where the table goes on on another page

    @property
    def height(self) -> float:
        """Inches of the page that the line takes."""
        return 1.62 * self.size / 72.0


def title_lines(content: Content) -> list[Line]:
    """What the report is about, and of how many drops."""
    title = page_title(content.campaign)
    size = min(TITLE, WIDTH_PT / width_em(title, bold=True))
    return [_text(title, size, bold=True), *_wrapped(headline(content.campaign), 9.0), _text("")]


def number_lines(content: Content) -> Iterator[Line]:
    """Drops, regressions and materials, as far as there are any."""
    campaign = content.campaign
    checks = tabulation.check_table(campaign)
    for title, table in (
        ("Drops: value ± standard uncertainty (k = 1); a dash is not measured", tabulation.drop_table(campaign)),
        ("What was told of the drops, and what was measured", checks),
        ("Pinch-off and loss of velocity", tabulation.entry_table(campaign)),
        ("Free flight: velocity in the middle of the clip, acceleration", tabulation.flight_table(campaign)),
        ("Regressions", regressions.regression_table(campaign)),
        ("Materials, calibrated", tabulation.material_table(campaign.materials)),
        ("Materials, used by the model", tabulation.material_table(campaign.table_1)),
    ):
        yield from _titled(title, table)
        if table is checks and table.rows:
            yield from _wrapped(tabulation.check_note(campaign))


def closing_lines(content: Content) -> Iterator[Line]:
    """What is not drawn and what failed, status words, uncertainties and provenance."""
    campaign = content.campaign
    if content.missing:
        yield from heading("Not drawn")
        for panel in content.missing:
            yield from _wrapped(f"{panel.key}, {panel.title}: {panel.reason}.")
    yield from heading("Failures")
    failures = run_tables.failure_table(campaign)
    yield from _table(failures) if failures.rows else [_text("None.")]
    yield from heading("Warnings")
    warnings = run_tables.warning_table(campaign)
    yield from _table(warnings) if warnings.rows else [_text("None.")]
    if campaign.drops:
        yield from heading("Status words")
        counts = run_tables.status_table(campaign)
        yield from [*_table(counts), _text("")] if counts.rows else []
        yield from _table(TextTable(("word", "meaning"), tuple(MEANINGS.items())))
    yield from heading("Uncertainties")
    for paragraph in UNCERTAINTIES:
        yield from _wrapped(paragraph)
    yield from _titled("Stated uncertainty and the Cramér–Rao bound, medians over frames", light_limit_table(campaign))
    yield from _titled("Provenance", run_tables.provenance_table(campaign))
    yield from _titled("Recordings", run_tables.recording_table(campaign))
    yield from _titled("Identity of the recordings", run_tables.input_table(campaign))


def heading(title: str) -> list[Line]:
    """A heading with room above it."""
    return [_text(""), _text(title, 10.0, bold=True)]


def _titled(title: str, table: TextTable) -> list[Line]:
    return [*heading(title), *_table(table)] if table.rows else []


def _text(text: str, size: float = PLAIN, *, bold: bool = False) -> Line:
    return Line(((LEFT, text),), size, bold)


def _wrapped(text: str, size: float = PLAIN, *, bold: bool = False) -> list[Line]:
    return [_text(line, size, bold=bold) for line in lines_within(text, WIDTH_PT / size, bold=bold)]


def _table(table: TextTable) -> list[Line]:
    """Print a table in columns, cells in as many lines as they need; in parts where its columns get too narrow."""
    rows = [table.header, *table.rows]
    widths = [
        max(width_em(row[place], bold=row is table.header) for row in rows) + GAP for place in range(len(table.header))
    ]
    size = min(PLAIN, WIDTH_PT / sum(widths))
    if size >= SMALLEST:
        return _grid(table, widths, size)
    room = WIDTH_PT / PLAIN
    shared = _shared(widths, room)
    if max(shared) >= NARROWEST:
        return _grid(table, shared, PLAIN)
    first = min(widths[0], WIDEST_NAME)
    widths = [first, *(min(width, room - first) for width in widths[1:])]
    lines: list[Line] = []
    for part in _parts(widths, room):
        lines += [*_grid(_columns(table, list(part)), list(part.values()), PLAIN), _text("", 4.0)]
    return lines


def _grid(table: TextTable, widths: list[float], size: float) -> list[Line]:
    """Lines of a table whose columns are ``widths`` wide (over the size of the letters, with the gap after them)."""
    places = [LEFT + sum(widths[:place]) * size / 72.0 / A4[0] for place in range(len(widths))]

    def lines_of(row: tuple[str, ...], header: tuple[Line, ...] | None) -> list[Line]:
        bold = header is None
        cells = [lines_within(text, width - GAP + 0.01, bold=bold) for text, width in zip(row, widths, strict=True)]
        count = max(map(len, cells)) - 1
        return [
            Line(tuple(c for c in zip(places, line, strict=True) if c[1]), size, bold, count - number, header or ())
            for number, line in enumerate(zip_longest(*cells, fillvalue=""))
        ]

    header = tuple(lines_of(table.header, None))
    return [*header, *(line for row in table.rows for line in lines_of(row, header))]


def _shared(widths: list[float], room: float) -> list[float]:
    """Narrow the widest columns, all to one width, until the table fits ``room``."""
    left = room
    for count, width in zip(range(len(widths), 0, -1), sorted(widths), strict=True):
        if width * count > left:
            return [min(one, left / count) for one in widths]
        left -= width
    return widths


def _parts(widths: list[float], room: float) -> list[dict[int, float]]:
    """Share columns (place: width) among parts that fit ``room``, each with the first column; wide ones narrowed."""
    parts: list[dict[int, float]] = [{0: widths[0]}]
    left = room - widths[0]
    for place in range(1, len(widths)):
        width = widths[place]
        if width > left + 1e-9:
            if left < WIDEST_NAME or width < WIDEST_NAME:
                parts.append({0: widths[0]})
                left = room - widths[0]
            width = min(width, left)
        parts[-1][place] = width
        left -= width
    return parts


def _columns(table: TextTable, places: list[int]) -> TextTable:
    header, *rows = (tuple(row[i] for i in places) for row in (table.header, *table.rows))
    return TextTable(header, tuple(rows))
