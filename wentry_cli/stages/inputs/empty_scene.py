"""The frames of an empty scene that a configuration names as ``background``: found, fitting, read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.config.blame import place_of
from wentry_cli.errors import InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.oriented import Oriented, orient
from wentry_cli.frames.reader import Recording
from wentry_cli.tracking.source import read_samples

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

MOST_EMPTY = 40


def check_empty_scene(drop: Drop, name: str, shape: tuple[int, int]) -> None:
    """Raise ``InputError`` where the background of the view ``name`` is missing or not of its ``shape``."""
    if drop.view(name).background != "auto":
        raw, turned = _open_empty(drop, name)
        raw.close()
        _refuse_other_size(drop, name, turned, shape)


def read_empty_scene(drop: Drop, name: str, shape: tuple[int, int]) -> NDArray[Any]:
    """Frames of the empty scene, (frames, rows, columns) of ``shape``; raises ``InputError`` as the check does."""
    raw, turned = _open_empty(drop, name)
    try:
        _refuse_other_size(drop, name, turned, shape)
        count = turned.info.frame_count
        indices = sorted({round(value) for value in np.linspace(0, count - 1, min(count, MOST_EMPTY))})
        return read_samples(_Plain(turned), indices)
    finally:
        raw.close()


def _open_empty(drop: Drop, name: str) -> tuple[Recording, Oriented]:
    view = drop.view(name)
    if isinstance(view.background, tuple):
        raw = open_recording(drop.source_path(name))
        chosen: tuple[int, int] | None = view.background
    else:
        path = drop.folder / view.background
        # one image is opened as a folder of numbered images that holds a single one: a pattern that only it matches
        only = path if path.suffix.lower() in {".tif", ".tiff"} else path.with_name(f"[{path.name[0]}]{path.name[1:]}")
        if not path.is_file():
            key = f"views.{name}.background"
            what = "is a folder, not an image" if path.is_dir() else "no such file"
            where = place_of(drop, key, view.background)
            raise InputError(f"{where}: error: {key}: {path}: {what}; give an image, [first, last] or auto")
        raw, chosen = open_recording(only), None
    return raw, orient(raw, rotate=view.rotate, flip=view.flip, roi_px=view.roi_px, frames=chosen)


def _refuse_other_size(drop: Drop, name: str, turned: Oriented, shape: tuple[int, int]) -> None:
    if (turned.info.height, turned.info.width) != shape:
        raise InputError(
            f"{drop.folder / 'experiment.yaml'}: views.{name}.background is {turned.info.width} x "
            f"{turned.info.height} pixels, the recording {shape[1]} x {shape[0]}; take an empty frame of the same "
            "camera setting"
        )


class _Plain:
    """A recording with the names that trackers use."""

    def __init__(self, recording: Any) -> None:
        """Wrap an oriented recording."""
        self.read = recording.read
        self.count = recording.info.frame_count
        self.shape = (recording.info.height, recording.info.width)
        self.full_scale = float(2**recording.info.bit_depth - 1)
