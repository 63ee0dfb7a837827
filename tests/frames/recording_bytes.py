"""Recordings built byte by byte from the descriptions of their formats, with no code of the readers."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


def grey(width: int, height: int, top: int = 255, seed: int = 0, frames: int = 1) -> np.ndarray:
    """Frames (frames, height, width) of whole numbers from 0 to ``top``, both reached."""
    levels = np.random.default_rng(seed).integers(0, top + 1, (frames, height, width))
    levels[:, 0, 0], levels[:, -1, -1] = top, 0
    return levels


def pack_bits(levels: np.ndarray, bits: int) -> bytes:
    """Numbers of ``bits`` bits one after another, most significant bit first, the last byte filled with zeros."""
    text = "".join(format(int(level), f"0{bits}b") for level in levels.ravel())
    text += "0" * (-len(text) % 8)
    return int(text, 2).to_bytes(len(text) // 8, "big") if text else b""


# --- Photron


def cih(**changes: object) -> str:
    """A text header; ``changes`` replace values, None leaves a line out."""
    lines: dict[str, object] = {
        "Record Rate(fps)": 2000,
        "Shutter Speed(s)": "1/10000",
        "Total Frame": 3,
        "Start Frame": 0,
        "Save Step": 1,
        "Image Width": 6,
        "Image Height": 4,
        "Color Type": "Mono",
        "Color Bit": 8,
        "File Format": "MRaw",
        "EffectiveBit Depth": 8,
        "EffectiveBit Side": "Lower",
    }
    names = {
        "rate": "Record Rate(fps)",
        "shutter": "Shutter Speed(s)",
        "frames": "Total Frame",
        "start": "Start Frame",
        "step": "Save Step",
        "width": "Image Width",
        "height": "Image Height",
        "bits": "Color Bit",
        "depth": "EffectiveBit Depth",
        "side": "EffectiveBit Side",
        "format": "File Format",
        "colour": "Color Type",
        "shutter_ns": "Shutter Type2(nsec)",
    }
    lines |= {names[key]: value for key, value in changes.items()}
    body = "".join(f"{key} : {value}\n" for key, value in lines.items() if value is not None)
    return f"#Camera Information Header\nDate : 2020/1/1\nComment Text : a : b\n{body}\nEND\n"


def cihx(body: str = "", **changes: object) -> bytes:
    """An XML header between the bytes that the camera's software puts around it."""
    value = {"width": 6, "height": 4, "frames": 3, "start": 0, "step": 1, "rate": 2000, "bits": 8, "depth": 8}
    value |= {"side": "Lower", "shutter": 10000, "shutter_ns": 100000, "format": "Mraw"} | changes
    xml = f"""<cih>
    <imageFileInfo><fileFormat>{value["format"]}</fileFormat>
      <resolution><width>1</width><height>1</height></resolution></imageFileInfo>
    <imageDataInfo>
      <resolution><width>{value["width"]}</width><height>{value["height"]}</height></resolution>
      <colorInfo><type>Raw</type><bit>{value["bits"]}</bit></colorInfo>
      <effectiveBit><depth>{value["depth"]}</depth><side>{value["side"]}</side></effectiveBit>
    </imageDataInfo>
    <frameInfo><recordedFrame>99</recordedFrame><totalFrame>{value["frames"]}</totalFrame>
      <startFrame>{value["start"]}</startFrame><skipFrame>{value["step"]}</skipFrame></frameInfo>
    <recordInfo><recordRate>{value["rate"]}</recordRate><shutterSpeed>{value["shutter"]}</shutterSpeed>
      <shutterSpeedNsec>{value["shutter_ns"]}</shutterSpeedNsec></recordInfo>
    <basicInfo><comment>5 &lt; 6 &amp; more</comment></basicInfo>{body}
</cih>"""
    head = b"!!! This file can not be edited. !!!\0\0\x83\xff CIHX<RD"
    return head + b'<?xml version="1.0" encoding="utf-8"?>\n' + xml.encode() + b"\nx<3<3<3<"


def write_photron(folder: Path, header: str | bytes, data: bytes, name: str = "clip") -> Path:
    """Write header and MRAW; returns the path of the header."""
    suffix = ".cih" if isinstance(header, str) else ".cihx"
    path = folder / f"{name}{suffix}"
    path.write_bytes(header.encode() if isinstance(header, str) else header)
    (folder / f"{name}.mraw").write_bytes(data)
    return path


# --- Phantom


