"""The header of a Phantom ``.cine``: file header, bitmap header, camera setup, blocks of stamps, image offsets.

Source: Vision Research, Cine File Format. All numbers are little-endian. Every size is checked against the file before
anything is allocated from it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.reader import RATE_UNKNOWN

FILE_HEADER = struct.Struct("<2sHHHiIiIIIIQ")
BITMAP_HEADER = struct.Struct("<IiiHHIIiiII")
LARGEST_SIDE_PX = 1 << 16
LARGEST_STAMP_BLOCKS = 64
LONGEST_INTERVAL = 1000.0  # times the usual one

UNCOMPRESSED, PACKED_10, PACKED_12 = 0, 256, 1024
TIMES_BLOCK, EXPOSURES_BLOCK = 1002, 1003
FRACTION = 2.0**-32  # seconds of one unit of a stamp or an exposure
IRIG_BITS = 3  # the lowest bits of a stamp tell whether the clock was synchronised

# places within the setup: rate 16 bit, shutter 16 bit (µs), then those that later versions added
RATE_16, SHUTTER_16, LENGTH, RATE, SHUTTER, REAL_BITS, SHUTTER_NS = 0, 2, 142, 768, 772, 896, 1568


@dataclass(frozen=True)
class ImageLayout:
    """How an image is stored; ``bits`` per pixel, ``pitch`` the bytes of a row (0 where packed: rows run on)."""

    width: int
    height: int
    bits: int
    packed: bool
    bottom_up: bool
    pitch: int
    image_bytes: int
    bit_depth: int


@dataclass(frozen=True)
class CineHeader:
    """What a cine says of its images: layout, the number of the first, where each lies, when it was taken."""

    layout: ImageLayout
    first_number: int
    offsets: NDArray[np.int64]
    times_s: NDArray[np.float64] | None
    fps: float | None
    fps_source: str
    exposure_s: float | None
    notes: tuple[str, ...]


def read_cine_header(file: BlockFile) -> CineHeader:
    """Read the header of ``file``; InputError where it is cut off, damaged, compressed or colour."""
    try:
        return _read(file)
    except (FrameUnreadableError, struct.error) as error:
        raise InputError(f"{file.path}: the header of the cine is cut off or damaged ({error})") from error


def _read(file: BlockFile) -> CineHeader:
    head = FILE_HEADER.unpack(file.bytes_at(0, FILE_HEADER.size))
    (
        mark,
        _size,
        compression,
        _version,
        _m,
        _total,
        first_number,
        count,
        at_bitmap,
        at_setup,
        at_offsets,
        _t,
    ) = head
    if mark != b"CI":
        raise InputError(f"{file.path}: does not begin as a cine does; it is another kind of file")
    if compression != UNCOMPRESSED:
        kind = {1: "JPEG-compressed", 2: "raw colour (Bayer)"}.get(compression, f"of unknown compression {compression}")
        raise InputError(f"{file.path}: the images are {kind}; save the cine as uncompressed grey")
    if not 0 < count <= max(0, file.size - at_offsets) // 8:
        raise InputError(f"{file.path}: claims {count} images, more than the file of {file.size} bytes can hold")
    offsets = np.frombuffer(file.bytes_at(at_offsets, 8 * count), "<i8").astype(np.int64)
    setup = _Setup(file, at_setup)
    layout = _layout(file, at_bitmap, setup)
    times, exposures = _stamps(file, at_setup + setup.length, at_offsets, count)
    told: tuple[str, ...] = ()
    if times is not None and not _usable(times):
        told = ("the time stamps do not rise steadily; the header's rate is used",) if times.size > 1 else ()
        times = None
    fps, source, notes = _rate(times, setup)
    return CineHeader(
        layout=layout,
        first_number=first_number,
        offsets=offsets,
        times_s=times,
        fps=fps,
        fps_source=source,
        exposure_s=_exposure_s(exposures, setup),
        notes=(*told, *notes),
    )


class _Setup:
    """Numbers of the camera setup; those beyond its length are 0: older cameras wrote a shorter one."""

    def __init__(self, file: BlockFile, place: int) -> None:
        self.length = int.from_bytes(file.bytes_at(place + LENGTH, 2), "little")
        self._data = file.bytes_at(place, max(self.length, LENGTH + 2))

    def number(self, place: int, size: int = 4) -> int:
        if place + size > len(self._data):
            return 0
        return int.from_bytes(self._data[place : place + size], "little")


def _layout(file: BlockFile, place: int, setup: _Setup) -> ImageLayout:
    fields = BITMAP_HEADER.unpack(file.bytes_at(place, BITMAP_HEADER.size))
    _size, width, signed_height, _planes, bits, compression, image_bytes = fields[:7]
    height = abs(signed_height)
    if not (0 < width <= LARGEST_SIDE_PX and 0 < height <= LARGEST_SIDE_PX):
        raise InputError(f"{file.path}: claims {width} x {signed_height} pixels; the header is damaged")
    if bits in (24, 48):
        raise InputError(f"{file.path}: a colour cine ({bits} bit) is not supported; save it as grey")
    packed = compression in (PACKED_10, PACKED_12)
    if not packed and (compression != UNCOMPRESSED or bits not in (8, 16)):
        raise InputError(
            f"{file.path}: images of {bits} bit with compression {compression} are not supported; "
            f"save the cine uncompressed with 8 or 16 bit"
        )
    if packed:
        bits = 10 if compression == PACKED_10 else 12
    pitch = 0 if packed else _pitch(width, height, bits, image_bytes)
    needed = (width * height * bits + 7) // 8 if packed else pitch * height
    if image_bytes not in (0, needed):
        raise InputError(
            f"{file.path}: claims {image_bytes} bytes for {width} x {height} pixels of {bits} bit, "
            f"which need {needed}; the header is damaged"
        )
    real = setup.number(REAL_BITS)
    return ImageLayout(
        width=width,
        height=height,
        bits=bits,
        packed=packed,
        bottom_up=signed_height > 0 and not packed,
        pitch=pitch,
        image_bytes=needed,
        bit_depth=12 if packed else real if bits == 16 and 8 <= real <= 16 else bits,
    )


def _pitch(width: int, height: int, bits: int, image_bytes: int) -> int:
    """Return the bytes of a row, which bitmaps may pad to a multiple of four."""
    plain = width * bits // 8
    padded = (plain + 3) // 4 * 4
    return padded if image_bytes == padded * height else plain


def _stamps(
    file: BlockFile, place: int, end: int, count: int
) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Return the stamp of each image, from the first, and its exposure, in seconds, from the blocks after the setup."""
    times = exposures = None
    for _ in range(LARGEST_STAMP_BLOCKS):
        if place + 8 > min(end, file.size):
            break
        size, kind = struct.unpack("<IH", file.bytes_at(place, 6))
        if size < 8 or place + size > file.size:
            break
        if kind == TIMES_BLOCK and size - 8 >= 8 * count:
            raw = np.frombuffer(file.bytes_at(place + 8, 8 * count), "<u8") & ~np.uint64(IRIG_BITS)
            times = (raw - raw[0]).astype(np.int64) * FRACTION
        elif kind == EXPOSURES_BLOCK and size - 8 >= 4 * count:
            exposures = np.frombuffer(file.bytes_at(place + 8, 4 * count), "<u4") * FRACTION
        place += size
    return times, exposures


