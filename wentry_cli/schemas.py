"""Every column of every table: name, unit, type and meaning, written once.

The command line, the stages, the report and ``docs/tables.md`` read from here. Nothing heavy is imported.
"""

from __future__ import annotations

from dataclasses import dataclass

from wentry_cli.columns import COLUMNS

STATUS_WORDS = (
    "ok",
    "no_object",
    "no_edge",
    "short_arc",
    "occluded",
    "out_of_frame",
    "poor_fit",
    "saturated",
    "bad_frame",
    "gap",
    "interpolated",
    "early_shape",
    "no_unit_crossing",
    "clip_ended",
    "no_neck",
    "too_few",
    "not_identified",
    "manual",
)


@dataclass(frozen=True)
class Column:
    """One column: ``kind`` is ``float``, ``int`` or ``text``; an empty cell means not measured.

    ``may_be_empty`` says when a row may be ``ok`` without it; where it says nothing, an ``ok`` row has it filled.
    """

    name: str
    unit: str
    kind: str
    meaning: str
    may_be_empty: str = ""


@dataclass(frozen=True)
class Table:
    """One CSV: its name without suffix, the stage that writes it, what a row is, its columns in order."""

    name: str
    stage: str
    row: str
    columns: tuple[Column, ...]

    @property
    def names(self) -> list[str]:
        """The column names in the order of the file."""
        return [column.name for column in self.columns]

    @property
    def promised(self) -> list[str]:
        """The columns that a row with status ``ok`` has filled; none where the table has no status."""
        if "status" not in self.names:
            return []
        return [column.name for column in self.columns if not column.may_be_empty]


def _table(section: str) -> Table:
    header, *lines = section.strip().splitlines()
    name, stage, row = (part.strip() for part in header.split("|"))
    columns: list[Column] = []
    for line in lines:
        parts = [part.strip() for part in line.split("|")]
        if parts[0] == "±":
            columns.append(_uncertainty(columns[-1], *parts[1:]))
            continue
        kind, *added = parts[2].split()
        value = Column(parts[0], parts[1], kind, *parts[3:])
        columns.append(value)
        if "±" in added:
            columns.append(_uncertainty(value))
        if "random" in added:
            meaning = f"the part of {value.name}_unc that differs by chance from frame to frame"
            columns.append(Column(f"{value.name}_unc_random", value.unit, "float", meaning, value.may_be_empty))
    return Table(name, stage, row, tuple(columns))


def _uncertainty(value: Column, may_be_empty: str = "") -> Column:
    meaning = f"standard uncertainty (k = 1) of {value.name}"
    return Column(f"{value.name}_unc", value.unit, "float", meaning, may_be_empty or value.may_be_empty)


TABLES = {table.name: table for table in map(_table, COLUMNS.strip().removeprefix("# ").split("\n# "))}
