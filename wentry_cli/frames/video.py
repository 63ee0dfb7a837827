"""Video containers (AVI, MP4, MOV, MKV) through OpenCV, read in sequence.

Seeking in a compressed stream is not exact, so frames are decoded in order; a few of the last are kept, and going back
begins again at the start. A container tells how fast to play, not how fast the camera ran.
"""

from __future__ import annotations

import os
import re
from collections import OrderedDict
from pathlib import Path
from typing import Any

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
LEAST_FRAME_BYTES = 8  # what the smallest frame takes in a container, its entry in the index included
MOST_TRIES = 1000  # at frames that cannot be decoded, where the container does not say how many there are
SHORTEST_INTERVAL_S = 0.004  # containers that keep time in milliseconds tell frames apart down to this
OFF_GRID = 0.1  # of an interval
HEADER_BYTES = 1 << 20  # looked at for the name of a codec, at either end
_CODEC = re.compile(rb"strh.{4}vids([ -~]{4})|vmhd.{0,400}?stsd.{12}([ -~]{4})", re.DOTALL)


def open_video(path: Path, frames: tuple[int, int] | None = None) -> VideoRecording:
    """Open the video at ``path``; ``frames`` (first, last) is the part used.

    Frames that the container claims and that cannot be decoded, because it was cut off or is damaged, are bad frames.
    Raises InputError where no codec reads it, where not one frame can be decoded, and where the container claims more
    frames than its bytes can hold, unless those used can be read.
    """
    return VideoRecording(path, frames)


class _Stream:
    """Frames of a video as the decoder delivers them, each with its place in the clip.

    A frame that cannot be decoded is skipped by the decoder, with or without a word; the times of the frames around it
    tell how many are missing, where they lie on a grid.
    """

    def __init__(self, path: Path) -> None:
        built_in = cv2.CAP_FFMPEG in cv2.videoio_registry.getStreamBackends()
        self._capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG if built_in else cv2.CAP_ANY)
        if not self._capture.isOpened():
            codec = _codec_of(path)
            raise InputError(
                f"{path}: no codec here reads this video{f' of codec {codec}' if codec else ''}; copy it again if it "
                f"was cut off (an MP4 has its index at the end), or convert it, for example to FFV1 or MJPG in AVI"
            )
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)  # turned as its metadata say
        self.next = 0
        self._zero_s: float | None = None
        fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.fps = fps if np.isfinite(fps) and fps > 0 else None
        self.claimed = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self.close = self._capture.release

    @property
    def codec(self) -> str:
        """Four letters."""
        code = int(self._capture.get(cv2.CAP_PROP_FOURCC)) & 0xFFFFFFFF
        letters = code.to_bytes(4, "little").decode("ascii", errors="replace")
        return letters.strip("\0 ") if letters.isprintable() and letters.strip("\0 ") else "of unknown codec"

    def grab(self) -> int | None:
        """Go to the next frame; its place in the clip, or None where it cannot be decoded (or there is none)."""
        if not self._capture.grab():
            self.next += 1
            return None
        place = self._place_by_time()
        self.next = place + 1
        return place

    def _place_by_time(self) -> int:
        interval = 1.0 / self.fps if self.fps is not None else 0.0
        if interval < SHORTEST_INTERVAL_S:
            return self.next
        time_s = float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) / 1000.0
        if self._zero_s is None:
            self._zero_s = time_s - self.next * interval
        steps = (time_s - self._zero_s) / interval
        place = round(steps)
        return place if place > self.next and abs(steps - place) < OFF_GRID else self.next

    def image(self) -> NDArray[Any] | None:
        """The frame that was gone to; None where it cannot be decoded."""
        ok, image = self._capture.retrieve()
        return np.asarray(image) if ok else None

    def ends_as_claimed(self) -> bool:
        """Whether the last frame that the container claims is there and is the last; leaves the stream at its end."""
        last = self.claimed - 1
        if last < 0:
            return False
        self._capture.set(cv2.CAP_PROP_POS_FRAMES, last)
        at_last = int(self._capture.get(cv2.CAP_PROP_POS_FRAMES)) == last
        return at_last and self._capture.grab() and not self._capture.grab()


def _codec_of(path: Path) -> str:
    """The four letters that the header of an AVI, MP4 or MOV gives to its codec; empty where it names none."""
    try:
        with path.open("rb") as stream:
            start = stream.read(HEADER_BYTES)
            stream.seek(max(0, path.stat().st_size - HEADER_BYTES))
            found = _CODEC.search(start) or _CODEC.search(stream.read())  # an MP4 may have its header at the end
    except OSError:
        return ""
    return (found[1] or found[2]).decode("ascii").strip() if found else ""


