"""The folder of a rendered drop: clear what an earlier rendering wrote, and nothing else."""

from __future__ import annotations

import os
import re
from pathlib import Path

from wentry_cli.errors import InputError

OURS = {
    ".": re.compile(r"(side|top)\.(cihx|mraw)|experiment\.yaml(\.part)?"),
    "side": re.compile(r"side_\d{6}\.(png|tif)"),
    "top": re.compile(r"top_\d{6}\.(png|tif)"),
    "truth": re.compile(r"(truth|necks|walls|top)\.csv"),
}
MARK = "truth/truth.yaml"
EXPERIMENT = "experiment.yaml"
FILMED = (".cihx", ".cih", ".mraw", ".cine", ".avi", ".mp4", ".mov", ".mkv", ".png", ".tif", ".tiff", ".jpg", ".jpeg",
          ".bmp")  # fmt: skip


def refuse_recordings(folder: Path) -> None:
    """Raise InputError where ``folder`` is to hold rendered drops, and is a drop or holds what was filmed.

    Drops that an earlier rendering wrote may lie in it.
    """
    if not folder.is_dir():
        return
    places = [folder, *(item for item in sorted(folder.iterdir()) if item.is_dir() and not (item / MARK).is_file())]
    for place in places:
        if (place / EXPERIMENT).is_file():
            which = "is a drop" if place == folder else f"holds the drop {place.name}, which was not rendered"
        elif found := sorted(item.name for item in place.iterdir() if item.suffix.lower() in FILMED):
            which = f"holds a recording, {(place / found[0]).relative_to(folder)}"
        else:
            continue
        raise InputError(f"{folder}: {which}; give an empty folder with -o, or one that `wentry render` wrote")


def clear_folder(folder: Path) -> None:
    """Make ``folder`` ready for a rendering: remove the files that an earlier one wrote, experiment.yaml first.

    Raises InputError, and touches nothing, if there are files but no truth/truth.yaml among them: then no rendering
    wrote them. An empty truth/truth.yaml comes first, so that a folder cut short is known as ours.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a folder to render into")
    if not (folder / MARK).is_file() and any(path.is_file() for path in folder.rglob("*")):
        raise InputError(f"{folder}: not empty and not rendered by wentry (no {MARK}); choose another folder")
    write_whole(folder / MARK, "")
    (folder / EXPERIMENT).unlink(missing_ok=True)
    for name, pattern in OURS.items():
        place = folder / name
        if not place.is_dir() or place.is_symlink():
            continue
        for path in sorted(place.iterdir()):
            if pattern.fullmatch(path.name) and path.is_file() and not path.is_symlink():
                path.unlink()
        if name != "." and not any(place.iterdir()):
            place.rmdir()


def write_whole(path: Path, text: str) -> None:
    """Write a text file all at once or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)
