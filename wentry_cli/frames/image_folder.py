"""Numbered still images in a folder: PNG, TIFF, JPEG, BMP, 8 or 16 bit, one file a frame."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.decoding import decode_grey
from wentry_cli.frames.depth import CONTAINER, sampled_depth
from wentry_cli.frames.image_headers import ImageHeader, read_image_header
from wentry_cli.frames.numbering import Numbering, number_files
from wentry_cli.frames.photron_header import read_photron_header
from wentry_cli.frames.reader import RATE_UNKNOWN, Frame, RecordingInfo, Region, checked_index, checked_region

IMAGE_SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp")
RECORDING_SUFFIXES = (".cihx", ".cih", ".mraw", ".cine", ".avi", ".mp4", ".mov", ".mkv")


def image_names(folder: Path, pattern: str = "*") -> list[str]:
    """Return the names of the images in ``folder`` that match ``pattern``; hidden files are not images."""
    try:
        with os.scandir(folder) as listing:
            found = [Path(e.name) for e in listing if not e.name.startswith(".") and _may_be_read(e)]
    except OSError as error:
        raise InputError(f"{folder}: cannot be listed ({error.strerror})") from error
    wanted = pattern.casefold()
    names = [e.name for e in found if e.suffix.lower() in IMAGE_SUFFIXES and fnmatchcase(e.name.casefold(), wanted)]
    if names:
        return names
    other = sorted(e.name for e in found if e.suffix.lower() in RECORDING_SUFFIXES)
    if other:
        raise InputError(f"{folder}: no images here, but '{other[0]}': give that file as the source")
    missing = f"no image matches '{pattern}'" if pattern != "*" else "no image here (png, tif, jpg, bmp)"
    raise InputError(f"{folder}: {missing}; check the source")


def _may_be_read(entry: os.DirEntry[str]) -> bool:
    """Whether an entry is a file; a link that leads nowhere is one too, which then cannot be read."""
    try:
        return entry.is_file() or (entry.is_symlink() and not entry.is_dir())
    except OSError:
        return True


def camera_headers(folder: Path) -> list[Path]:
    """Return the Photron headers that lie in ``folder``."""
    return sorted(entry for entry in folder.iterdir() if entry.suffix.lower() in (".cihx", ".cih"))


def open_image_folder(folder: Path, pattern: str = "*") -> ImageFolder:
    """Open the images of ``folder`` whose names match ``pattern`` (as a shell would).

    The headers of all files are read, none is decoded. Raises InputError for an empty folder, several series side by
    side, images of different size or depth, and where not one header can be read.
    """
    numbering = number_files(image_names(folder, pattern), str(folder))
    headers: dict[str, ImageHeader] = {}
    damage: FrameUnreadableError | None = None
    for name in numbering.names:
        try:
            if name is not None:
                headers[name] = read_image_header(folder / name)
        except FrameUnreadableError as error:
            damage = damage or error
    if not headers:
        raise InputError(f"{folder}: not one of the images can be read: {damage}")
    header = _common_header(folder, headers)
    unreadable = tuple(name for name in numbering.names if name is not None and name not in headers)
    return ImageFolder(folder, numbering, header, _camera_header(folder, header), unreadable)


def _common_header(folder: Path, headers: dict[str, ImageHeader]) -> ImageHeader:
    """Return what the images have in common; InputError naming the first that is of another size or depth."""
    kinds = Counter((header.width, header.height, header.bit_depth) for header in headers.values())
    usual, count = kinds.most_common(1)[0]
    for name, header in headers.items():
        if (header.width, header.height, header.bit_depth) != usual:
            raise InputError(
                f"{folder / name}: {header.width} x {header.height} pixels of {header.bit_depth} bit, but {count} of "
                f"the {len(headers)} images here have {usual[0]} x {usual[1]} of {usual[2]} bit; remove the odd ones"
            )
        if header.pages > 1:
            raise InputError(f"{folder / name}: a TIFF of several pages; give that file as the source, not its folder")
    first = next(iter(headers.values()))
    if first.bit_depth not in (8, 16):
        raise InputError(f"{folder}: images of {first.bit_depth} bit are not supported; save them with 8 or 16 bit")
    return first


@dataclass(frozen=True)
class _Camera:
    """What the camera's own header beside the images says, if there is one."""

    fps: float | None = None
    fps_source: str = RATE_UNKNOWN
    exposure_s: float | None = None
    notes: tuple[str, ...] = ()


