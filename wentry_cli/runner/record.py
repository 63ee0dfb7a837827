"""What a run writes into the records beside the tables, and the drops that it reads back from there."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unicodedata import normalize

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError, NoDropError
from wentry_cli.provenance import digest_of, environment
from wentry_cli.records import DROP, RUN, STAGES, read_json, read_stages, write_json


def note_stage(folder: Path, name: str, entry: dict[str, Any] | None) -> None:
    """Set what ``stages.json`` in ``folder`` says of the stage ``name``; ``None`` takes it out."""
    record = read_stages(folder)
    record.pop(name, None)
    if entry is not None:
        record[name] = entry
    write_json(folder / STAGES, record)


def write_drop(results: Path, drop: Drop) -> None:
    """Keep the drop's resolved configuration beside its tables, for the commands that do not see the videos."""
    write_json(results / drop.name / DROP, drop.record())


def read_drops(results: Path) -> tuple[list[Drop], dict[str, str]]:
    """Every drop that was processed into ``results``, by name, with the material that a calibration knows better.

    Those whose record is damaged or that of another drop come apart, with what to do about it. Raises ``InputError``
    where there is no other, ``NoDropError`` where there is none at all.
    """
    if os.path.isfile(results):
        raise InputError(f"{results}: is a file; give the folder that `wentry process` wrote its results into")
    if not os.path.isdir(results):
        raise InputError(f"{results}: no such folder; run `wentry process VIDEO_DIR -o {results}` first")
    if os.path.isfile(results / DROP):
        name = os.path.basename(os.path.abspath(results))
        raise InputError(f"{results}: is the folder of one drop; give the one above it, and --drop {name}")
    drops: list[Drop] = []
    damaged: dict[str, str] = {}
    for path in sorted(results.glob(f"*/{DROP}")):
        try:
            drop = Drop.from_record(read_json(path)).with_calibration(results)
        except (KeyError, ValueError, TypeError):
            damaged[path.parent.name] = f"{path}: damaged; run `wentry process` again on its video"
            continue
        if normalize("NFC", drop.name) == normalize("NFC", path.parent.name):  # some disks take letters apart
            drops.append(drop)
        else:
            damaged[path.parent.name] = _of_another(path.parent, drop.name)
    if damaged and not drops:
        raise InputError("\n".join(damaged.values()))
    if not drops:
        raise NoDropError(f"{results}: holds no processed drop; run `wentry process VIDEO_DIR -o {results}` first")
    return drops, damaged


def _of_another(folder: Path, name: str) -> str:
    mend = "remove this copy" if (folder.parent / name).exists() else f"name the folder {name} again"
    return f"{folder}: holds the results of the drop {name}; {mend}, or process a video as {folder.name} into it"


def write_run(
    results: Path,
    command: str | None,
    failures: dict[str, dict[str, Any]],
    tried: set[str],
    notes: Sequence[Sequence[str]] = (),
) -> dict[str, Any]:
    """Gather what was done in ``results`` into ``run.json`` and return it.

    ``command`` is the one that made the tables, ``None`` for one that only shows them: the one before stays.
    ``failures`` maps a drop to stage, exit code and sentence of this run; failures of earlier runs stay for drops that
    were not ``tried`` again. ``notes`` are what a report says of tables that are not those of today's files.
    """
    before = read_json(results / RUN)
    failures = {name: told for name, told in before.get("failures", {}).items() if name not in tried} | failures
    drops: dict[str, Any] = {}
    for path in sorted(results.glob(f"*/{DROP}")):
        name = path.parent.name
        record = read_json(path)
        drops[name] = {
            "folder": record.get("folder"),
            "configuration": record.get("experiment"),
            "configuration_hash": digest_of(record.get("experiment")),
            "material": record.get("material"),
            "stages": read_stages(path.parent),
        }
    content = {
        "command": before.get("command") if command is None else command,
        "environment": environment(),
        "version": environment()["wentry"],
        "drops": drops,
        "stages": read_stages(results),
        "failures": failures,
        "notes": [list(row) for row in notes],
    }
    write_json(results / RUN, content)
    return content
