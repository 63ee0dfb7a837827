"""One writer at a time: an operating-system lock on a file in the results folder, released when the process ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wentry_cli.errors import InputError, LockedError
from wentry_cli.records import LOCK
from wentry_cli.tables import make_folder


@contextmanager
def locked(results: Path) -> Iterator[None]:
    """Hold the lock of ``results``, which is made where it is missing.

    Raises ``LockedError`` where another process holds it and ``InputError`` where it cannot be written.
    """
    make_folder(results)
    try:
        handle = os.open(results / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise InputError(f"{results}: cannot be written ({error.strerror}); choose another folder with -o") from error
    try:
        try:
            _take(handle)
        except OSError as error:
            raise LockedError(
                f"{results}: another wentry is writing there; wait until it ends or choose another folder with -o"
            ) from error
        yield
    finally:
        os.close(handle)


def is_locked(results: Path) -> bool:
    """Whether another process holds the lock of ``results``; nothing is written to find out."""
    try:
        handle = os.open(results / LOCK, os.O_RDWR)
    except OSError:
        return False
    try:
        _take(handle)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False


def _take(handle: int) -> None:
    if os.name == "nt":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
