"""Which truth belongs to which drop: they have one name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wentry_cli.errors import InputError

TRUTH = "truth"
TRUTH_TABLE = "truth.csv"
TOP_TABLE = "top.csv"  # where there is a top view
SHOWN = 5  # names of a list


def truths_of(results: Path, drops: Sequence[str], truth: Path) -> dict[str, Path]:
    """The folder of the truth of each of ``drops`` that has one in ``truth``, a campaign or a drop as it is rendered.

    The truth of a single drop belongs to the drop of that name, or to the only one of ``drops``. Raises ``InputError``
    where none has a truth.
    """
    places = {drop: truth / Path(*drop.split("__")) / TRUTH for drop in drops}
    found = {drop: place for drop, place in places.items() if (place / TRUTH_TABLE).is_file()}
    if not found and (truth / TRUTH / TRUTH_TABLE).is_file():
        found = {_drop_of(results, drops, truth): truth / TRUTH}
    if not found:
        raise InputError(_nothing_in_common(results, drops, truth))
    return found


def _drop_of(results: Path, drops: Sequence[str], truth: Path) -> str:
    """The one of ``drops`` that the drop rendered into the folder ``truth`` is."""
    folders = truth.resolve().parts
    named = [drop for drop in drops if folders[-drop.count("__") - 1 :] == tuple(drop.split("__"))]
    if named:
        return max(named, key=len)
    if len(drops) == 1:
        return drops[0]
    raise InputError(
        f"{truth}: is the truth of one drop, and {results} holds none of that name but {_listed(drops)}; say with "
        "--drop which it is"
    )


def _nothing_in_common(results: Path, drops: Sequence[str], truth: Path) -> str:
    if not drops:
        return f"{results}: holds no processed drop; give the folder that `wentry process` wrote its results into"
    tables = sorted(truth.rglob(f"{TRUTH}/{TRUTH_TABLE}"))
    names = ["__".join(table.parent.parent.relative_to(truth).parts) for table in tables]
    if not names:
        return f"{truth}: holds no truth for the drops of {results}; give the folder that `wentry render` wrote"
    return (
        f"{truth}: drops are matched by name, and it holds the truth of {_listed(names)}, {results} the drops "
        f"{_listed(drops)}; compare one drop with the folder of one truth, for example: "
        f"wentry compare {results} {tables[0].parent.parent} --drop {drops[0]}"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
