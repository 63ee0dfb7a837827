"""Speed-against-error rows as text: one line a row for a terminal and a file, compact tables for the page."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_type_hints

from wentry_cli.bench.row import BenchRow
from wentry_cli.errors import InputError

HEAD = "| case | method | quantity | bias | RMSE | RMSE / bound | pull | failures | µs per item | note |"
RULE = "|" + "---|" * 10
# With more methods than this they stand in rows and the cases in columns.
MOST_COLUMNS = 8
DASH = "–"


def write_rows(rows: Iterable[BenchRow]) -> list[str]:
    """Markdown rows, every number of importance."""
    return [
        f"| {row.case} | {row.method} | {row.quantity}, {row.unit} | {figure(row.bias)} | {figure(row.rmse)} | "
        f"{figure(row.ratio_to_bound)} | {figure(row.pull)} | {share(row.failures)} | {figure(row.time_us)} | "
        f"{row.note} |"
        for row in rows
    ]


def csv_of(rows: Iterable[BenchRow]) -> str:
    """All fields of all rows, comma separated, numbers with all their digits; empty where there is none."""
    text = io.StringIO()
    names = [field.name for field in fields(BenchRow)]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _cell(value) for name, value in asdict(row).items()})
    return text.getvalue()


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else repr(float(value))


def read_csv(path: Path) -> list[BenchRow]:
    """The rows that ``csv_of`` wrote; a column that an earlier version did not have is as if never measured.

    Raises ``InputError`` where the file is no such table.
    """
    kinds = get_type_hints(BenchRow)
    try:
        lines = list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))
        return [BenchRow(**{name: _value(kinds[name], cell) for name, cell in line.items()}) for line in lines]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: is not a table of wentry bench; move it away or measure its chapter anew") from error


def _value(kind: type, cell: str) -> Any:
    return math.nan if kind is float and not cell else kind(cell)


def figure(value: float, digits: int = 3) -> str:
    """A number with some significant digits, a dash for none."""
    if not math.isfinite(value):
        return DASH
    if abs(value) >= 1000.0:
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def share(value: float) -> str:
    """A share in per cent, a dash for none."""
    return f"{value:.1%}" if math.isfinite(value) else DASH


def markdown(head: list[str], body: list[list[str]]) -> list[str]:
    """A markdown table: the first column to the left, numbers to the right."""
    rule = "|---|" + "---:|" * (len(head) - 1)
    return ["| " + " | ".join(head) + " |", rule, *("| " + " | ".join(line) + " |" for line in body)]


def pivot(rows: list[BenchRow], cell: Callable[[BenchRow], str]) -> list[str]:
    """Cases in rows and methods in columns, or the other way round where there are many methods."""
    cases = list(dict.fromkeys(row.case for row in rows))
    methods = list(dict.fromkeys(row.method for row in rows))
    found = {(row.case, row.method): cell(row) for row in rows}
    if len(methods) <= MOST_COLUMNS or len(cases) > MOST_COLUMNS:
        body = [[case, *(found.get((case, method), DASH) for method in methods)] for case in cases]
        return markdown(["case", *methods], body)
    body = [[method, *(found.get((case, method), DASH) for case in cases)] for method in methods]
    return markdown(["method", *cases], body)
