"""Frames to disk: numbered PNG or TIFF, or a Photron pair of CIHX header and 12-bit packed MRAW."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.synthetic.scene import Camera

Levels = NDArray[np.uint8] | NDArray[np.uint16]


class FrameWriter(Protocol):
    """Takes frames in order; ``source`` is what experiment.yaml names."""

    source: str

    def write(self, number: int, levels: Levels) -> None:
        """Append the frame that the camera numbers ``number``."""

    def close(self) -> None:
        """Finish the files."""


class ImageWriter:
    """One numbered PNG or TIFF a frame; 12-bit grey levels are stored in 16-bit words, right-aligned."""

    def __init__(self, folder: Path, view: str, suffix: str) -> None:
        """Make the folder."""
        self.source = view
        self._folder = folder / view
        self._folder.mkdir(parents=True, exist_ok=True)
        self._suffix = suffix

    def write(self, number: int, levels: Levels) -> None:
        """Write ``<view>_000123.<suffix>``."""
        path = self._folder / f"{self._folder.name}_{number:06d}{self._suffix}"
        option = [cv2.IMWRITE_PNG_COMPRESSION, 1] if self._suffix == ".png" else [cv2.IMWRITE_TIFF_COMPRESSION, 1]
        done, data = cv2.imencode(self._suffix, levels, option)
        if not done:
            raise OSError(f"cannot encode {path}")
        path.write_bytes(data.tobytes())

    def close(self) -> None:
        """Nothing is left open."""


def pack_12bit(levels: NDArray[np.uint16]) -> bytes:
    """Two pixels in three bytes, most significant first, rows without padding."""
    flat = levels.ravel()
    if flat.size % 2:
        flat = np.append(flat, np.uint16(0))
    packed = np.empty((flat.size // 2, 3), np.uint8)
    _pack(np.ascontiguousarray(flat), packed)
    return packed.tobytes()


@compiled
def _pack(levels: NDArray[np.uint16], packed: NDArray[np.uint8]) -> None:
    for pair in range(packed.shape[0]):
        one, other = levels[2 * pair], levels[2 * pair + 1]
        packed[pair, 0] = one >> 4
        packed[pair, 1] = ((one & 15) << 4) | (other >> 8)
        packed[pair, 2] = other & 255


PREAMBLE = 256
HEADER = """<?xml version="1.0" encoding="utf-8"?>
<cih>
    <fileInfo><version>1.0</version><date>2020/1/1</date><time>00:00:00</time></fileInfo>
    <imageFileInfo>
        <digitsOfFileNumber>6</digitsOfFileNumber>
        <fileFormat>Mraw</fileFormat>
        <resolution><width>{width}</width><height>{height}</height></resolution>
    </imageFileInfo>
    <imageDataInfo>
        <resolution><width>{width}</width><height>{height}</height></resolution>
        <colorInfo><type>Raw</type><bit>{bits}</bit></colorInfo>
        <effectiveBit><depth>{bits}</depth><side>Lower</side></effectiveBit>
    </imageDataInfo>
    <frameInfo>
        <recordedFrame>{frames}</recordedFrame>
        <totalFrame>{frames}</totalFrame>
        <startFrame>{start}</startFrame>
        <skipFrame>1</skipFrame>
    </frameInfo>
    <recordInfo>
        <recordRate>{rate}</recordRate>
        <shutterSpeed>{shutter}</shutterSpeed>
        <shutterSpeedNsec>{shutter_ns}</shutterSpeedNsec>
    </recordInfo>
    <deviceInfo><deviceName>synthetic</deviceName></deviceInfo>
</cih>
"""


class PhotronWriter:
    """``<view>.mraw`` beside ``<view>.cihx``: 8 bit, 12 bit packed or 16 bit little-endian."""

    def __init__(self, folder: Path, view: str, camera: Camera) -> None:
        """Open the frames; the header is written at the end."""
        self.source = f"{view}.cihx"
        folder.mkdir(parents=True, exist_ok=True)
        self._header = folder / self.source
        self._camera = camera
        self._frames = 0
        self._start: int | None = None
        self._file = (folder / f"{view}.mraw").open("wb")

    def write(self, number: int, levels: Levels) -> None:
        """Append one frame."""
        self._start = number if self._start is None else self._start
        bits = self._camera.bits
        data = pack_12bit(levels.astype(np.uint16)) if bits == 12 else levels.astype(f"<u{bits // 8}").tobytes()
        self._file.write(data)
        self._frames += 1

    def close(self) -> None:
        """Close the frames and write the header: preamble, the word CIHX, a table of offsets, then the XML."""
        self._file.close()
        camera = self._camera
        text = HEADER.format(
            width=camera.width, height=camera.height, bits=camera.bits, frames=self._frames, start=self._start or 0,
            rate=round(camera.fps), shutter=round(1.0 / max(camera.exposure_s, 1e-9)),
            shutter_ns=round(camera.exposure_s * 1e9),
        )  # fmt: skip
        body = text.replace("\n", "\r\n").encode("utf-8")
        mark = b"!!! This file can not be edited. !!!".ljust(PREAMBLE, b"\0")
        start = PREAMBLE + 60
        table = struct.pack("<4sIIIQQQQQI", b"CIHX", 1, 2, 0, 0, start, len(body), 4, start + len(body), 0)
        self._header.write_bytes(mark + table + body)


def open_writer(folder: Path, view: str, camera: Camera) -> FrameWriter:
    """The writer that the view's format asks for."""
    if camera.format == "mraw":
        return PhotronWriter(folder, view, camera)
    return ImageWriter(folder, view, ".png" if camera.format == "png" else ".tif")
