"""Symbols with an index (t_p, D_eff, ρ_w) as a page and a printed line show them."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from wentry_cli.report.style import plain

# Whole symbols of the report's own texts only: a name like g6p70_d51 stays as it is.
INDEXED = re.compile(r"(?<!\w)(C̄|[tDTGCλρyẏÿ])_(eff|exp|model|pN|p\d?|[wsbcmFT])(?![^\W²])")
LONG = re.compile(r"(?<=\S{24})(?=\S{8})")
LETTERS = {"ẏ": r"\dot{y}", "ÿ": r"\ddot{y}", "C̄": r"\bar{C}", "λ": r"\lambda", "ρ": r"\rho"}


def as_html(text: str) -> Markup:
    """Escape a text; the indices of its symbols are lowered."""
    return Markup(INDEXED.sub(r"\1<sub>\2</sub>", str(escape(text))))


def as_breakable(text: str) -> Markup:
    """Escape a text; a browser may break its paths after a slash, and other long words after some letters."""
    pieces = [piece for part in re.split(r"(?<=[/\\])", text) for piece in LONG.split(part) if piece]
    return Markup("<wbr>").join(escape(piece) for piece in pieces)


def as_mathtext(text: str) -> str:
    """Make a text safe to draw (``plain``); the indices of its symbols are lowered."""

    def lowered(found: re.Match[str]) -> str:
        letter, index = found.groups()
        index = index if index == "pN" or len(index) == 1 else rf"\mathrm{{{index}}}"
        return f"${LETTERS.get(letter, letter)}_{{{index}}}$"

    return INDEXED.sub(lowered, plain(text))
