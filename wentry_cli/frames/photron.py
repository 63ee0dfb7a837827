"""Photron recordings: a header (``.cihx`` or ``.cih``) and the frames in an ``.mraw`` beside it.

Frames follow each other without padding: 8 bits a pixel, 12 bits packed most significant first, or 16-bit little-endian
words of which ``EffectiveBit`` tells the significant ones.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import InputError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.packed import unpack_12bit
from wentry_cli.frames.photron_header import PhotronHeader, read_photron_header
from wentry_cli.frames.reader import Frame, RecordingInfo, Region, StoredRows, checked_index, checked_region

ALMOST_ALL = 0.9  # of the frames: what ends with one of the last ended early, though others might fill the file
STORED_BITS = (8, 12, 16)


def open_photron(path: Path, frames: tuple[int, int] | None = None) -> PhotronRecording:
    """Open the recording of ``path``, its header or its MRAW.

    ``frames`` (first, last) is the part that will be used: an MRAW that was cut short is accepted if that is whole, and
    the recording then ends with its last whole frame.
    Raises InputError where a file is missing or header and MRAW disagree.
    """
    header_path, mraw_path = photron_files(path)
    header = read_photron_header(header_path)
    mraw = BlockFile(mraw_path)
    try:
        whole = _whole_frames(header, mraw, frames)
    except InputError:
        mraw.close()
        raise
    return PhotronRecording(header, mraw, whole)


def photron_files(path: Path) -> tuple[Path, Path]:
    """Return header and MRAW of the recording that ``path`` (either of them) belongs to, whatever their case."""
    beside = {entry.suffix.lower(): entry for entry in sorted(path.parent.glob(_glob_stem(path))) if entry.is_file()}
    header = path if path.suffix.lower() != ".mraw" else beside.get(".cihx", beside.get(".cih"))
    mraw = path if path.suffix.lower() == ".mraw" else beside.get(".mraw")
    if header is None:
        raise InputError(f"{path}: no header {path.stem}.cihx or {path.stem}.cih beside it; copy it there")
    if mraw is None:
        raise InputError(f"{path}: no {path.stem}.mraw beside it; copy the frames there")
    return header, mraw


def _glob_stem(path: Path) -> str:
    return "".join(f"[{c}]" if c in "*?[" else c for c in path.stem) + ".*"


def _whole_frames(header: PhotronHeader, mraw: BlockFile, frames: tuple[int, int] | None) -> int:
    """Return how many frames of the header lie whole in the file; InputError where that is not the part asked for."""
    claimed = (header.frame_bits * header.frames + 7) // 8
    whole = min(header.frames, mraw.size * 8 // header.frame_bits)
    if claimed == mraw.size or (frames is not None and whole and max(frames) < whole):
        return whole
    sizes = (
        f"{mraw.path}: {mraw.size} bytes, but {header.path.name} claims {claimed} "
        f"({header.frames} frames of {header.width} x {header.height} pixels, {header.stored_bits} bit)"
    )
    if whole == 0:
        raise InputError(f"{sizes}; not one frame is whole: use the header and MRAW that were saved together")
    other = _as_it_would_fit(header, mraw.size)
    almost_all = mraw.size * 8 % header.frame_bits == 0 and whole >= ALMOST_ALL * header.frames
    if mraw.size > claimed or (other and not almost_all):
        fits = f" (they would be {other})" if other else ""
        raise InputError(
            f"{sizes}; header and data disagree{fits}: use the header and MRAW that were saved together, or check "
            "width, height, bits and number of frames in the header"
        )
    advice = f"copy both again, or set `frames: [0, {whole - 1}]` in the view to use the {whole} that are whole"
    raise InputError(f"{sizes}; {advice}")


def _as_it_would_fit(header: PhotronHeader, size: int) -> str:
    """The pictures of another depth, height or width that fill ``size`` bytes, in the number of the header; or none.

    A copy that was cut short does so by chance alone, unless it ends with a frame.
    """
    width, height, bits = header.width, header.height, header.stored_bits
    forms = [(width, height, other) for other in STORED_BITS]
    per_frame = size * 8 // header.frames
    forms += [(width, per_frame // (width * bits), bits), (per_frame // (height * bits), height, bits)]
    for columns, rows, depth in forms:
        if rows and columns and (columns * rows * depth * header.frames + 7) // 8 == size:
            return f"{header.frames} frames of {columns} x {rows} pixels, {depth} bit"
    return ""


class PhotronRecording:
    """Frames of an MRAW file, read row block by row block."""

    def __init__(self, header: PhotronHeader, mraw: BlockFile, whole: int) -> None:
        """Take an open file, its header, and how many frames of it are whole."""
        self._header, self._mraw = header, mraw
        self.close = mraw.close
        packed = " packed" if header.stored_bits == 12 else ""
        cut = (f"{mraw.path.name} holds {whole} of the {header.frames} frames",) if whole < header.frames else ()
        self.info = RecordingInfo(
            path=header.path,
            format=f"Photron MRAW, {header.stored_bits} bit{packed}",
            frame_count=whole,
            width=header.width,
            height=header.height,
            bit_depth=header.bit_depth,
            fps=header.fps,
            fps_source=header.fps_source,
            exposure_s=header.exposure_s,
            notes=header.notes + cut,
            random_access=True,
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the camera's frame numbers: the start frame and every ``step``-th after it."""
        return self._header.start + self._header.step * np.arange(self.info.frame_count, dtype=np.int64)

    def times_s(self) -> None:
        """Return None: the format has no stamps."""

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return grey levels of frame ``index``; a region costs the bytes of its rows."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        width = self._header.width
        first = (index * self._header.height + y0) * width
        pixels = (y1 - y0) * width
        if self._header.stored_bits == 12:
            levels = self._read_packed(first, (x0, x1, y1 - y0))
        elif self._header.stored_bits == 16:
            words = self._mraw.read(2 * first, 2 * pixels).view("<u2").reshape(-1, width)
            levels = words[:, x0:x1].astype(np.uint16)
        else:
            levels = self._mraw.read(first, pixels).reshape(-1, width)[:, x0:x1].copy()
        if self._header.shift:
            levels >>= self._header.shift
        return levels

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Return rows (first, behind the last) of frame ``index`` as they are stored, valid until the next is read.

        None where they do not begin with a byte, or hold other bits too. Those ``unread`` among them hold anything.
        """
        bits, width = self._header.stored_bits, self._header.width
        if self._header.shift or bits * width % 8:
            return None
        _, first, _, end = checked_region((0, rows[0], width, rows[1]), self.info)
        stride = bits * width // 8
        begin = (checked_index(index, self.info) * self._header.height + first) * stride
        hole = (unread[0] - first) * stride, (unread[1] - first) * stride
        stored = self._mraw.read(begin, (end - first) * stride, hole).reshape(-1, stride)
        return stored.view("<u2") if bits == 16 else stored, 0, bits == 12

    def _read_packed(self, first: int, window: tuple[int, int, int]) -> Frame:
        x0, x1, rows = window
        width = self._header.width
        start = first + x0
        begin = start // 2  # pairs of pixels, three bytes each
        end = start + (rows - 1) * width + x1 - x0
        packed = self._mraw.read(3 * begin, (end * 3 + 1) // 2 - 3 * begin)
        out = np.empty((rows, x1 - x0), np.uint16)
        unpack_12bit(packed, start - 2 * begin, width, out)
        return out
