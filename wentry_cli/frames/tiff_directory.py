"""The directories of a TIFF file: classic and BigTIFF, both byte orders, walked once and checked against the file.

Source: TIFF revision 6.0 (Adobe 1992) and the BigTIFF extension. Only what describes a grey page is read.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.blocks import BlockFile

MOST_ENTRIES = 4096
MOST_VALUE_BYTES = 1 << 22
SIZES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
FORMATS = {1: "B", 3: "H", 4: "I", 13: "I", 16: "Q", 18: "Q"}

SUBFILE, WIDTH, HEIGHT, BITS, COMPRESSION, PHOTOMETRIC, DESCRIPTION = 254, 256, 257, 258, 259, 262, 270
STRIPS, CHANNELS, STRIP_BYTES, TILES, SAMPLE_FORMAT = 273, 277, 279, 324, 339


class Entry(NamedTuple):
    """One tag: its type, how many values it claims, and the bytes of the field that holds or points to them."""

    kind: int
    values: int
    field: bytes


@dataclass(frozen=True)
class TiffPage:
    """One page; ``entries`` are its raw tags, ``order`` the byte order ('<' or '>'), ``big`` is True for BigTIFF."""

    offset: int
    width: int
    height: int
    bits: int
    channels: int
    compression: int
    photometric: int
    sample_format: int
    reduced: bool
    tiled: bool
    order: str
    big: bool
    entries: dict[int, Entry]


def is_tiff(start: bytes) -> bool:
    """Tell a TIFF by its first four bytes."""
    return start[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")


def read_directories(file: BlockFile, most: int = 1 << 31) -> Iterator[TiffPage]:
    """Yield the pages of ``file`` in order, at most ``most``.

    Raises ``FrameUnreadableError`` where a directory lies outside the file or the chain runs in a circle.
    """
    start = file.bytes_at(0, min(16, file.size))
    if not is_tiff(start) or len(start) < 8:
        raise FrameUnreadableError(f"{file.path}: no TIFF header")
    order = "<" if start[:1] == b"I" else ">"
    big = start[2 if order == "<" else 3] == 43
    if big and len(start) < 16:
        raise FrameUnreadableError(f"{file.path}: the TIFF header is cut off")
    (offset,) = struct.unpack_from(order + ("Q" if big else "I"), start, 8 if big else 4)
    seen: set[int] = set()
    while offset and len(seen) < most:
        if offset in seen:
            raise FrameUnreadableError(f"{file.path}: the directories of the TIFF run in a circle")
        seen.add(offset)
        page, offset = read_directory(file, offset, order, big)
        yield page


def read_directory(file: BlockFile, offset: int, order: str, big: bool) -> tuple[TiffPage, int]:
    """Return the page whose directory lies at ``offset`` and the place of the next directory, 0 for none."""
    head, size, pointer = (8, 20, 8) if big else (2, 12, 4)
    (count,) = struct.unpack(order + ("Q" if big else "H"), file.bytes_at(offset, head))
    if not 0 < count <= MOST_ENTRIES:
        raise FrameUnreadableError(f"{file.path}: a TIFF directory of {count} entries; the file is damaged")
    table = file.bytes_at(offset + head, count * size + pointer)
    (following,) = struct.unpack_from(order + ("Q" if big else "I"), table, count * size)
    entries: dict[int, Entry] = {}
    for place in range(0, count * size, size):
        tag, kind = struct.unpack_from(order + "HH", table, place)
        (values,) = struct.unpack_from(order + ("Q" if big else "I"), table, place + 4)
        entries.setdefault(tag, Entry(kind, values, table[place + size - pointer : place + size]))
    return _page(file, (offset, order, big), entries), following


def _page(file: BlockFile, place: tuple[int, str, bool], entries: dict[int, Entry]) -> TiffPage:
    offset, order, big = place

    def first(tag: int, default: int) -> int:
        values = _numbers(file, entries.get(tag), order, big)
        return values[0] if values else default

    return TiffPage(
        offset=offset,
        width=first(WIDTH, 0),
        height=first(HEIGHT, 0),
        bits=first(BITS, 1),
        channels=first(CHANNELS, 1),
        compression=first(COMPRESSION, 1),
        photometric=first(PHOTOMETRIC, 1),
        sample_format=first(SAMPLE_FORMAT, 1),
        reduced=bool(first(SUBFILE, 0) & 1),
        tiled=TILES in entries,
        order=order,
        big=big,
        entries=entries,
    )


def value_bytes(file: BlockFile, entry: Entry, order: str, big: bool) -> bytes:
    """Return the bytes of an entry's values, wherever they lie; bounded by the file and by ``MOST_VALUE_BYTES``."""
    size = SIZES.get(entry.kind, 0) * entry.values
    if size > MOST_VALUE_BYTES:
        raise FrameUnreadableError(f"{file.path}: a TIFF tag of {size} bytes; the file is damaged")
    if size <= len(entry.field):
        return entry.field[:size]
    (offset,) = struct.unpack(order + ("Q" if big else "I"), entry.field)
    return file.bytes_at(offset, size)


def page_numbers(file: BlockFile, page: TiffPage, tag: int) -> tuple[int, ...]:
    """Return the whole numbers of a tag of ``page``; empty where it has none."""
    return _numbers(file, page.entries.get(tag), page.order, page.big)


def _numbers(file: BlockFile, entry: Entry | None, order: str, big: bool) -> tuple[int, ...]:
    if entry is None or entry.kind not in FORMATS:
        return ()
    data = value_bytes(file, entry, order, big)
    return struct.unpack(f"{order}{entry.values}{FORMATS[entry.kind]}", data)
