"""A TIFF file with a frame a page, read page by page: uncompressed grey pages straight from their rows.

The directories are walked once; what stays in memory is one number a page. Compressed pages are cut out as a file of
their own and decoded, so the cost of page 1000 is that of page 1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.decoding import decode_grey
from wentry_cli.frames.depth import CONTAINER, sampled_depth
from wentry_cli.frames.reader import RATE_UNKNOWN, Frame, RecordingInfo, Region, checked_index, checked_region
from wentry_cli.frames.tiff_directory import (
    DESCRIPTION,
    STRIP_BYTES,
    STRIPS,
    TiffPage,
    page_numbers,
    read_directories,
    read_directory,
    value_bytes,
)
from wentry_cli.frames.tiff_extract import page_as_file

IMAGEJ_PAGES = re.compile(rb"^ImageJ=.*^images=(\d{1,9})$", re.DOTALL | re.MULTILINE)
WHITE_IS_ZERO, BLACK_IS_ZERO = 0, 1
LARGEST_SIDE_PX = 1 << 16


def open_tiff_stack(path: Path, frames: tuple[int, int] | None = None) -> TiffStack:
    """Open ``path``; ``frames`` (first, last) is the part that will be used: a file cut off behind it is accepted.

    Raises InputError where a directory is damaged, the pages differ in size or are not 8 or 16 bit.
    """
    file = BlockFile(path)
    try:
        return TiffStack(file, _walk(file, frames))
    except FrameUnreadableError as error:
        file.close()
        raise InputError(f"{error}; the file is damaged or was not copied whole") from error
    except InputError:
        file.close()
        raise


@dataclass(frozen=True)
class _Walk:
    """What one walk over the directories leaves: the first page, and of each page where its directory and rows lie."""

    first: TiffPage
    directories: NDArray[np.int64]
    begins: NDArray[np.int64]  # −1 where a page must be decoded
    notes: tuple[str, ...]


def _walk(file: BlockFile, frames: tuple[int, int] | None) -> _Walk:
    first: TiffPage | None = None
    directories: list[int] = []
    begins: list[int] = []
    notes: tuple[str, ...] = ()
    try:
        for page in read_directories(file):
            if page.reduced:
                continue
            first = first or page
            _check_page(file, page, first, len(begins))
            directories.append(page.offset)
            begins.append(_plain_begin(file, page))
    except FrameUnreadableError as error:
        whole = len(begins)
        pages = "page" if whole == 1 else f"{whole} pages"
        if not whole or frames is None or max(frames) >= whole:
            advice = f"; set `frames: [0, {whole - 1}]` in the view to use the {pages} before it" if whole else ""
            raise InputError(f"{error}{advice}") from error
        notes = (f"the file is damaged after {whole} page{'s' if whole > 1 else ''}",)
    if first is None:
        raise InputError(f"{file.path}: a TIFF without a page")
    begins = _imagej_begins(file, first, begins)
    return _Walk(first, np.array(directories, np.int64), np.array(begins, np.int64), notes)


class TiffStack:
    """Pages of a TIFF; of a decoded page the last is kept, so regions of one page decode it once."""

    def __init__(self, file: BlockFile, walk: _Walk) -> None:
        """Take an open file and what the walk over it found."""
        self._file, self._walk = file, walk
        self.close = file.close
        first = walk.first
        self._word = np.dtype(np.uint8 if first.bits == 8 else first.order + "u2")
        self._last: tuple[int, Frame] | None = None
        self._shift, depth, notes = 0, first.bits, walk.notes
        if depth == CONTAINER:
            depth, self._shift, note = sampled_depth(self._whole, int(walk.begins.size))
            notes += (note,)
        colour = ", colour, converted to grey" if first.channels > 1 else ""
        self.info = RecordingInfo(
            path=file.path,
            format=f"TIFF of {walk.begins.size} pages, {first.bits} bit{colour}",
            frame_count=int(walk.begins.size),
            width=first.width,
            height=first.height,
            bit_depth=depth,
            fps=None,
            fps_source=RATE_UNKNOWN,
            exposure_s=None,
            notes=notes,
            random_access=bool((walk.begins >= 0).all()),
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the page numbers from 0: the format keeps no others."""
        return np.arange(self.info.frame_count, dtype=np.int64)

    def times_s(self) -> None:
        """Return None: the format has no stamps."""

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return page ``index``; a region of a plain page costs the bytes of its rows."""
        index = checked_index(index, self.info)
        levels = self._region(index, checked_region(region, self.info))
        return levels >> self._shift if self._shift else levels

    def _whole(self, index: int) -> Frame:
        return self._region(index, (0, 0, self._walk.first.width, self._walk.first.height))

    def _region(self, index: int, region: Region) -> Frame:
        x0, y0, x1, y1 = region
        first = self._walk.first
        if self._walk.begins[index] < 0:
            if self._last is None or self._last[0] != index:
                self._last = (index, self._decode(index))
            return self._last[1][y0:y1, x0:x1].copy()
        pitch = first.width * self._word.itemsize
        rows = self._file.read(int(self._walk.begins[index]) + y0 * pitch, (y1 - y0) * pitch)
        levels = rows.view(self._word).reshape(y1 - y0, -1)[:, x0:x1]
        native = levels.astype(np.uint8 if self._word.itemsize == 1 else np.uint16)
        return np.invert(native) if first.photometric == WHITE_IS_ZERO else native

    def _decode(self, index: int) -> Frame:
        first = self._walk.first
        page, _ = read_directory(self._file, int(self._walk.directories[index]), first.order, first.big)
        image = decode_grey(page_as_file(self._file, page), f"{self._file.path}, page {index}")
        if image.shape != (first.height, first.width):
            raise FrameUnreadableError(f"{self._file.path}: page {index} decoded to another size")
        return image


def _check_page(file: BlockFile, page: TiffPage, first: TiffPage, index: int) -> None:
    where = f"{file.path}: page {index}"
    if not (0 < page.width <= LARGEST_SIDE_PX and 0 < page.height <= LARGEST_SIDE_PX):
        raise InputError(f"{where} claims {page.width} x {page.height} pixels; the file is damaged")
    if page.bits not in (8, 16) or page.sample_format != 1:
        kind = " floating-point or signed" if page.sample_format != 1 else ""
        raise InputError(f"{where} has{kind} levels of {page.bits} bit; save it with 8 or 16 bit")
    if (page.width, page.height, page.bits) != (first.width, first.height, first.bits):
        raise InputError(
            f"{where} has {page.width} x {page.height} pixels of {page.bits} bit, page 0 has "
            f"{first.width} x {first.height} of {first.bits} bit; save frames of one size"
        )


def _plain_begin(file: BlockFile, page: TiffPage) -> int:
    """Return where the rows of an uncompressed grey page begin if they lie together, else −1."""
    if (
        page.compression != 1
        or page.channels != 1
        or page.tiled
        or page.photometric not in (WHITE_IS_ZERO, BLACK_IS_ZERO)
    ):
        return -1
    strips, sizes = page_numbers(file, page, STRIPS), page_numbers(file, page, STRIP_BYTES)
    size = page.width * page.height * page.bits // 8
    if len(strips) == 1 and len(sizes) <= 1:
        return strips[0]
    if len(strips) != len(sizes) or sum(sizes) != size or not strips:
        return -1
    together = all(strips[i] + sizes[i] == strips[i + 1] for i in range(len(strips) - 1))
    return strips[0] if together else -1


def _imagej_begins(file: BlockFile, page: TiffPage, begins: list[int]) -> list[int]:
    """Return the pages of a large ImageJ stack, which has one directory and says in its description how many follow."""
    entry = page.entries.get(DESCRIPTION)
    if len(begins) != 1 or begins[0] < 0 or entry is None:
        return begins
    match = IMAGEJ_PAGES.search(value_bytes(file, entry, page.order, page.big))
    size = page.width * page.height * page.bits // 8
    whole = (file.size - begins[0]) // size
    count = int(match.group(1)) if match else 1
    if count > whole:
        raise InputError(f"{file.path}: says it holds {count} frames, but only {whole} are whole; copy it again")
    return [begins[0] + i * size for i in range(max(1, count))]
