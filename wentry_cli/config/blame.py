"""Errors about what a drop's files say that only its recording shows to be wrong: the place is looked up again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import EXPERIMENT, Drop
from wentry_cli.config.corrections import CORRECTIONS
from wentry_cli.config.places import Document, KeyPath, read_document, value_at
from wentry_cli.errors import ConfigurationError


def wrong_key(drop: Drop, key: str, value: Any, message: str) -> ConfigurationError:
    """An error about ``key`` (dotted) of ``experiment.yaml`` or ``campaign.yaml``, whichever gave it ``value``."""
    return ConfigurationError(f"{place_of(drop, key, value)}: error: {key}: {message}")


def place_of(drop: Drop, key: str, value: Any) -> str:
    """Where ``key`` (dotted) was given its ``value``, as ``file:line:column``.

    A value from ``--set`` has no place in a file and is named as that; a default has that of its empty key
    or of the nearest parent; a value that the files no longer hold has the drop's file alone.
    """
    path: KeyPath = tuple(key.split("."))
    if _is_set(drop.overrides, path):
        return f"--set {key}"
    file = drop.folder / EXPERIMENT
    own, shared = _read_again(file), _read_again(drop.shared.path)
    written = [document for document in (own, shared) if document is not None]
    for said in (document.said() for document in written):
        if path in said.places:
            return str(said.places[path] if value_at(said.data, path) == value else file)
    if own is None:
        return str(file)
    return str((own if shared is None else own.over(shared)).place(path) or file)


def _is_set(data: Any, path: KeyPath) -> bool:
    for part in path:
        if not isinstance(data, dict) or part not in data:
            return False
        data = data[part]
    return True


def wrong_correction(drop: Drop, path: KeyPath, message: str) -> ConfigurationError:
    """An error about the entry ``path`` of the drop's ``corrections.yaml``."""
    file = drop.folder / CORRECTIONS
    document = _read_again(file)
    place = None if document is None else document.place(path)
    return ConfigurationError(f"{place or file}: error: {'.'.join(map(str, path))}: {message}")


def _read_again(file: Path | None) -> Document | None:
    """``None`` where the file has gone or was spoilt since the drop was read."""
    try:
        return None if file is None or not file.is_file() else read_document(file)
    except ConfigurationError:
        return None
