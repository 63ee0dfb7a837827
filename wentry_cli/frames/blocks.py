"""A file read block by block into one buffer that is used again: no memory map, so no page stays resident."""

from __future__ import annotations

import os
import weakref
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError


class BlockFile:
    """Random access to the bytes of a file; ``size`` is its length when it was opened."""

    def __init__(self, path: Path) -> None:
        """Open ``path``; InputError where that fails."""
        self.path = path
        try:
            self._descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        except OSError as error:
            raise InputError(f"{path}: cannot be opened ({error.strerror}); check that it is readable") from error
        self.close = weakref.finalize(self, os.close, self._descriptor)
        self.size = os.fstat(self._descriptor).st_size
        self._buffer: NDArray[np.uint8] = np.empty(0, np.uint8)

    def read(self, offset: int, count: int, unread: tuple[int, int] = (0, 0)) -> NDArray[np.uint8]:
        """Return ``count`` bytes from ``offset`` as a view that is valid until the next call.

        Of these the bytes ``unread`` (first, behind the last) are not read, and hold anything. Nothing is allocated
        before the request has been checked against the size of the file. Raises ``FrameUnreadableError`` where the file
        ends earlier.
        """
        if not self.close.alive:
            raise ValueError(f"{self.path}: read after it was closed")
        if offset < 0 or count < 0 or offset + count > self.size:
            raise FrameUnreadableError(
                f"{self.path}: {count} bytes at {offset} lie outside the file of {self.size} bytes"
            )
        if self._buffer.size < count:
            self._buffer = np.empty(count, np.uint8)
        view = self._buffer[:count]
        begin, end = unread
        if begin > 0:
            self._fill(view[:begin].data, offset)
        if end < count:
            self._fill(view[end:].data, offset + end)
        return view

    def bytes_at(self, offset: int, count: int) -> bytes:
        """Return a copy of ``count`` bytes from ``offset``; raises as ``read``."""
        return self.read(offset, count).tobytes()

    def _fill(self, target: memoryview, offset: int) -> None:
        while len(target):
            try:
                got = _read_at(self._descriptor, target, offset)
            except OSError as error:
                raise FrameUnreadableError(f"{self.path}: reading failed ({error.strerror})") from error
            if got == 0:
                raise FrameUnreadableError(f"{self.path}: the file became shorter while it was read")
            target, offset = target[got:], offset + got


def _read_at(descriptor: int, target: memoryview, offset: int) -> int:
    if hasattr(os, "preadv"):
        return os.preadv(descriptor, [target], offset)
    os.lseek(descriptor, offset, os.SEEK_SET)  # Windows has no positioned read
    data = os.read(descriptor, len(target))
    target[: len(data)] = data
    return len(data)
