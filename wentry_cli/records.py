"""What lies beside the tables: ``drop.json`` and ``stages.json`` of a drop, ``run.json`` of them all, lock and log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wentry_cli.schemas import TABLES
from wentry_cli.tables import write_text

DROP = "drop.json"
STAGES = "stages.json"
RUN = "run.json"
ERROR_LOG = "error.log"
LOCK = ".lock"
_KINDS = {"fingerprint": dict, "outputs": dict, "warnings": list, "doubts": list, "error": str, "exit_code": int}


def read_json(path: Path) -> dict[str, Any]:
    """The dictionary in ``path``, empty where the file is missing or damaged (everything is then stale)."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def read_stages(folder: Path) -> dict[str, dict[str, Any]]:
    """What ``stages.json`` in ``folder`` records, by stage; one whose entry no run of ours wrote has not run."""
    return {name: entry for name, entry in read_json(folder / STAGES).items() if _is_entry(entry)}


def _is_entry(entry: Any) -> bool:
    if not isinstance(entry, dict) or not all(isinstance(entry.get(key, kind()), kind) for key, kind in _KINDS.items()):
        return False
    outputs = entry.get("outputs", {})  # tables of a drop, or files of the campaign
    return all(name in TABLES or Path(name).suffix for name in outputs)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write plain data as indented JSON, atomically."""
    write_text(path, json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False) + "\n")
