"""One page of a TIFF as a TIFF file of its own, so that a decoder need not walk there from the first page."""

from __future__ import annotations

import struct
from itertools import accumulate

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.blocks import BlockFile
from wentry_cli.frames.tiff_directory import (
    FORMATS,
    SIZES,
    STRIP_BYTES,
    STRIPS,
    TILES,
    TiffPage,
    page_numbers,
    value_bytes,
)

TILE_BYTES = 325
LONG = 4
LARGEST_EXPANSION = 2000  # bytes of levels that a byte of a file can stand for
LEFT_OUT = {254, 255, 270, 305, 306, 330}  # thumbnails, texts and sub-directories play no part in decoding
LAST_TAG = 532  # private tags above it neither


def page_as_file(file: BlockFile, page: TiffPage) -> bytes:
    """Return a classic TIFF that holds ``page`` alone; ``FrameUnreadableError`` where its data leave the file."""
    place_tag, size_tag = (TILES, TILE_BYTES) if page.tiled else (STRIPS, STRIP_BYTES)
    places, sizes = page_numbers(file, page, place_tag), page_numbers(file, page, size_tag)
    if not places or len(places) != len(sizes) or sum(sizes) > file.size:
        raise FrameUnreadableError(f"{file.path}: a page without a table of its data; the file is damaged")
    if page.width * page.height * page.channels * page.bits // 8 > LARGEST_EXPANSION * sum(sizes):
        raise FrameUnreadableError(f"{file.path}: a page claims more pixels than its data can hold")
    values = _values(file, page)
    tags = sorted(tag for tag in values if tag <= LAST_TAG and tag not in LEFT_OUT)
    after = 8 + 2 + 12 * len(tags) + 4
    extra = b""
    data_begin = after + sum(len(values[tag][2]) for tag in tags if len(values[tag][2]) > 4)
    moved = list(accumulate(sizes[:-1], initial=data_begin))
    values[place_tag] = (LONG, len(moved), struct.pack(f"{page.order}{len(moved)}I", *moved))
    table = b""
    for tag in tags:
        kind, count, data = values[tag]
        if len(data) > 4:
            field = struct.pack(page.order + "I", after + len(extra))
            extra += data
        else:
            field = data.ljust(4, b"\0")
        table += struct.pack(page.order + "HHI", tag, kind, count) + field
    head = (b"II*\0" if page.order == "<" else b"MM\0*") + struct.pack(page.order + "I", 8)
    directory = struct.pack(page.order + "H", len(tags)) + table + b"\0\0\0\0"
    pixels = b"".join(file.bytes_at(place, size) for place, size in zip(places, sizes, strict=True))
    return head + directory + extra + pixels


def _values(file: BlockFile, page: TiffPage) -> dict[int, tuple[int, int, bytes]]:
    """Return type, count and bytes of each tag, eight-byte numbers as four-byte ones."""
    values: dict[int, tuple[int, int, bytes]] = {}
    for tag, entry in page.entries.items():
        if tag > LAST_TAG or tag in LEFT_OUT or entry.kind not in SIZES:
            continue
        data = value_bytes(file, entry, page.order, page.big)
        kind = entry.kind
        if kind in FORMATS and (SIZES[kind] == 8 or tag in (STRIPS, TILES)):
            numbers = struct.unpack(f"{page.order}{entry.values}{FORMATS[kind]}", data)
            data, kind = struct.pack(f"{page.order}{entry.values}I", *(n & 0xFFFFFFFF for n in numbers)), LONG
        values[tag] = (kind, entry.values, data)
    return values
