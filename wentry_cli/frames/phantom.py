"""Phantom recordings (``.cine``): 8 and 16 bit, 10 bit packed with its linearisation, 12 bit packed.

Rows are stored from the bottom up unless they are packed. Each image is preceded by an annotation whose length stands
before it.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.linearisation import levels_of_10bit_codes
from wentry_cli.frames.packed import unpack_10bit, unpack_12bit
from wentry_cli.frames.phantom_header import CineHeader, read_cine_header
from wentry_cli.frames.reader import Frame, RecordingInfo, Region, checked_index, checked_region

LARGEST_ANNOTATION = 1 << 20


def open_phantom(path: Path, frames: tuple[int, int] | None = None) -> PhantomRecording:
    """Open the cine at ``path``; ``frames`` (first, last) is the part used: a file cut off behind it is accepted.

    The recording then ends with its last whole image. Raises InputError where the header is damaged, the images are
    compressed or colour, or the file was cut off.
    """
    file = BlockFile(path)
    try:
        header, notes = _without_cut(file, read_cine_header(file), frames)
    except InputError:
        file.close()
        raise
    return PhantomRecording(file, header, notes)


def _without_cut(
    file: BlockFile, header: CineHeader, frames: tuple[int, int] | None
) -> tuple[CineHeader, tuple[str, ...]]:
    """Return the header without the images behind the end of the file; InputError if they are among those asked for."""
    inside = (header.offsets >= 0) & (header.offsets <= file.size - 8 - header.layout.image_bytes)
    missing = int(np.count_nonzero(~inside))
    if missing == 0:
        return header, ()
    whole = header.offsets.size - missing
    if whole and not inside[:whole].all():
        return header, (f"{missing} images lie outside the file",)  # damage in the midst: those frames alone are bad
    said = f"{file.path}: {file.size} bytes hold {whole} of the {header.offsets.size} images that the header claims"
    if whole and frames is not None and max(frames) < whole:
        times = None if header.times_s is None else header.times_s[:whole]
        return replace(header, offsets=header.offsets[:whole], times_s=times), (f"cut off after {whole} images",)
    advice = f", or set `frames: [0, {whole - 1}]` in the view to use the whole ones" if whole else ""
    raise InputError(f"{said}; the file was cut off: copy it again{advice}")


class PhantomRecording:
    """Images of a cine, read row block by row block."""

    def __init__(self, file: BlockFile, header: CineHeader, notes: tuple[str, ...]) -> None:
        """Take an open file and its header; ``notes`` are added to those of the header."""
        self._file, self._header = file, header
        self.close = file.close
        self._layout = header.layout
        self._levels = levels_of_10bit_codes()
        packed = " packed" if header.layout.packed else ""
        self.info = RecordingInfo(
            path=file.path,
            format=f"Phantom cine, {header.layout.bits} bit{packed}",
            frame_count=int(header.offsets.size),
            width=header.layout.width,
            height=header.layout.height,
            bit_depth=header.layout.bit_depth,
            fps=header.fps,
            fps_source=header.fps_source,
            exposure_s=header.exposure_s,
            notes=header.notes + notes,
            random_access=True,
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the camera's image numbers, 0 at the trigger."""
        return self._header.first_number + np.arange(self.info.frame_count, dtype=np.int64)

    def times_s(self) -> NDArray[np.float64] | None:
        """Return the camera's stamps from the first image, None where the file has none."""
        return None if self._header.times_s is None else self._header.times_s.copy()

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return grey levels of image ``index``, top row first; a region costs the bytes of its rows."""
        index = checked_index(index, self.info)
        window = checked_region(region, self.info)
        begin = self._pixels_begin(index)
        if self._layout.packed:
            return self._read_packed(begin, window)
        x0, y0, x1, y1 = window
        height, pitch, bits = self._layout.height, self._layout.pitch, self._layout.bits
        first = height - y1 if self._layout.bottom_up else y0
        rows = self._file.read(begin + first * pitch, (y1 - y0) * pitch).reshape(y1 - y0, pitch)
        if self._layout.bottom_up:
            rows = rows[::-1]
        if bits == 8:
            return rows[:, x0:x1].copy()
        return np.ascontiguousarray(rows[:, 2 * x0 : 2 * x1]).view("<u2").astype(np.uint16, copy=False)

    def _pixels_begin(self, index: int) -> int:
        """Return where the pixels of image ``index`` begin, behind its annotation."""
        offset = int(self._header.offsets[index])
        damaged = f"{self._file.path}: image {index} is damaged"
        (annotation,) = struct.unpack("<I", self._file.bytes_at(offset, 4))
        if not 8 <= annotation <= LARGEST_ANNOTATION:
            raise FrameUnreadableError(f"{damaged}: its annotation claims {annotation} bytes")
        (size,) = struct.unpack("<I", self._file.bytes_at(offset + annotation - 4, 4))
        if size != self._layout.image_bytes:
            raise FrameUnreadableError(f"{damaged}: it claims {size} bytes, not {self._layout.image_bytes}")
        return offset + int(annotation)

    def _read_packed(self, begin: int, window: Region) -> Frame:
        x0, y0, x1, y1 = window
        width, bits = self._layout.width, self._layout.bits
        group_pixels, group_bytes = (4, 5) if bits == 10 else (2, 3)
        start = y0 * width + x0
        group = start // group_pixels
        end = (y1 - 1) * width + x1
        last = min((end + group_pixels - 1) // group_pixels * group_bytes, self._layout.image_bytes)
        packed = self._file.read(begin + group * group_bytes, last - group * group_bytes)
        out = np.empty((y1 - y0, x1 - x0), np.uint16)
        if bits == 10:
            unpack_10bit(packed, start - group * group_pixels, width, self._levels, out)
        else:
            unpack_12bit(packed, start - group * group_pixels, width, out)
        return out