class VideoRecording:
    """Frames of a video, decoded in order."""

    def __init__(self, path: Path, frames: tuple[int, int] | None = None) -> None:
        """Open the video and decode its first frame; InputError where that fails."""
        self._path = path
        self._stream: _Stream | None = None
        self._kept: OrderedDict[int, Frame] = OrderedDict()
        count, note = _count(path, frames)
        self._stream = stream = _Stream(path)
        first = self._first_image(stream, count)
        grey = self._kept[stream.next - 1]
        coloured = first.ndim == 3 and int(np.ptp(first, axis=2).max()) > LARGEST_GREY_SPREAD
        self.info = RecordingInfo(
            path=path,
            format=f"video {stream.codec}" + (", colour, converted to grey" if coloured else ""),
            frame_count=count,
            width=grey.shape[1],
            height=grey.shape[0],
            bit_depth=8 * grey.dtype.itemsize,
            fps=stream.fps,
            fps_source=RATE_UNKNOWN if stream.fps is None else RATE_OF_PLAYBACK,
            exposure_s=None,
            notes=(note,) if note else (),
            in_sequence=True,
        )

    def _first_image(self, stream: _Stream, count: int) -> NDArray[Any]:
        """Decode the first frame that can be decoded, and keep it; InputError if there is none."""
        while stream.next < count:
            place = stream.grab()
            image = None if place is None else stream.image()
            if place is not None and image is not None:
                self._keep(place, to_grey(image, str(self._path)))
                return image
        stream.close()
        raise InputError(f"{self._path}: the video has no frame that can be decoded; copy it again or convert it")

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the numbers from 0: containers keep no others."""
        return np.arange(self.info.frame_count, dtype=np.int64)

    def times_s(self) -> None:
        """Return None: the stamps of a container are those of playback."""

    def close(self) -> None:
        """Release the decoder."""
        if self._stream is not None:
            self._stream.close()
        self._stream = None
        self._kept.clear()

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index``; forwards costs what lies between, backwards begins again at the start."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        if index not in self._kept:
            self._advance(index)
        return self._kept[index][y0:y1, x0:x1].copy()

    def _advance(self, index: int) -> None:
        if self._stream is None or index < self._stream.next:
            self.close()
            self._stream = _Stream(self._path)
        stream, place = self._stream, None
        while stream.next <= index:
            place = stream.grab()
        image = None if place is None else stream.image()
        if image is not None and place is not None:
            grey = to_grey(image, str(self._path))
            if grey.shape != (self.info.height, self.info.width):
                raise FrameUnreadableError(f"{self._path}: frame {place} has another size")
            self._keep(place, grey)  # also where it is the one behind a frame that is missing
        if index not in self._kept:
            raise FrameUnreadableError(f"{self._path}: frame {index} cannot be decoded")

    def _keep(self, index: int, grey: Frame) -> None:
        self._kept[index] = grey
        while len(self._kept) > KEPT_FRAMES:
            self._kept.popitem(last=False)


def _count(path: Path, frames: tuple[int, int] | None) -> tuple[int, str]:
    """How many frames the clip has, those that cannot be decoded included, and what is to be said of that.

    What the container claims holds if its last frame is there; else all are counted.
    """
    stream = _Stream(path)
    try:
        if stream.ends_as_claimed():
            return stream.claimed, ""
    finally:
        stream.close()
    possible = path.stat().st_size // LEAST_FRAME_BYTES
    sound = 0 < stream.claimed <= possible
    found, end = _count_by_reading(path, stream.claimed if sound else 0)
    claims = f"the container claims {stream.claimed} frames, {found} can be read"
    if sound and end <= stream.claimed:
        return stream.claimed, claims
    if stream.claimed > possible and not (frames is not None and max(frames) < end):
        advice = f", or set `frames: [0, {end - 1}]` in the view" if end else ""
        raise InputError(f"{path}: {claims}; its header is damaged: copy it again{advice}")
    return end, claims


def _count_by_reading(path: Path, claimed: int) -> tuple[int, int]:
    """How many frames can be decoded, and the place behind the last of them."""
    stream = _Stream(path)
    found = end = 0
    try:
        while stream.next < claimed or stream.next <= end + MOST_TRIES:
            place = stream.grab()
            if place is not None:
                found, end = found + 1, place + 1
            elif stream.next >= max(claimed, end + 1) and claimed > 0:
                break
    finally:
        stream.close()
    return found, end
