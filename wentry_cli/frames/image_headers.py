"""Size and depth of a still image from its first bytes, and whether its last bytes are there, without decoding."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.tiff_directory import is_tiff, read_directories

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
LARGEST_SIDE_PX = 1 << 16
LARGEST_EXPANSION = 2000  # bytes of levels that a byte of a file can stand for; deflate reaches 1032


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
    try:
        file = BlockFile(path)
    except InputError as error:
        raise FrameUnreadableError(str(error)) from error
    try:
        header = _header(file)
        size = file.size
    except (struct.error, IndexError) as error:
        raise FrameUnreadableError(f"{path}: the image header is cut off") from error
    finally:
        file.close()
    if not (0 < header.width <= LARGEST_SIDE_PX and 0 < header.height <= LARGEST_SIDE_PX):
        raise FrameUnreadableError(f"{path}: claims {header.width} x {header.height} pixels; the header is damaged")
    if header.width * header.height * header.channels * header.bit_depth // 8 > LARGEST_EXPANSION * size:
        raise FrameUnreadableError(
            f"{path}: claims {header.width} x {header.height} pixels, which no compression brings into {size} bytes"
        )
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


def is_damaged(data: bytes) -> bool:
    """Tell whether a PNG, JPEG or BMP file stops before its end, or a PNG has a wrong checksum.

    Decoders fill what is missing with grey, or write to the terminal.
    """
    if data.startswith(PNG_SIGNATURE):
        return not _png_is_sound(data)
    if data.startswith(b"\xff\xd8"):
        return data.find(b"\xff\xd9", _jpeg_scan(data)) < 0
    if data.startswith(b"BM") and len(data) >= 34:
        (claimed,) = struct.unpack_from("<I", data, 2)
        return len(data) < int(claimed)
    return False


def _png_is_sound(data: bytes) -> bool:
    """Walk the chunks to the last one and check what each says of its own bytes."""
    place = len(PNG_SIGNATURE)
    while place + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, place)
        end = place + 8 + length
        if end + 4 > len(data) or crc32(memoryview(data)[place + 4 : end]) != int.from_bytes(
            data[end : end + 4], "big"
        ):
            return False
        if data[place + 4 : place + 8] == b"IEND":
            return True
        place = end + 4
    return False


def _jpeg_scan(data: bytes) -> int:
    """Return where the first scan begins: an end mark before it belongs to a thumbnail."""
    place = 2
    while place + 4 <= len(data):
        marker, length = struct.unpack_from(">HH", data, place)
        if marker == 0xFFDA or marker >> 8 != 0xFF or length < 2:
            return place
        place += 2 + length
    return len(data)
