"""Drops in the regressions of a campaign whose measurements contradict what was told of them."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.errors import InputError
from wentry_cli.tables import has_table, read_table


def warn_of_doubtful(results: Path) -> list[str]:
    """A sentence that names the drops of ``scaling.csv`` with doubts, and what is in doubt; none where none has any."""
    try:
        table = read_table(results, "scaling") if has_table(results, "scaling") else None
    except InputError:
        return []
    if table is None:
        return []
    named = sorted({one for cell in table["doubtful"].dropna() for one in str(cell).split("; ")})
    if not named:
        return []
    count = "1 drop" if len(named) == 1 else f"{len(named)} drops"
    return [
        f"the regressions hold {count} whose measurements contradict what was told, marked in tables and figures: "
        f"{', '.join(named)}; correct what is wrong, or leave out of {results} what cannot be trusted"
    ]
