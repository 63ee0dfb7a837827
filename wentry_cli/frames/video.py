"""Video containers (AVI, MP4, MOV, MKV) through OpenCV, read in sequence.

Seeking in a compressed stream is not exact, so frames are decoded in order; a few of the last are kept, and going back
begins again at the start. A container tells how fast to play, not how fast the camera ran.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.reader import (
    RATE_OF_PLAYBACK,
    RATE_UNKNOWN,
    Frame,
    RecordingInfo,
    Region,
    checked_index,
    checked_region,
)

os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # a damaged file becomes one sentence, not a page of warnings

import cv2

from wentry_cli.frames.decoding import to_grey

KEPT_FRAMES = 8
LARGEST_GREY_SPREAD = 8  # levels by which the channels of a grey image may differ after compression


def open_video(path: Path) -> VideoRecording:
    """Open the video at ``path``; InputError where no codec reads it or it has no frame."""
    return VideoRecording(path)


def _capture(path: Path) -> cv2.VideoCapture:
    built_in = cv2.CAP_FFMPEG in cv2.videoio_registry.getStreamBackends()
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG if built_in else cv2.CAP_ANY)
    if not capture.isOpened():
        raise InputError(f"{path}: no codec here reads this video; convert it, for example to FFV1 or MJPG in AVI")
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)  # turned as its metadata say
    return capture


class VideoRecording:
    """Frames of a video, decoded in order."""

    def __init__(self, path: Path) -> None:
        """Open the video and decode its first frame; InputError where that fails."""
        self._path = path
        self._capture: cv2.VideoCapture | None = _capture(path)
        self._next = 0
        self._kept: OrderedDict[int, Frame] = OrderedDict()
        claimed = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        known = bool(np.isfinite(fps)) and fps > 0
        ok, first = self._capture.read()
        if not ok:
            self.close()
            raise InputError(f"{path}: the video has no frame that can be decoded; it is damaged or cut off")
        count = _true_count(path, claimed)
        self._next = 1
        grey = to_grey(first, str(path))
        self._keep(0, grey)
        coloured = first.ndim == 3 and int(np.ptp(first, axis=2).max()) > LARGEST_GREY_SPREAD
        lies = f"the container claims {claimed} frames, {count} can be read"
        self.info = RecordingInfo(
            path=path,
            format=f"video {_codec(self._capture)}" + (", colour, converted to grey" if coloured else ""),
            frame_count=count,
            width=grey.shape[1],
            height=grey.shape[0],
            bit_depth=8 * grey.dtype.itemsize,
            fps=fps if known else None,
            fps_source=RATE_OF_PLAYBACK if known else RATE_UNKNOWN,
            exposure_s=None,
            notes=(lies,) if count != claimed else (),
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the numbers from 0: containers keep no others."""
        return np.arange(self.info.frame_count, dtype=np.int64)

    def times_s(self) -> None:
        """Return None: the stamps of a container are those of playback."""

    def close(self) -> None:
        """Release the decoder."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None
        self._kept.clear()

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index``; forwards costs what lies between, backwards begins again at the start."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        if index not in self._kept:
            self._advance(index)
        return self._kept[index][y0:y1, x0:x1].copy()

    def _advance(self, index: int) -> None:
        if self._capture is None or index < self._next:
            self.close()
            self._capture, self._next = _capture(self._path), 0
        while self._next < index:
            self._capture.grab()
            self._next += 1
        self._next += 1
        ok, image = self._capture.read()
        if not ok:
            raise FrameUnreadableError(f"{self._path}: frame {index} cannot be decoded")
        grey = to_grey(image, str(self._path))
        if grey.shape != (self.info.height, self.info.width):
            raise FrameUnreadableError(f"{self._path}: frame {index} has another size")
        self._keep(index, grey)

    def _keep(self, index: int, grey: Frame) -> None:
        self._kept[index] = grey
        while len(self._kept) > KEPT_FRAMES:
            self._kept.popitem(last=False)


def _true_count(path: Path, claimed: int) -> int:
    """Return how many frames can be read: what the container claims if its last frame is there, else by counting."""
    capture = _capture(path)
    try:
        if claimed > 0:
            capture.set(cv2.CAP_PROP_POS_FRAMES, claimed - 1)
            if int(capture.get(cv2.CAP_PROP_POS_FRAMES)) == claimed - 1 and capture.grab() and not capture.grab():
                return claimed
    finally:
        capture.release()
    capture = _capture(path)
    try:
        count = 0
        while capture.grab():
            count += 1
        return count
    finally:
        capture.release()


def _codec(capture: cv2.VideoCapture) -> str:
    code = int(capture.get(cv2.CAP_PROP_FOURCC)) & 0xFFFFFFFF
    letters = code.to_bytes(4, "little").decode("ascii", errors="replace")
    return letters.strip("\0 ") if letters.isprintable() and letters.strip("\0 ") else "of unknown codec"
