"""``report.pdf``: the report on A4 pages in the order of the page, made with matplotlib alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from matplotlib.figure import Figure, SubFigure

from wentry_cli.report.campaign import as_text
from wentry_cli.report.drawing import Drawn, styled
from wentry_cli.report.letters import lines_within
from wentry_cli.report.page import Content, page_title
from wentry_cli.report.print_text import A4, LEFT, RIGHT, Line, closing_lines, heading, number_lines, title_lines
from wentry_cli.report.style import Look
from wentry_cli.report.symbols import as_mathtext
from wentry_cli.tables import replacing

NO_METADATA = {"CreationDate": None, "ModDate": None, "Producer": None, "Creator": "wentry", "Title": "wentry report"}
MARGINS = (LEFT, RIGHT - LEFT, 1.0 - RIGHT)
TOP_IN, FOOT_IN = 0.4, 0.4  # inches kept free
USED = A4[1] - TOP_IN - FOOT_IN
FOLLOWING = 2  # rows that go with a heading and the header of its table; of panels, one
BETWEEN = 0.04  # two narrow panels, over the width of one
SHRINK = 0.88  # three rows on a page
CAPTION: Look = {"fontsize": 5.8, "color": "#444444", "va": "top", "linespacing": 1.25}
FOOT: Look = {"fontsize": 6.0, "color": "#444444", "va": "bottom"}
LINE = 0.108  # inches of a line of a caption
HEAD = 0.24


@dataclass(frozen=True)
class Row:
    """Panels side by side: two narrow ones or a wide one."""

    panels: tuple[Drawn, ...]

    @property
    def height(self) -> float:
        """Inches of the page that the row takes."""
        lines = max(len(_caption_lines(drawn)) for drawn in self.panels)
        tallest = max(drawn.panel.size[1] for drawn in self.panels) * (SHRINK if _narrow(self.panels[0]) else 1.0)
        return tallest + HEAD + LINE * lines + 0.15


Item = Line | Row


def write_document(content: Content, path: Path) -> None:
    """Write the figures, the numbers, the drops one by one and the rest; without times, so that the bytes repeat."""
    pages = _onto_pages(list(_items(content)))
    version = as_text(content.campaign.run.get("version"))
    day = f"results of {content.campaign.date}" if content.campaign.date else ""
    told = ", ".join(part for part in (f"wentry {version}".strip(), day) if part)
    with replacing(path) as temporary, styled(), PdfPages(temporary, metadata=NO_METADATA) as document:
        for number, items in enumerate(pages, start=1):
            figure = _page(items)
            foot = ((LEFT, page_title(content.campaign)), (0.5, f"{number} of {len(pages)}"), (RIGHT, told))
            for (x, text), side in zip(foot, ("left", "center", "right"), strict=True):
                figure.text(x, 0.02, text, ha=side, **FOOT)
            # One pass; savefig would draw everything twice.
            FigureCanvasPdf(figure).print_pdf(document)  # type: ignore[no-untyped-call]


def _items(content: Content) -> Iterator[Item]:
    """Everything in order: figures, numbers, drop by drop, and what a reader looks up."""
    yield from title_lines(content)
    yield from _rows(content.figures)
    yield from number_lines(content)
    if content.details:
        yield from heading("Drop by drop")
    for drop in content.campaign.drops:
        yield from _rows([drawn for drawn in content.details if drawn.panel.drop == drop.name])
    yield from closing_lines(content)


def _narrow(drawn: Drawn) -> bool:
    return drawn.panel.size[0] < 5.0


def _rows(panels: Sequence[Drawn]) -> list[Row]:
    rows: list[Row] = []
    for panel in panels:
        if _narrow(panel) and rows and len(rows[-1].panels) == 1 and _narrow(rows[-1].panels[0]):
            rows[-1] = Row((*rows[-1].panels, panel))
        else:
            rows.append(Row((panel,)))
    return rows


def _onto_pages(items: Sequence[Item]) -> list[list[Item]]:
    """Fill pages in order; a heading stays with what follows it, a table that goes on has its header again."""
    pages: list[list[Item]] = [[]]
    used = 0.0
    for place, item in enumerate(items):
        if pages[-1] and used + _together(items[place:]) > USED:
            pages.append(list(item.header) if isinstance(item, Line) else [])
            used = sum(line.height for line in pages[-1])
        pages[-1].append(item)
        used += item.height
    return pages


def _together(items: Sequence[Item]) -> float:
    """Inches that the first item needs with what must not be parted from it: a heading and headers with their rows.

    A row in several lines stays together, unless it takes more than half a page.
    """
    bold = list(takewhile(_bold, items))
    rest = items[len(bold) :]
    if not rest or isinstance(rest[0], Row):
        return min(sum(item.height for item in (*bold, *rest[:1])), USED)
    row = rest[0].followed + 1
    lines = rest[: max(row, FOLLOWING) if bold else row]
    return sum(item.height for item in bold) + min(sum(item.height for item in lines), 0.5 * USED)


def _bold(item: Item) -> bool:
    return isinstance(item, Line) and item.bold


def _page(items: Sequence[Item]) -> Figure:
    figure = Figure(figsize=A4)
    y = TOP_IN
    for item in items:
        if isinstance(item, Line):
            for x, text in item.cells:
                weight = "bold" if item.bold else "normal"
                figure.text(x, 1.0 - y / A4[1], as_mathtext(text), va="top", fontsize=item.size, fontweight=weight)
        else:
            below = max(A4[1] - y - item.height, 0.01)
            grid = figure.add_gridspec(3, 3, height_ratios=(y, item.height, below), width_ratios=MARGINS)
            part = figure.add_subfigure(grid[1, 1])
            cells = part.subfigures(1, 2 if _narrow(item.panels[0]) else 1, squeeze=False, wspace=BETWEEN)[0]
            for cell, drawn in zip(cells, item.panels, strict=False):
                _panel_cell(cell, drawn, item.height)
        y += item.height
    return figure


def _caption_lines(drawn: Drawn) -> list[str]:
    width = MARGINS[1] * A4[0] * 72.0 * (0.5 if _narrow(drawn) else 1.0)
    return lines_within(drawn.panel.caption, 0.96 * width / CAPTION["fontsize"])


def _panel_cell(cell: SubFigure, drawn: Drawn, height: float) -> None:
    panel, lines = drawn.panel, _caption_lines(drawn)
    text = LINE * len(lines) + 0.12
    heights = [HEAD, max(height - HEAD - text, 0.5), text]
    head, body, foot = cell.subfigures(3, 1, height_ratios=heights, squeeze=False)[:, 0]
    name = f"{panel.key}  {panel.title}" if panel.key[0].isdigit() else panel.title
    head.text(0.0, 0.25, as_mathtext(name), fontsize=8.5, fontweight="bold", va="bottom")
    panel.draw(body)
    for ax, place in zip(body.axes, drawn.places, strict=True):
        ax.set_position(place)
    foot.text(0.0, 1.0 - 0.06 / text, "\n".join(map(as_mathtext, lines)), **CAPTION)
