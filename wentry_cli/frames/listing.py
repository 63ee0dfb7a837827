"""Which recordings lie in a folder, told by the names of its files."""

from __future__ import annotations

import os
from pathlib import Path

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.image_folder import IMAGE_SUFFIXES, RECORDING_SUFFIXES
from wentry_cli.frames.image_headers import read_image_header

PHOTRON = (".cihx", ".cih", ".mraw")  # which file stands for a recording, if there are several


def recordings_in(folder: Path) -> list[Path]:
    """The recordings in ``folder`` and below: files, and folders of numbered images, in the order of their paths.

    Header and raw data of a Photron recording are one. Hidden files and folders are left out, links are not followed.
    """
    found: list[Path] = []
    for here, below, names in os.walk(folder):
        below[:] = sorted(name for name in below if not name.startswith("."))
        found += _among(Path(here), sorted(name for name in names if not name.startswith(".")))
    return sorted(found)


def _among(folder: Path, names: list[str]) -> list[Path]:
    files = [folder / name for name in names]
    images = [path for path in files if path.suffix.lower() in IMAGE_SUFFIXES]
    stacks = [path for path in images if _is_stack(path)]
    series = [folder] if len(images) > len(stacks) else []
    others = [path for path in files if path.suffix.lower() in RECORDING_SUFFIXES and not _of_photron(path)]
    return [*series, *stacks, *others, *_photron(files, beside_images=bool(series))]


def _of_photron(path: Path) -> bool:
    return path.suffix.lower() in PHOTRON


def _photron(files: list[Path], *, beside_images: bool) -> list[Path]:
    """One file for each recording, its header where there is one; a header beside images without raw data is theirs."""
    chosen: dict[str, Path] = {}
    for path in sorted(filter(_of_photron, files), key=lambda path: PHOTRON.index(path.suffix.lower())):
        chosen.setdefault(path.stem, path)
    raw = {path.stem for path in files if path.suffix.lower() == ".mraw"}
    return [path for stem, path in chosen.items() if stem in raw or not beside_images]


def _is_stack(path: Path) -> bool:
    try:
        return path.suffix.lower() in (".tif", ".tiff") and read_image_header(path).pages > 1
    except FrameUnreadableError:
        return False
