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
    (folder / "experiment.yaml").unlink(missing_ok=True)
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
