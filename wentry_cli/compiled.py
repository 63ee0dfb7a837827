"""The one way in which numerics are compiled: cached, without the interpreter lock, IEEE arithmetic.

No ``fastmath`` and no parallel reductions, so that the same input gives the same bytes with one process or many; sums
alone may be `reordered`, in one way for all processes of a machine.

A cached kernel holds the code of the kernels that it calls, but numba looks only at the file of the kernel itself to
see whether it is current. So the cache of a room lies in a folder named by a hash of that room's sources and of those
of every room that it imports: a change anywhere in them is a new folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")

PACKAGE = Path(__file__).resolve().parent
KERNELS = "kernels-{room}-{digest}"  # below the package's __pycache__, or below NUMBA_CACHE_DIR
ARITHMETIC: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}
# Terms may change places and be multiplied and added in one step: what vector instructions for a sum ask for.
REORDERED: dict[str, Any] = ARITHMETIC | {"fastmath": {"reassoc", "nsz", "contract"}}
FIRST_RUN = "first run: the numerics of this command are compiled now, once; this takes some minutes"
KEPT_S = 86_400.0  # another process may still use yesterday's kernels
_IMPORT = re.compile(r"wentry_cli\.(\w+)")


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """Compile ``function`` with numba on its first call and keep its type for the type checker."""
    return _compile(function, ARITHMETIC)


def reordered(function: Callable[P, T]) -> Callable[P, T]:
    """As `compiled`, for loops that add up finite numbers: faster, and other than in order by a few roundings."""
    return _compile(function, REORDERED)


def _compile(function: Callable[P, T], arithmetic: dict[str, Any]) -> Callable[P, T]:
    import numba

    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = _cache_folder(_room_of(function.__module__)) or before
    try:
        return cast("Callable[P, T]", numba.njit(cache=True, **arithmetic)(function))
    except RuntimeError:  # numba finds no folder to write into: the kernels live as long as the process
        return cast("Callable[P, T]", numba.njit(**arithmetic)(function))
    finally:
        settings.CACHE_DIR = before


def compiles_anew(rooms: Iterable[str]) -> bool:
    """Whether one of ``rooms`` keeps no kernel of today's sources though there is a place, so that it is compiled."""
    folders = [_folder(room) for room in rooms]
    return any(folder is not None and not any(folder.glob("**/*.nbc")) for folder in folders)


def _room_of(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == PACKAGE.name and len(parts) > 2 else None


@cache
def _cache_folder(room: str | None) -> str | None:
    """Folder for the kernels of ``room``, ``None`` (numba's choice) outside the package or where none is writable."""
    folder = None if room is None else _folder(room)
    if folder is None:
        return None
    _sweep(folder, KERNELS.format(room=room, digest="*"))
    return str(folder)


def _folder(room: str) -> Path | None:
    """The folder of today's sources of ``room``: beside them, else in ``NUMBA_CACHE_DIR``; made where it is not."""
    import numba

    settings: Any = numba.config
    given = settings.CACHE_DIR
    for place in (PACKAGE / "__pycache__", *([Path(given)] if given else [])):
        folder = place / KERNELS.format(room=room, digest=_digest(room))
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):  # one that somebody else made exists, and takes nothing
            return folder
    return None


def _digest(room: str) -> str:
    digest = hashlib.sha256()
    for name in sorted(_closure(room)):
        for path in sorted((PACKAGE / name).glob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _closure(room: str) -> set[str]:
    """``room`` and the rooms that it imports, directly or not."""
    found: set[str] = set()
    waiting = {room}
    while waiting:
        name = waiting.pop()
        found.add(name)
        for path in (PACKAGE / name).glob("*.py"):
            waiting |= set(_IMPORT.findall(path.read_text(encoding="utf-8"))) - found
    return {name for name in found if (PACKAGE / name).is_dir()}


def _sweep(folder: Path, pattern: str) -> None:
    for old in folder.parent.glob(pattern):
        if old != folder and time.time() - old.stat().st_mtime > KEPT_S:
            shutil.rmtree(old, ignore_errors=True)
