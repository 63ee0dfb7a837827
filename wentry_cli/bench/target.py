"""One line of the table of what was asked and reached."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """One line: what, asked, measured (with the case that is worst), and whether it is met."""

    what: str
    asked: str
    measured: str
    met: bool
