"""What the status word ``ok`` promises, held against tables that were written."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.schemas import TABLES
from wentry_cli.tables import has_table, read_table


def broken_promises(folder: Path, *names: str) -> list[str]:
    """Columns that a row with status ok leaves empty though the schema does not allow it, as table.column: count."""
    found = []
    for name in names or tuple(TABLES):
        if not TABLES[name].promised or not has_table(folder, name):
            continue
        table = read_table(folder, name)
        good = table[(table["status"] == "ok").fillna(False).to_numpy(bool)]
        empty = good[TABLES[name].promised].isna().sum()
        found += [f"{name}.{column}: {count}" for column, count in empty.items() if count]
    return found
