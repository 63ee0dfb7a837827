"""Size and depth of a still image from its first bytes, and whether its last bytes are there, without decoding."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.tiff_directory import is_tiff, read_directories

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
PNG_END = b"IEND\xaeB`\x82"
LARGEST_SIDE_PX = 1 << 16


@dataclass(frozen=True)
class ImageHeader:
    """Kind (PNG, TIFF, JPEG, BMP), size and container depth of an image file; ``pages`` is 2 where it has several."""

    kind: str
    width: int
    height: int
    bit_depth: int
    channels: int
    pages: int = 1


def read_image_header(path: Path) -> ImageHeader:
    """Read the header of ``path``; ``FrameUnreadableError`` where it is cut off or of no supported kind."""
    file = BlockFile(path)
    try:
        header = _header(file)
    except (struct.error, IndexError) as error:
        raise FrameUnreadableError(f"{path}: the image header is cut off") from error
    finally:
        file.close()
    if not (0 < header.width <= LARGEST_SIDE_PX and 0 < header.height <= LARGEST_SIDE_PX):
        raise FrameUnreadableError(f"{path}: claims {header.width} x {header.height} pixels; the header is damaged")
    return header


def _header(file: BlockFile) -> ImageHeader:
    start = file.bytes_at(0, min(64, file.size))
    if start.startswith(PNG_SIGNATURE):
        return _png(start)
    if start.startswith(b"\xff\xd8"):
        return _jpeg(file)
    if start.startswith(b"BM"):
        return _bmp(start)
    if is_tiff(start):
        return _tiff(file)
    raise FrameUnreadableError(f"{file.path}: no PNG, TIFF, JPEG or BMP image" if start else f"{file.path}: empty file")


def _png(start: bytes) -> ImageHeader:
    width, height, depth, colour = struct.unpack_from(">IIBB", start, 16)
    channels = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}.get(colour, 1)
    return ImageHeader("PNG", width, height, max(depth, 8) if colour != 3 else 8, channels)


def _bmp(start: bytes) -> ImageHeader:
    (header_size,) = struct.unpack_from("<I", start, 14)
    if header_size == 12:
        width, height, _planes, bits = struct.unpack_from("<HHHH", start, 18)
    else:
        width, height, _planes, bits = struct.unpack_from("<iiHH", start, 18)
    return ImageHeader("BMP", abs(width), abs(height), 8, 3 if bits > 8 else 1)


def _jpeg(file: BlockFile) -> ImageHeader:
    """Walk the segments to the start of frame; each says its own length."""
    place = 2
    while place + 4 <= file.size:
        marker, length = struct.unpack(">HH", file.bytes_at(place, 4))
        if marker >> 8 != 0xFF or length < 2:
            break
        kind = marker & 0xFF
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            depth, height, width, channels = struct.unpack(">BHHB", file.bytes_at(place + 4, 6))
            return ImageHeader("JPEG", width, height, depth, channels)
        place += 2 + length
    raise FrameUnreadableError(f"{file.path}: the JPEG header is cut off")


def _tiff(file: BlockFile) -> ImageHeader:
    pages = [page for page in read_directories(file, most=2) if not page.reduced]
    if not pages:
        raise FrameUnreadableError(f"{file.path}: a TIFF without a page")
    page = pages[0]
    return ImageHeader("TIFF", page.width, page.height, page.bits, page.channels, len(pages))


def missing_end(data: bytes) -> bool:
    """Tell whether the bytes of a PNG, JPEG or BMP file stop before their end; decoders fill the rest with grey."""
    if data.startswith(PNG_SIGNATURE):
        return PNG_END not in data[-64:]
    if data.startswith(b"\xff\xd8"):
        return b"\xff\xd9" not in data[-64:]
    if data.startswith(b"BM") and len(data) >= 34:
        (claimed,) = struct.unpack_from("<I", data, 2)
        return len(data) < int(claimed)
    return False