def cine(images: list[bytes], **changes: object) -> bytes:
    """A cine of ``images`` (their pixel bytes); ``changes`` set fields of the headers."""
    value: dict[str, object] = {
        "mark": b"CI",
        "compression": 0,
        "first": -2,
        "count": len(images),
        "width": 4,
        "height": 2,
        "bits": 8,
        "packing": 0,
        "size": len(images[0]) if images else 0,
        "rate16": 1000,
        "rate": 1000,
        "real": 8,
        "shutter": 100,
        "shutter_ns": 100_000,
        "times": None,
        "exposures": None,
        "setup_length": 2000,
        "annotation": b"",
        "image_size": None,
        "shift_offsets": 0,
    }
    value |= changes
    setup = bytearray(value["setup_length"])  # type: ignore[call-overload]
    struct.pack_into("<H", setup, 0, value["rate16"])
    setup[140:142] = b"ST"
    struct.pack_into("<H", setup, 142, value["setup_length"])
    for place, name in ((768, "rate"), (772, "shutter"), (896, "real"), (1568, "shutter_ns")):
        if place + 4 <= len(setup):
            struct.pack_into("<I", setup, place, value[name])
    blocks = b""
    if value["times"] is not None:
        blocks += _block(1002, b"".join(struct.pack("<Q", int(t * 2**32) | 3) for t in value["times"]))  # type: ignore[attr-defined]
    blocks += _block(1007, b"\x01\x02\x03\x04")
    if value["exposures"] is not None:
        blocks += _block(1003, b"".join(struct.pack("<I", int(t * 2**32)) for t in value["exposures"]))  # type: ignore[attr-defined]
    at_offsets = 84 + len(setup) + len(blocks)
    head = struct.pack(
        "<2sHHHiIiIIIIQ",
        *(value["mark"], 44, value["compression"], 1, -100, 999, value["first"], value["count"]),
        *(44, 84, at_offsets, 1 << 40),
    )
    bitmap = struct.pack(
        "<IiiHHIIiiII",
        *(40, value["width"], value["height"], 1, value["bits"], value["packing"], value["size"], 0, 0, 0, 0),
    )
    annotation: bytes = value["annotation"]  # type: ignore[assignment]
    place = at_offsets + 8 * len(images)
    offsets, body = b"", b""
    for image in images:
        offsets += struct.pack("<q", place + len(body) + int(value["shift_offsets"]))  # type: ignore[call-overload]
        size = len(image) if value["image_size"] is None else value["image_size"]
        body += struct.pack("<I", 8 + len(annotation)) + annotation + struct.pack("<I", size) + image
    return head + bitmap + bytes(setup) + blocks + offsets + body


def _block(kind: int, data: bytes) -> bytes:
    return struct.pack("<IHH", 8 + len(data), kind, 0) + data


# --- still images and TIFF


def png(levels: np.ndarray, bits: int) -> bytes:
    """A grey PNG of 8 or 16 bit without filters."""
    height, width = levels.shape
    rows = levels.astype(">u2" if bits == 16 else np.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    head = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(raw)), (b"IEND", b""))
    body = b"".join(struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + body


def bmp(levels: np.ndarray) -> bytes:
    """An 8-bit BMP with a grey palette, bottom row first, rows padded to four bytes."""
    height, width = levels.shape
    pitch = (width + 3) // 4 * 4
    rows = b"".join(row.astype(np.uint8).tobytes().ljust(pitch, b"\0") for row in levels[::-1])
    palette = b"".join(bytes((i, i, i, 0)) for i in range(256))
    begin = 14 + 40 + len(palette)
    head = b"BM" + struct.pack("<IHHI", begin + len(rows), 0, 0, begin)
    return head + struct.pack("<IiiHHIIiiII", 40, width, height, 1, 8, 0, len(rows), 0, 0, 256, 0) + palette + rows


def tiff(pages: list[np.ndarray], bits: int, order: str = "<", **changes: object) -> bytes:
    """A TIFF with a directory a page, two strips each. Options: big, compression, photometric, description, strips."""
    big = bool(changes.get("big", False))
    mark = b"II" if order == "<" else b"MM"
    pointer, entry_head = ("Q", "HHQ") if big else ("I", "HHI")
    first = 16 if big else 8
    out = bytearray(mark + struct.pack(order + "H", 43 if big else 42))
    out += struct.pack(order + "HHQ", 8, 0, first) if big else struct.pack(order + "I", first)
    for number, page in enumerate(pages):
        height, width = page.shape
        rows_per_strip = max(1, -(-height // int(changes.get("strips", 2))))  # type: ignore[call-overload]
        word = order + "u2" if bits == 16 else "u1"
        strips = [page[r : r + rows_per_strip].astype(word).tobytes() for r in range(0, height, rows_per_strip)]
        if changes.get("compression", 1) == 8:
            strips = [zlib.compress(strip) for strip in strips]
        tags: dict[int, tuple[int, list[int] | bytes]] = {
            256: (4, [width]),
            257: (4, [height]),
            258: (3, [bits]),
            259: (3, [int(changes.get("compression", 1))]),  # type: ignore[call-overload]
            262: (3, [int(changes.get("photometric", 1))]),  # type: ignore[call-overload]
            273: (4, [0] * len(strips)),
            277: (3, [1]),
            278: (4, [rows_per_strip]),
            279: (4, [len(strip) for strip in strips]),
        }
        if "description" in changes:
            tags[270] = (2, changes["description"])  # type: ignore[assignment]
        tags = dict(sorted(tags.items()))
        begin = len(out)
        size = (8 + 20 * len(tags) + 8) if big else (2 + 12 * len(tags) + 4)
        field = 8 if big else 4
        encoded = {tag: _encode(order, kind, values) for tag, (kind, values) in tags.items()}
        after = begin + size
        data_begin = after + sum(len(data) for data in encoded.values() if len(data) > field)
        places = [data_begin + sum(map(len, strips[:i])) for i in range(len(strips))]
        encoded[273] = _encode(order, 4, places)
        table, extra = b"", b""
        for tag, (kind, values) in tags.items():
            data = encoded[tag]
            if len(data) > field:
                inline = struct.pack(order + pointer, after + len(extra))
                extra += data
            else:
                inline = data.ljust(field, b"\0")
            table += struct.pack(order + entry_head, tag, kind, len(values)) + inline
        end = data_begin + sum(map(len, strips))
        following = end if number + 1 < len(pages) else 0
        out += struct.pack(order + ("Q" if big else "H"), len(tags)) + table
        out += struct.pack(order + pointer, following) + extra + b"".join(strips)
    return bytes(out)


def _encode(order: str, kind: int, values: list[int] | bytes) -> bytes:
    if isinstance(values, bytes):
        return values
    return struct.pack(f"{order}{len(values)}{'H' if kind == 3 else 'I'}", *values)
