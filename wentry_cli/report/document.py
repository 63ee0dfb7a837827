"""``report.pdf``: the same panels on A4 pages, made with matplotlib alone."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from matplotlib.figure import Figure, SubFigure

from wentry_cli.report.drawing import Drawn, styled
from wentry_cli.report.page import Content
from wentry_cli.report.print_text import A4, text_pages
from wentry_cli.report.style import Look, plain
from wentry_cli.tables import replacing

NO_METADATA = {"CreationDate": None, "ModDate": None, "Producer": None, "Creator": "wentry", "Title": "wentry report"}
MARGINS = (0.055, 0.89, 0.055)
USED = 11.05  # inches of a page's height that panels may take
SHRINK = 0.92  # three rows on a page
CAPTION: Look = {"fontsize": 5.8, "color": "#444444", "va": "top", "linespacing": 1.25}
LINE = 0.108  # inches of a line of a caption
HEAD = 0.24


def write_document(content: Content, path: Path) -> None:
    """Write title page, tables, figures, then the drops one by one; without dates, so that the bytes repeat."""
    with replacing(path) as temporary, styled(), PdfPages(temporary, metadata=NO_METADATA) as pages:
        for figure in _pages(content):
            # One pass; savefig would draw everything twice.
            FigureCanvasPdf(figure).print_pdf(pages)  # type: ignore[no-untyped-call]


def _pages(content: Content) -> Iterator[Figure]:
    yield from text_pages(content)
    for drawn in (content.figures, content.details):
        for group in _onto_pages(drawn):
            yield _panel_page(group)


def _narrow(drawn: Drawn) -> bool:
    return drawn.panel.size[0] < 5.0


def _onto_pages(panels: Sequence[Drawn]) -> Iterator[list[list[Drawn]]]:
    """Group panels into rows (two narrow ones or a wide one) and rows into pages."""
    rows: list[list[Drawn]] = []
    for panel in panels:
        if _narrow(panel) and rows and len(rows[-1]) == 1 and _narrow(rows[-1][0]):
            rows[-1].append(panel)
        else:
            rows.append([panel])
    page: list[list[Drawn]] = []
    for row in rows:
        if page and sum(map(_row_height, [*page, row])) > USED:
            yield page
            page = []
        page.append(row)
    if page:
        yield page


def _caption_lines(drawn: Drawn) -> list[str]:
    return textwrap.wrap(drawn.panel.caption, 82 if _narrow(drawn) else 170)


def _row_height(row: list[Drawn]) -> float:
    lines = max(len(_caption_lines(drawn)) for drawn in row)
    tallest = max(drawn.panel.size[1] for drawn in row) * (SHRINK if _narrow(row[0]) else 1.0)
    return tallest + HEAD + LINE * lines + 0.14


def _panel_page(rows: list[list[Drawn]]) -> Figure:
    figure = Figure(figsize=A4)
    heights = [*map(_row_height, rows)]
    middle = figure.subfigures(1, 3, squeeze=False, width_ratios=MARGINS)[0, 1]
    top = 0.3
    rest = max(A4[1] - sum(heights) - top, 0.01)
    parts = middle.subfigures(len(rows) + 2, 1, height_ratios=[top, *heights, rest], squeeze=False)[1:-1, 0]
    for part, row, height in zip(parts, rows, heights, strict=True):
        cells = part.subfigures(1, 2 if _narrow(row[0]) else 1, squeeze=False)[0]
        for cell, drawn in zip(cells, row, strict=False):
            _panel_cell(cell, drawn, height)
    return figure


def _panel_cell(cell: SubFigure, drawn: Drawn, height: float) -> None:
    panel, lines = drawn.panel, _caption_lines(drawn)
    text = LINE * len(lines) + 0.1
    heights = [HEAD, max(height - HEAD - text, 0.5), text]
    head, body, foot = cell.subfigures(3, 1, height_ratios=heights, squeeze=False)[:, 0]
    name = f"{panel.key}  {panel.title}" if panel.key[0].isdigit() else panel.title
    head.text(0.02, 0.25, plain(name), fontsize=8.5, fontweight="bold", va="bottom")
    panel.draw(body)
    for ax, place in zip(body.axes, drawn.places, strict=True):
        ax.set_position(place)
    foot.text(0.02, 0.98, "\n".join(map(plain, lines)), **CAPTION)
