"""Recordings that were measured twice, under two names of one drop: they would count twice in a campaign."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError
from wentry_cli.records import read_stages
from wentry_cli.runner.record import read_drops
from wentry_cli.tables import has_table

Part = tuple[str, object, object]


def warn_of_twice(results: Path, only: tuple[str, ...] = ()) -> list[str]:
    """A sentence for each recording that several drops in ``results``, or of those in ``only``, were measured from.

    Drops that share a recording but not its frames or its region are different drops.
    """
    try:
        drops, _ = read_drops(results)
    except InputError:
        return []
    names: dict[Part, list[str]] = {}
    for drop in drops:
        for part in _parts(results, drop) if not only or drop.name in only else ():
            names.setdefault(part, []).append(drop.name)
    groups = dict.fromkeys(tuple(group) for group in names.values() if len(group) > 1)
    return [
        f"{' and '.join(group)} were measured from the same recording, which counts {len(group)} times in "
        f"summary.csv and scaling.csv; keep the folder of one of them in {results}, remove the rest and fit again"
        for group in groups
    ]


def _parts(results: Path, drop: Drop) -> set[Part]:
    """The parts of recordings that ``drop`` was measured from, each by a word on what its files hold."""
    stages = read_stages(results / drop.name)
    if not has_table(results / drop.name, "geometry") or any("error" in entry for entry in stages.values()):
        return set()  # it counts nowhere
    marks = stages.get("ingest", {}).get("fingerprint", {})
    found: set[Part] = set()
    for name in drop.experiment.sides:
        word = next((word for word in str(marks.get(f"recording {name}")).split() if word.startswith("content:")), None)
        if word is not None:
            found.add((word, drop.view(name).frames, drop.view(name).roi_px))
    return found