def _camera_header(folder: Path, image: ImageHeader) -> _Camera:
    """Return rate and exposure from the one Photron header beside the images: its software leaves it there."""
    found = camera_headers(folder)
    if not found:
        return _Camera()
    names = ", ".join(path.name for path in found)
    if len(found) > 1:
        return _Camera(notes=(f"several headers ({names}) lie beside the images: none is used",))
    try:
        header = read_photron_header(found[0], stills=True)
    except InputError as error:
        return _Camera(notes=(f"not used: {error}",))
    if (header.width, header.height) != (image.width, image.height):
        return _Camera(notes=(f"{names} describes {header.width} x {header.height} pixels: not used",))
    return _Camera(header.fps, header.fps_source, header.exposure_s, header.notes)


class ImageFolder:
    """Images of one size, decoded one at a time; the last is kept, so regions of one frame decode it once."""

    def __init__(
        self,
        folder: Path,
        numbering: Numbering,
        header: ImageHeader,
        camera: _Camera,
        unreadable: tuple[str, ...] = (),
    ) -> None:
        """Take the frames of ``numbering`` in ``folder``, all of the kind of ``header`` but those ``unreadable``."""
        self._folder, self._numbering, self._header = folder, numbering, header
        self._last: tuple[int, Frame] | None = None
        self._shift, depth, notes = 0, header.bit_depth, numbering.notes + camera.notes
        if depth == CONTAINER:
            depth, self._shift, note = sampled_depth(self._decode, len(numbering.names))
            notes += (note,)
        colour = ", colour, converted to grey" if header.channels > 2 else ""
        self.info = RecordingInfo(
            path=folder,
            format=f"{header.kind} images, {header.bit_depth} bit{colour}",
            frame_count=len(numbering.names),
            width=header.width,
            height=header.height,
            bit_depth=depth,
            fps=camera.fps,
            fps_source=camera.fps_source,
            exposure_s=camera.exposure_s,
            duplicates=len(numbering.duplicates),
            gaps=numbering.gaps,
            unreadable=unreadable,
            notes=notes,
        )

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the numbers in the file names, gaps included."""
        return self._numbering.numbers.copy()

    def times_s(self) -> None:
        """Return None: files have no stamps of the camera."""

    def close(self) -> None:
        """Forget the decoded frame; no file stays open."""
        self._last = None

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index``; raises ``FrameUnreadableError`` with ``gap`` where its number has no file."""
        index = checked_index(index, self.info)
        x0, y0, x1, y1 = checked_region(region, self.info)
        if self._last is None or self._last[0] != index:
            try:
                self._last = (index, self._decode(index))
            except FrameUnreadableError as error:
                error.file = self._numbering.names[index] or ""
                raise
        return self._last[1][y0:y1, x0:x1].copy()

    def _decode(self, index: int) -> Frame:
        name = self._numbering.names[index]
        if name is None:
            number = int(self._numbering.numbers[index])
            raise FrameUnreadableError(f"{self._folder}: no image with the number {number}", status="gap")
        path = self._folder / name
        header = read_image_header(path)  # before the decoder makes room for what the file claims
        if (header.width, header.height) != (self._header.width, self._header.height):
            raise FrameUnreadableError(f"{path}: now has {header.width} x {header.height} pixels")
        try:
            data = path.read_bytes()
        except OSError as error:
            raise FrameUnreadableError(f"{path}: cannot be read ({error.strerror})") from error
        image = decode_grey(data, str(path))
        if image.shape != (self._header.height, self._header.width):
            raise FrameUnreadableError(f"{path}: decoded to {image.shape[1]} x {image.shape[0]} pixels")
        return image >> self._shift if self._shift else image
