"""A recording as the measurement sees it: turned, mirrored, cropped to a region and to a range of frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import InputError
from wentry_cli.frames.reader import (
    Frame,
    Recording,
    Region,
    StoredRows,
    StoresRows,
    checked_index,
    checked_region,
)

FLIPS = ("none", "h", "v")


def orient(
    recording: Recording,
    *,
    rotate: int = 0,
    flip: str = "none",
    roi_px: Region | None = None,
    frames: tuple[int, int] | None = None,
) -> Oriented:
    """Return ``recording`` turned clockwise by ``rotate`` degrees, then mirrored, then cropped.

    ``flip`` is 'h' (left and right change places) or 'v' (top and bottom); ``roi_px`` counts in the turned and
    mirrored image, x0, y0, x1, y1 half-open; ``frames`` is (first, last), both included. Pixel (0, 0) of the result is
    the corner of the region, ``Oriented.origin_px``. Raises InputError where region or range lie outside the recording,
    ValueError for another angle or mirror.
    """
    if rotate not in (0, 90, 180, 270) or flip not in FLIPS:
        raise ValueError(f"rotate {rotate} is none of 0, 90, 180, 270, or flip {flip!r} none of {FLIPS}")
    info = recording.info
    width, height = (info.width, info.height) if rotate in (0, 180) else (info.height, info.width)
    roi = tuple(roi_px) if roi_px is not None else (0, 0, width, height)
    x0, y0, x1, y1 = roi
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise InputError(f"{info.path}: roi_px {list(roi)} is not within the image of {width} x {height} pixels")
    first, last = frames if frames is not None else (0, info.frame_count - 1)
    if not 0 <= first <= last < info.frame_count:
        raise InputError(
            f"{info.path}: frames [{first}, {last}] are not within the clip, "
            f"whose frames are 0 to {info.frame_count - 1}"
        )
    return Oriented(recording, _Turn(rotate, flip, width, height), (x0, y0, x1, y1), (first, last))


class _Turn:
    """The map between the raw image and the turned and mirrored one of ``width`` x ``height`` pixels."""

    def __init__(self, rotate: int, flip: str, width: int, height: int) -> None:
        self.rotate, self.flip, self.width, self.height = rotate, flip, width, height

    def raw_region(self, region: Region) -> Region:
        """Return the region of the raw image that becomes ``region``."""
        x0, y0, x1, y1 = region
        if self.flip == "h":
            x0, x1 = self.width - x1, self.width - x0
        elif self.flip == "v":
            y0, y1 = self.height - y1, self.height - y0
        if self.rotate == 90:
            return (y0, self.width - x1, y1, self.width - x0)
        if self.rotate == 180:
            return (self.width - x1, self.height - y1, self.width - x0, self.height - y0)
        if self.rotate == 270:
            return (self.height - y1, x0, self.height - y0, x1)
        return (x0, y0, x1, y1)

    def apply(self, raw: Frame) -> Frame:
        """Return ``raw`` turned and mirrored."""
        turned = np.rot90(raw, -self.rotate // 90) if self.rotate else raw
        if self.flip == "h":
            turned = turned[:, ::-1]
        elif self.flip == "v":
            turned = turned[::-1]
        return np.ascontiguousarray(turned)


class Oriented:
    """A recording behind the same protocol; regions are mapped to regions of the raw frames, so they stay cheap.

    ``origin_px`` is the corner of the region in the turned and mirrored image, ``first_index`` the index of frame 0 in
    the clip.
    """

    def __init__(self, recording: Recording, turn: _Turn, roi: Region, frames: tuple[int, int]) -> None:
        """Take checked arguments: ``orient`` checks them."""
        self._recording, self._turn = recording, turn
        upright = turn.rotate == 0 and turn.flip == "none"
        self._stored = recording if upright and isinstance(recording, StoresRows) else None
        self.origin_px = (roi[0], roi[1])
        self.first_index, self._last_index = frames
        self.close = recording.close
        info = recording.info
        self.info = replace(
            info,
            width=roi[2] - roi[0],
            height=roi[3] - roi[1],
            frame_count=frames[1] - frames[0] + 1,
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the camera's numbers of the frames in the range."""
        return self._recording.camera_frames()[self.first_index : self._last_index + 1]

    def times_s(self) -> NDArray[np.float64] | None:
        """Return the camera's stamps of the frames in the range, 0 at its first."""
        times = self._recording.times_s()
        if times is None:
            return None
        part: NDArray[np.float64] = times[self.first_index : self._last_index + 1]
        return np.asarray(part - part[0])

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index`` of the range, or ``region`` of it, as the measurement sees it."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        left, top = self.origin_px
        raw = self._turn.raw_region((x0 + left, y0 + top, x1 + left, y1 + top))
        return self._turn.apply(self._recording.read(self.first_index + index, raw))

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Return rows of frame ``index`` as the recording stores them; None where it gives none, or they are turned."""
        if self._stored is None:
            return None
        left, top = self.origin_px
        first = self.first_index + checked_index(index, self.info)
        found = self._stored.stored_rows(first, (rows[0] + top, rows[1] + top), (unread[0] + top, unread[1] + top))
        return found and (found[0], found[1] + left, found[2])
