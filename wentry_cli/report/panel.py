"""What a panel is: a picture, the table behind it, its caption; or the reason why it is not drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pandas as pd
from matplotlib.figure import FigureBase

from wentry_cli.report.style import PANEL_SIZE

if TYPE_CHECKING:
    from wentry_cli.report.campaign import Campaign


@dataclass(frozen=True, eq=False)
class Panel:
    """One picture: ``draw`` puts it on a figure or a part of a page, from nothing but ``data``."""

    key: str  # the paper's number, "4b", or a word
    stem: str  # file name without suffix
    title: str
    caption: str
    data: pd.DataFrame
    draw: Callable[[FigureBase], None]
    size: tuple[float, float] = PANEL_SIZE
    drop: str = ""  # the drop that it belongs to, empty for the campaign
    alt: str = field(default="")


@dataclass(frozen=True)
class NotDrawn:
    """A panel for which the data do not exist, and why, in one line."""

    key: str
    title: str
    reason: str


PanelMaker = Callable[["Campaign"], Panel | NotDrawn]


def rows(records: list[dict[str, object]], columns: list[str]) -> pd.DataFrame:
    """Make the table behind a panel with its columns in order; cells that a record lacks are empty."""
    return pd.DataFrame.from_records(records, columns=columns)


def series(data: pd.DataFrame, name: str) -> pd.DataFrame:
    """Return the rows of one ``series`` of a panel's table."""
    return data[data["series"] == name]


def merged(missing: list[NotDrawn]) -> list[NotDrawn]:
    """Say the same reason for the same kind of panel once, with the titles in a row."""
    groups: dict[tuple[str, str], list[str]] = {}
    for panel in missing:
        groups.setdefault((panel.key, panel.reason), []).append(panel.title)
    return [NotDrawn(key, "; ".join(dict.fromkeys(titles)), reason) for (key, reason), titles in groups.items()]
