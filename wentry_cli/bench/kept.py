"""What a folder holds of earlier runs: rows by chapter, each with the command and the versions that made it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.table import csv_of, read_csv
from wentry_cli.errors import InputError
from wentry_cli.tables import write_text

MADE = "accuracy_made.csv"
UNKNOWN = ("an earlier run", "versions that were not noted")
OURS, PEERS = "wentry", " (peers: "
Maker = tuple[str, str]
"""The command that measured a chapter, and the versions of what it ran on."""


@dataclass(frozen=True)
class Chapter:
    """The rows of one chapter and who made them."""

    name: str
    rows: list[BenchRow]
    maker: Maker = UNKNOWN


def check_folder(folder: Path, quick: bool) -> None:
    """Raise ``InputError`` where ``folder`` holds chapters measured in full and this run is a quick one, or reverse."""
    makers = read_makers(folder)
    chapters = [path.stem.removeprefix("accuracy_") for path in folder.glob("accuracy_*.csv") if path.name != MADE]
    there = {_is_quick(makers.get(name, UNKNOWN)) for name in chapters}
    if (not quick) in there:
        held = "chapters measured in full" if quick else "a quick look"
        raise InputError(f"{folder}: holds {held}; the two are not mixed, choose another folder with -o")


def _is_quick(maker: Maker) -> bool:
    return "--quick" in maker[0].split()


def table_of(folder: Path, chapter: str) -> Path:
    """Where the rows of a chapter lie."""
    return folder / f"accuracy_{chapter}.csv"


def renew(folder: Path, fresh: Iterable[Chapter], order: Iterable[str]) -> list[Chapter]:
    """Write the tables of the chapters just measured; they and those that ``folder`` held before, in ``order``."""
    makers = read_makers(folder)
    for chapter in fresh:
        write_text(table_of(folder, chapter.name), csv_of(chapter.rows))
        makers[chapter.name] = chapter.maker
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([("chapter", "command", "versions"), *_lines(makers)])
    write_text(folder / MADE, text.getvalue())
    there = [name for name in order if table_of(folder, name).is_file()]
    found = [Chapter(name, read_csv(table_of(folder, name)), makers.get(name, UNKNOWN)) for name in there]
    return [chapter for chapter in found if chapter.rows]


def keep_peers(folder: Path, chapter: Chapter) -> Chapter:
    """A chapter that was measured without peers, with the rows that ``folder`` holds of these behind ours, by case.

    The command that measured them is told in brackets.
    """
    table = table_of(folder, chapter.name)
    if not table.is_file():
        return chapter
    anew = {row.method for row in chapter.rows}
    peers = [row for row in read_csv(table) if row.method not in anew and not row.method.startswith(OURS)]
    rows: list[BenchRow] = []
    for case in dict.fromkeys(row.case for row in chapter.rows):
        rows += [row for row in [*chapter.rows, *peers] if row.case == case]
    earlier, _ = read_makers(folder).get(chapter.name, UNKNOWN)
    command = f"{chapter.maker[0]}{PEERS}{earlier.partition(PEERS)[2].removesuffix(')') or earlier})"
    return replace(chapter, rows=rows, maker=(command, chapter.maker[1]))


def _lines(makers: dict[str, Maker]) -> list[tuple[str, str, str]]:
    return [(name, *makers[name]) for name in sorted(makers)]


def read_makers(folder: Path) -> dict[str, Maker]:
    """Who made which chapter of ``folder``; those of early versions are not in it."""
    path = folder / MADE
    if not path.is_file():
        return {}
    try:
        lines = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")))
        return {line["chapter"]: (line["command"], line["versions"]) for line in lines}
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: does not say which command made which chapter; move it away") from error
