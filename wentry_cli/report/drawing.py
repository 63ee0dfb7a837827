"""From a panel to files: SVG, PNG and the table behind it, with the same bytes for the same results."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from wentry_cli.report.panel import Panel
from wentry_cli.report.style import STYLE
from wentry_cli.tables import FLOAT_FORMAT, replacing, write_text

DOTS_PER_INCH = 200
NO_METADATA = {
    "svg": {"Date": None, "Creator": None, "Format": None, "Type": None},
    "png": {"Software": None},
}


Place = tuple[float, float, float, float]  # left, bottom, width, height over the figure's size


@dataclass(frozen=True)
class Drawn:
    """A panel with the picture that went to disk and the places of its axes."""

    panel: Panel
    svg: bytes
    places: tuple[Place, ...]


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the report's style; letters that the font lacks (names of drops) become boxes without a warning."""
    look: Any = STYLE
    mathematics = logging.getLogger("matplotlib.mathtext")  # tells a missing letter of a text with symbols in its log
    with mpl.rc_context(look), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*[Gg]lyph.*")
        mathematics.addFilter(_not_of_glyphs)
        try:
            yield
        finally:
            mathematics.removeFilter(_not_of_glyphs)


def _not_of_glyphs(record: logging.LogRecord) -> bool:
    return "glyph" not in record.msg and "dummy symbol" not in record.msg


def draw_panel(panel: Panel) -> Figure:
    """Draw a panel on a figure of its own; call inside ``styled``."""
    figure = Figure(figsize=panel.size, dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    panel.draw(figure)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine("none")
    for ax in figure.axes:  # the solver of the layout leaves a different last digit from run to run
        ax.set_position(_place(ax))
    return figure


def _place(ax: Axes) -> Place:
    left, bottom, width, height = (round(float(part), 5) for part in ax.get_position(original=True).bounds)
    return left, bottom, width, height


def save_panel(panel: Panel, folder: Path) -> Drawn:
    """Write ``<stem>.svg``, ``<stem>.png`` and ``<stem>.csv`` into ``folder``."""
    with styled():
        figure = draw_panel(panel)
        pictures = _pictures(figure)
    for kind, picture in pictures.items():
        with replacing(folder / f"{panel.stem}.{kind}") as temporary:
            temporary.write_bytes(picture)
    text = panel.data.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    write_text(folder / f"{panel.stem}.csv", text)
    return Drawn(panel, pictures["svg"], tuple(map(_place, figure.axes)))


def _pictures(figure: Figure) -> dict[str, bytes]:
    """PNG and SVG of a figure; each canvas draws once, where ``savefig`` would draw everything twice."""
    png, svg = io.BytesIO(), io.BytesIO()
    FigureCanvasAgg(figure).print_png(png, metadata=NO_METADATA["png"])  # type: ignore[no-untyped-call]
    FigureCanvasSVG(figure).print_svg(svg, metadata=NO_METADATA["svg"])  # type: ignore[no-untyped-call]
    return {"png": png.getvalue(), "svg": svg.getvalue()}
