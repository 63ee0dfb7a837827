"""How wide text is in the report's font, lines that fit a width, and letters that the font lacks."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from matplotlib.font_manager import FontProperties, findfont, get_font

from wentry_cli.report.style import STYLE

SIZE = 1000  # pixels an em at which the font is asked: fine enough that rounding does not count


def width_em(text: str, *, bold: bool = False) -> float:
    """Width of a line of plain text over the size of its letters."""
    return sum(_advance(letter, bold) for letter in text)


def lines_within(text: str, width: float, *, bold: bool = False) -> list[str]:
    """Break a text into lines of at most ``width`` (over the size of the letters): at blanks, within words too long.

    An empty text is one empty line.
    """
    lines, line, used = [], "", 0.0
    for word in text.split(" "):
        gap = " " if line else ""
        added = width_em(gap + word, bold=bold)
        if line and used + added > width:
            lines.append(line)
            line, used, gap, added = "", 0.0, "", added - width_em(gap, bold=bold)
        rest = word
        while added > width:
            count = _count_within(rest, width, bold)
            lines.append(rest[:count])
            rest = rest[count:]
            added = width_em(rest, bold=bold)
        line, used = line + gap + rest, used + added
    return [*lines, line] if line or not lines else lines


def lacking(text: str) -> str:
    """Those letters of a text that the font does not have, each once, in their order."""
    known = _charmap(bold=False)
    return "".join(dict.fromkeys(letter for letter in text if letter.isprintable() and ord(letter) not in known))


def _count_within(word: str, width: float, bold: bool) -> int:
    """How many letters of a word fit, one at least."""
    used = 0.0
    for count, letter in enumerate(word):
        used += _advance(letter, bold)
        if used > width:
            return max(count, 1)
    return len(word)


def _path(bold: bool) -> str:
    return findfont(FontProperties(family=STYLE["font.family"], weight="bold" if bold else "normal"))


@lru_cache(maxsize=2)
def _charmap(bold: bool) -> dict[Any, Any]:
    return dict(get_font(_path(bold)).get_charmap())


@lru_cache(maxsize=4096)
def _advance(letter: str, bold: bool) -> float:
    """Width of a letter over its size; of one that the font lacks, that of the box in its place."""
    font = get_font(_path(bold))
    font.set_size(SIZE, 72)
    return float(font.load_glyph(_charmap(bold).get(ord(letter), 0)).horiAdvance) / 64.0 / SIZE
