"""What a tracker needs of a recording: its size and regions of its frames."""

from __future__ import annotations

from functools import cache
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background, cut_patch
from wentry_cli.imaging.detection import shrink
from wentry_cli.imaging.patch import Patch


class Frames(Protocol):
    """A clip of ``count`` frames of one size; ``read`` gives raw grey levels of a region (x0, y0, x1, y1) or the whole.

    ``read`` raises ``FrameUnreadableError`` for a damaged frame or a gap.
    """

    @property
    def count(self) -> int:
        """Number of frames, gaps counted."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""

    @property
    def full_scale(self) -> float:
        """The highest grey level."""

    def read(self, index: int, region: tuple[int, int, int, int] | None = None) -> NDArray[Any]:
        """Grey levels of frame ``index``."""


StoredRows = tuple[NDArray[Any], int, bool]
"""Whole rows as they are stored, in which pixel of them column 0 lies, and whether they are packed.

They are grey levels (rows, columns), or where packed bytes, two pixels of 12 bits in three.
"""


@runtime_checkable
class StoredFrames(Protocol):
    """A clip that may hand out rows of a frame as they are stored."""

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Rows (first, behind the last) of a frame, valid until the next is read; None where that is not possible.

        Of these, those ``unread`` (in the same way; the last number twice for none) hold anything.
        """


def stored_rows(frames: Frames, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
    """Rows of frame ``index`` as ``StoredFrames`` gives them; None for a clip that does not."""
    return cast("StoredFrames", frames).stored_rows(index, rows, unread) if _gives_rows(type(frames)) else None


@cache
def _gives_rows(kind: type) -> bool:
    return issubclass(kind, StoredFrames)  # which is slow to find out


@runtime_checkable
class ShrunkFrames(Protocol):
    """A clip that keeps coarse copies of some of its frames."""

    def shrunk(self, index: int) -> tuple[NDArray[np.float32], float]:
        """A frame as ``shrink`` gives it; raises as ``read``."""


class FrameArray:
    """Frames held in one array (frames, rows, columns): for notebooks and tests."""

    def __init__(self, values: NDArray[Any], full_scale: float | None = None) -> None:
        """Take the frames; ``full_scale`` is that of their type unless given."""
        self._values = values
        self._full_scale = full_scale or float(np.iinfo(values.dtype).max)

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self._values)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self._values.shape[1], self._values.shape[2]

    @property
    def full_scale(self) -> float:
        """The highest grey level."""
        return self._full_scale

    def read(self, index: int, region: tuple[int, int, int, int] | None = None) -> NDArray[Any]:
        """Grey levels of frame ``index``."""
        if region is None:
            return np.asarray(self._values[index])
        x0, y0, x1, y1 = region
        return np.asarray(self._values[index, y0:y1, x0:x1])


def read_patch(
    frames: Frames, index: int, background: Background, box: tuple[float, float, float, float]
) -> Patch | str:
    """Read and flatten the part of frame ``index`` inside ``box`` (left, top, right, bottom in px, cut to the frame).

    Returns a status word instead where the frame cannot be read or the box lies outside.
    """
    rows, columns = frames.shape
    x0, y0 = max(0, int(box[0])), max(0, int(box[1]))
    x1, y1 = min(columns, int(box[2]) + 2), min(rows, int(box[3]) + 2)
    if x1 - x0 < 8 or y1 - y0 < 8:
        outside = box[2] < 8 or box[3] < 8 or box[0] > columns - 8 or box[1] > rows - 8
        return "out_of_frame" if outside else "short_arc"
    try:
        raw = frames.read(index, (x0, y0, x1, y1))
    except FrameUnreadableError as error:
        return error.status
    return cut_patch(raw, x0, y0, background)


def read_shrunk(frames: Frames, index: int) -> tuple[NDArray[np.float32], float]:
    """Read a whole frame for a coarse look: as ``shrink`` gives it. Raises as ``Frames.read``."""
    return frames.shrunk(index) if isinstance(frames, ShrunkFrames) else shrink(frames.read(index))


def read_samples(frames: Frames, indices: list[int]) -> NDArray[Any]:
    """Read whole frames, those that can be read, into one array (frames, rows, columns).

    Raises ``FrameUnreadableError`` where none can.
    """
    found: list[NDArray[Any]] = []
    for index in indices:
        try:
            found.append(frames.read(index))
        except FrameUnreadableError as error:
            last = error
    if not found:
        raise last
    return np.stack(found)
