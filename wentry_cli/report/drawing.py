"""From a panel to files: SVG, PNG and the table behind it, with the same bytes for the same results."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from wentry_cli.report.panel import Panel
from wentry_cli.report.style import STYLE
from wentry_cli.tables import FLOAT_FORMAT, replacing, write_text

NO_METADATA = {
    "svg": {"Date": None, "Creator": None, "Format": None, "Type": None},
    "png": {"Software": None},
}


@dataclass(frozen=True)
class Drawn:
    """A panel with the picture that went to disk."""

    panel: Panel
    svg: bytes


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the report's style; letters that the font lacks (names of drops) become boxes without a warning."""
    look: Any = STYLE
    with mpl.rc_context(look), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*[Gg]lyph.*")
        yield


def draw_panel(panel: Panel) -> Figure:
    """Draw a panel on a figure of its own; call inside ``styled``."""
    figure = Figure(figsize=panel.size, layout="constrained")
    FigureCanvasAgg(figure)
    panel.draw(figure)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the layout is made once for all formats
    return figure


def save_panel(panel: Panel, folder: Path) -> Drawn:
    """Write ``<stem>.svg``, ``<stem>.png`` and ``<stem>.csv`` into ``folder``."""
    with styled():
        figure = draw_panel(panel)
        pictures = {kind: _picture(figure, kind) for kind in ("svg", "png")}
    for kind, picture in pictures.items():
        with replacing(folder / f"{panel.stem}.{kind}") as temporary:
            temporary.write_bytes(picture)
    text = panel.data.to_csv(index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    write_text(folder / f"{panel.stem}.csv", text)
    return Drawn(panel, pictures["svg"])


def _picture(figure: Figure, kind: str) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, metadata=NO_METADATA[kind])
    return stream.getvalue()
