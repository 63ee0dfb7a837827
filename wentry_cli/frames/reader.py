"""The one protocol behind which every recording is read, and what is known of a recording before it is read.

A recording is lazy: opening it reads headers, ``read`` touches the bytes of one frame (of its rows, where the format
allows) and nothing is kept but a frame or two. Frames are numbered from 0; a gap in the camera's numbering is a frame
that cannot be read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Region = tuple[int, int, int, int]
"""x0, y0, x1, y1 in pixels of the recording, half-open."""

Frame = NDArray[Any]
"""Raw grey levels, (rows, columns), uint8 or uint16."""

StoredRows = tuple[NDArray[Any], int, bool]
"""Whole rows as they are stored, in which pixel of them column 0 lies, and whether they are packed.

They are grey levels (rows, columns), or where packed bytes, two pixels of 12 bits in three.
"""

RATE_UNKNOWN = "unknown"
RATE_OF_PLAYBACK = "container playback rate"
RATE_GIVEN = "given"


@dataclass(frozen=True)
class RecordingInfo:
    """What a header says of a recording.

    ``bit_depth`` counts the significant bits of a grey level (8, 10, 12, 14, 16; of the container where the file does
    not say); ``fps`` is in frames per second of the camera where ``rate_trusted``; ``duplicates`` counts files that
    claim a frame number already taken, ``gaps`` the frame numbers that are missing; ``unreadable`` names the images of
    which not even the header can be read; ``notes`` are what a user should see; ``random_access`` tells that a region
    costs the bytes of its rows, not the decoding of its frame, ``in_sequence`` that a frame costs the decoding of those
    before it.
    """

    path: Path
    format: str
    frame_count: int
    width: int
    height: int
    bit_depth: int
    fps: float | None
    fps_source: str
    exposure_s: float | None
    duplicates: int = 0
    gaps: int = 0
    unreadable: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    random_access: bool = False
    in_sequence: bool = False

    @property
    def rate_trusted(self) -> bool:
        """Whether ``fps`` is the camera's rate: a video container only tells how fast it is to be played."""
        return self.fps is not None and self.fps_source not in {RATE_UNKNOWN, RATE_OF_PLAYBACK}


class Recording(Protocol):
    """A sequence of grey frames; memory does not grow with its length."""

    @property
    def info(self) -> RecordingInfo:
        """What the header says."""

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index`` or the part of it in ``region``: raw grey levels, uint8 or uint16, (rows, columns).

        The array belongs to the caller. Raises ``FrameUnreadableError`` (status ``bad_frame`` or ``gap``) where the
        frame is damaged or missing, IndexError and ValueError for a frame or region that does not exist.
        """

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the number that the camera (or the file name) gave to each frame, length ``frame_count``."""

    def times_s(self) -> NDArray[np.float64] | None:
        """Return the camera's stamp of each frame, start of exposure, 0 at the first; None where there are none."""

    def close(self) -> None:
        """Close the files; the recording cannot be read afterwards."""


@runtime_checkable
class StoresRows(Protocol):
    """A recording that may hand out rows of a frame as they are stored."""

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Rows (first, behind the last) of a frame, valid until the next is read; None where that is not possible.

        Of these, those ``unread`` (in the same way; the last number twice for none) hold anything.
        """


def checked_index(index: int, info: RecordingInfo) -> int:
    """Return ``index`` as a plain int, which byte offsets cannot overflow.

    Raises IndexError unless the recording has that frame; negative numbers do not count from the end.
    """
    if not 0 <= index < info.frame_count:
        raise IndexError(f"{info.path}: no frame {index}, the recording has {info.frame_count}")
    return int(index)


def checked_region(region: Region | None, info: RecordingInfo) -> Region:
    """Return ``region`` in plain ints, the whole frame for None; ValueError where it is empty or leaves the frame."""
    if region is None:
        return (0, 0, info.width, info.height)
    x0, y0, x1, y1 = map(int, region)
    if not (0 <= x0 < x1 <= info.width and 0 <= y0 < y1 <= info.height):
        raise ValueError(f"region {region} is empty or not within {info.width} x {info.height} pixels")
    return (x0, y0, x1, y1)
