"""Rows of ``materials.csv``: new ones take the place of old ones, but never a failed one that of a good one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wentry_cli.report.numbers import with_uncertainty
from wentry_cli.tables import has_table, new_table, read_table, table_path, write_table

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
_KEYS = ("material", "sphere_id", "source")
FITTED = {
    "g_inf_pa": "g_inf_{}_pa",
    "zero_m": "",
    "eps0_dot_1_s": "eps0_dot_{}_1_s",
    "n": "n_{}",
    "flow_1_s": "",
}  # number -> its 95 % interval, with low and high


def say_kept(results: Path) -> str:
    """What is said of a row that was not replaced."""
    return f"the good row of an earlier calibration stays in {table_path(results, 'materials')}"


def merge_rows(results: Path, rows: list[Row]) -> list[Row]:
    """Write ``rows`` into ``materials.csv`` in place of those of the same material, sphere and source.

    Returns the failed rows that were not written, because a good row of an earlier calibration stands in their place.
    """
    import pandas as pd

    names = sorted({name for row in rows for name in row})
    table = new_table("materials", {name: [row.get(name) for row in rows] for name in names})
    refused: list[Row] = []
    if has_table(results, "materials"):
        old = read_table(results, "materials")
        good = _identities(old[old["status"] == "ok"])
        worse = ((table["status"] != "ok") & _identities(table).isin(good)).to_numpy(dtype=bool)
        refused = [row for row, out in zip(rows, worse, strict=True) if out]
        table = table[~worse]
        kept = old[~_identities(old).isin(_identities(table))]
        table = pd.concat([part for part in (kept, table) if len(part)], ignore_index=True)
    table = table.sort_values(list(_KEYS), kind="stable", ignore_index=True)
    write_table(results, "materials", table)
    return refused


def rows_of(results: Path, source: str, names: Sequence[str]) -> list[Row]:
    """The rows of ``materials.csv`` from ``source`` of the spheres (``impact``) or materials ``names``, as plain data.

    What was not measured is ``None``.
    """
    table = read_table(results, "materials")
    key = "sphere_id" if source == "impact" else "material"
    table = table[(table["source"] == source) & table[key].isin(list(names))]
    records = table.astype(object).where(table.notna(), None).to_dict("records")
    return [{str(name): value for name, value in record.items()} for record in records]


def fitted_numbers(row: Row) -> str:
    """The fitted numbers of ``row`` with their uncertainties, as the report writes them."""
    return ", ".join(told for name, interval in FITTED.items() if (told := _fitted(row, name, interval)))


def _fitted(row: Row, name: str, interval: str) -> str:
    """A number with its interval where it has one, told to the digits of its uncertainty; nothing if not fitted."""
    value, unc = row.get(name), row.get(f"{name}_unc")
    if value is None or unc is None:
        return ""
    ends = [row.get(interval.format(end)) for end in ("low", "high")]
    told = [with_uncertainty(end, unc).partition(" ± ")[0] for end in ends if end is not None]
    return f"{name} {with_uncertainty(value, unc)}" + (f" (95 %: {' to '.join(told)})" if len(told) == 2 else "")


def _identities(table: pd.DataFrame) -> pd.Series[Any]:
    columns = table[list(_KEYS)].fillna("")
    return columns[_KEYS[0]] + "\t" + columns[_KEYS[1]] + "\t" + columns[_KEYS[2]]