def _rate(times: NDArray[np.float64] | None, setup: _Setup) -> tuple[float | None, str, tuple[str, ...]]:
    """Return rate, where it came from, and notes: the stamps win over the header, whose 16-bit field saturates."""
    header = float(setup.number(RATE) or setup.number(RATE_16, 2))
    if times is not None and times.size > 1:
        intervals = np.diff(times)
        usual = float(np.median(intervals))
        regular = intervals[np.abs(intervals - usual) < 0.5 * usual]
        fps = 1.0 / float(regular.mean())
        notes: list[str] = []
        if header and abs(fps / header - 1.0) > 0.01:
            notes.append(f"the header says {header:g} fps, the time stamps {fps:.6g}; the stamps are used")
        if regular.size < intervals.size:
            notes.append(f"{intervals.size - regular.size} intervals between frames differ from the usual one")
        return fps, "cine time stamps", tuple(notes)
    return (header, "cine header frame rate", ()) if header else (None, RATE_UNKNOWN, ())


def _usable(times: NDArray[np.float64] | None) -> bool:
    """Whether the stamps rise, and no interval is as long as many others: a clock that was set in between."""
    if times is None or times.size < 2:
        return times is not None
    intervals = np.diff(times)
    return bool(intervals.min() > 0.0 and intervals.max() < LONGEST_INTERVAL * np.median(intervals))


def _exposure_s(exposures: NDArray[np.float64] | None, setup: _Setup) -> float | None:
    if exposures is not None and np.median(exposures) > 0:
        return float(np.median(exposures))
    seconds = setup.number(SHUTTER_NS) * 1e-9 or (setup.number(SHUTTER) or setup.number(SHUTTER_16, 2)) * 1e-6
    return seconds or None
