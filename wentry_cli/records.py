"""What lies beside the tables: ``drop.json`` and ``stages.json`` of a drop, ``run.json`` of them all, lock and log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wentry_cli.tables import write_text

DROP = "drop.json"
STAGES = "stages.json"
RUN = "run.json"
ERROR_LOG = "error.log"
LOCK = ".lock"


def read_json(path: Path) -> dict[str, Any]:
    """The dictionary in ``path``, empty where the file is missing or damaged (everything is then stale)."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write plain data as indented JSON, atomically."""
    write_text(path, json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False) + "\n")
