"""Frames that have to be decoded are decoded once a run: their grey levels wait for the later stages in a file.

The file has no name where the system allows that, so a killed run leaves nothing behind, and it takes no more than its
share of what is free on the disk of the results; frames for which there is no room are decoded again. Nothing of it
stays in memory but where each frame lies.
"""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.reader import Frame, Recording, Region, StoredRows, checked_index, checked_region

SHARE_OF_FREE = 0.25
MOST_BYTES = 8_000_000_000
RESERVED_AT_ONCE = 64_000_000
PREFIX, SUFFIX = ".frames.", ".part"

T = TypeVar("T")
Key = tuple[Path, tuple[int, int] | None]
"""The source of a recording and the part of it that is used."""


class _Store:
    """A file of grey levels and the recordings that write to it; closing it closes them all."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: IO[bytes] | None = None
        self._room = math.nan  # bytes that may still be written; not known before the first frame
        self._end = self._reserved = 0
        self.recordings: dict[Key, _Once] = {}
        self.found: dict[Hashable, Any] = {}

    def put(self, frame: Frame) -> int | None:
        """Append the frame; where it begins in the file, None where there is no room for it."""
        try:
            if self._file is None and math.isnan(self._room):
                self._folder.mkdir(parents=True, exist_ok=True)
                self._room = min(SHARE_OF_FREE * shutil.disk_usage(self._folder).free, MOST_BYTES)
                kept = tempfile.TemporaryFile  # it is closed with the store
                self._file = kept(dir=self._folder, prefix=PREFIX, suffix=SUFFIX, buffering=0)
            if self._file is None or frame.nbytes > self._room:
                return None
            begin = self._end
            self._reserve(begin + frame.nbytes)
            self._file.seek(begin)
            if self._file.write(frame.data) != frame.nbytes:
                raise OSError("the disk is full")
        except OSError:
            self._room = 0.0
            return None
        self._end += frame.nbytes
        self._room -= frame.nbytes
        return begin

    def _reserve(self, end: int) -> None:
        """Have the system set blocks aside up to ``end`` and beyond, which costs it less than one after the other."""
        if self._file is not None and end > self._reserved and hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self._file.fileno(), self._reserved, max(RESERVED_AT_ONCE, end - self._reserved))
            self._reserved += max(RESERVED_AT_ONCE, end - self._reserved)

    def get(self, begin: int, out: NDArray[Any]) -> bool:
        """Fill ``out`` from the file; False where that fails."""
        if self._file is None:
            return False
        try:
            self._file.seek(begin)
            return self._file.readinto(out.data) == out.nbytes  # type: ignore[attr-defined,no-any-return]
        except OSError:
            return False

    def close(self) -> None:
        """Close the recordings; the file vanishes."""
        for recording in self.recordings.values():
            recording.end()
        self.found.clear()
        if self._file is not None:
            self._file.close()


class _Once:
    """A recording whose frames are decoded once, behind the same protocol; open until its store is closed."""

    def __init__(self, recording: Recording, store: _Store) -> None:
        self._recording, self._store = recording, store
        self._places: dict[int, tuple[int, np.dtype[Any]]] = {}
        self._passed = 0  # no frame before this one is kept on the way
        self._buffer: NDArray[np.uint8] = np.empty(0, np.uint8)
        self.info = recording.info
        self.camera_frames = recording.camera_frames
        self.times_s = recording.times_s
        self.end = recording.close

    def close(self) -> None:
        """Leave it open: the next stage reads it too."""

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index`` or a region of it, from the file where it was decoded before."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        kept = self.stored_rows(index, (y0, y1), (y1, y1))
        if kept:
            return kept[0][:, x0:x1].copy()
        if self.info.in_sequence:
            self._keep_those_before(index)
        frame = self._decode(index)
        part = frame[y0:y1, x0:x1]
        return frame if part.size == frame.size else part.copy()

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Return rows (first, behind the last) of a frame that lies in the file, valid until the next are read.

        None where it does not. Those ``unread`` among them hold anything.
        """
        place = self._places.get(checked_index(index, self.info))
        if place is None:
            return None
        begin, kind = place
        width = self.info.width
        _, first, _, end = checked_region((0, rows[0], width, rows[1]), self.info)
        pitch = width * kind.itemsize
        if self._buffer.size < (end - first) * pitch:
            self._buffer = np.empty((end - first) * pitch, np.uint8)
        levels = self._buffer[: (end - first) * pitch].view(kind).reshape(-1, width)
        for top, stop in ((first, unread[0]), (unread[1], end)):
            if stop > top and not self._store.get(begin + top * pitch, levels[top - first : stop - first]):
                return None
        return levels, 0, False

    def _decode(self, index: int) -> Frame:
        frame = np.ascontiguousarray(self._recording.read(index))
        begin = self._store.put(frame)
        if begin is not None:
            self._places[index] = (begin, frame.dtype)
        return frame

    def _keep_those_before(self, index: int) -> None:
        """Keep the frames that are decoded on the way to ``index``, as long as there is room for them."""
        while self._passed < index:
            with suppress(FrameUnreadableError):  # it is told when it is asked for
                self._decode(self._passed)
                if self._passed not in self._places:
                    self._passed = self.info.frame_count  # no more room: what is asked for next is all that counts
            self._passed += 1
        self._passed = max(self._passed, index + 1)


_CURRENT: ContextVar[_Store | None] = ContextVar("decoded frames", default=None)


@contextmanager
def decoded_once(folder: Path) -> Iterator[None]:
    """Within the block no frame is decoded twice, as long as there is room for it on the disk of ``folder``."""
    store = _Store(folder)
    token = _CURRENT.set(store)
    try:
        yield
    finally:
        _CURRENT.reset(token)
        store.close()


def shared(key: Key, opened: Callable[[], Recording]) -> Recording:
    """The recording of ``key`` that ``opened`` opens: inside of ``decoded_once`` the same for all who ask.

    One whose parts are cheap to read is opened anew.
    """
    store = _CURRENT.get()
    if store is None:
        return opened()
    if key in store.recordings:
        return store.recordings[key]
    recording = opened()
    if recording.info.random_access:
        return recording
    return store.recordings.setdefault(key, _Once(recording, store))


def found_once(key: Hashable, find: Callable[[], T]) -> T:
    """What ``find`` returns, found once for each ``key`` inside of ``decoded_once``, and every time outside.

    For what several stages derive from the frames alone; nobody may change it, and it stays in memory for the run.
    """
    store = _CURRENT.get()
    if store is None:
        return find()
    if key not in store.found:
        store.found[key] = find()
    found: T = store.found[key]
    return found
