"""A recording as the trackers and the cavity see it: bad frames known beforehand, flat field, sampled frames kept."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.decoded import found_once
from wentry_cli.frames.packed import unpack_12bit
from wentry_cli.frames.reader import StoredRows
from wentry_cli.imaging.background import Background, build_background
from wentry_cli.imaging.detection import shrink
from wentry_cli.imaging.ground import sample_indices
from wentry_cli.imaging.samples import Samples
from wentry_cli.stages.ingest import OpenView, open_view
from wentry_cli.stages.inputs.empty_scene import read_empty_scene

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

SAMPLE_BYTES = 36_000_000
MOST_SAMPLES = 28
FEWEST_SAMPLES = 9


class Clip:
    """The frames of one view; frames that ingest found damaged are not tried again."""

    def __init__(self, opened: OpenView, listed: pd.DataFrame) -> None:
        """Take an open view and its rows of frames.csv."""
        self.opened = opened
        self.full_scale = opened.full_scale
        self.count = opened.info.frame_count
        self.shape = (opened.info.height, opened.info.width)
        self.time_s = listed["time_s"].to_numpy(float)
        self.exposure_s = opened.info.exposure_s
        self._bad = {
            int(frame): str(status)
            for frame, status in zip(listed["frame"], listed["status"], strict=True)
            if status in {"bad_frame", "gap"}
        }
        self._kept: dict[int, NDArray[Any]] = {}
        self._shrunk: dict[int, tuple[NDArray[np.float32], float]] = {}

    @property
    def unreadable(self) -> tuple[tuple[int, str], ...]:
        """The frames that cannot be read, each with its status."""
        return tuple(sorted(self._bad.items()))

    def leave_out(self, frames: Iterable[int]) -> None:
        """Count frames as missing from now on."""
        self._bad |= {frame: "gap" for frame in frames if frame not in self._bad}

    def read(self, index: int, region: tuple[int, int, int, int] | None = None) -> NDArray[Any]:
        """Raw grey levels of a frame or of a region of it."""
        self._check(index)
        kept = self._kept.get(index)
        if kept is None:
            return np.asarray(self.opened.recording.read(index, region))
        if region is None:
            return kept
        x0, y0, x1, y1 = region
        return kept[y0:y1, x0:x1]

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Rows (first, behind the last) of a frame as they are stored, valid until the next is read, or None.

        Those ``unread`` among them hold anything.
        """
        self._check(index)
        return self.opened.recording.stored_rows(index, rows, unread)

    def _check(self, index: int) -> None:
        if index in self._bad:
            raise FrameUnreadableError(f"frame {index} could not be read before", self._bad[index])

    def shrunk(self, index: int) -> tuple[NDArray[np.float32], float]:
        """A frame as ``shrink`` gives it."""
        self._check(index)
        kept = self._shrunk.get(index)
        return kept if kept is not None else shrink(self.read(index))

    def sample(self) -> tuple[Samples, list[int]]:
        """Read and keep frames that show the whole clip, and their indices. Bounded in memory.

        Raises ``InputError`` where none can be read.
        """
        kind = np.uint16 if self.full_scale > 255 else np.uint8
        size = max(1, self.shape[0] * self.shape[1] * np.dtype(kind).itemsize)
        wanted = sample_indices(self.count, int(np.clip(SAMPLE_BYTES // size, FEWEST_SAMPLES, MOST_SAMPLES)))
        samples = Samples(np.empty((len(wanted), *self.shape), kind))
        found: list[int] = []
        for index in wanted:
            try:
                self._read_into(samples.next, index)
            except FrameUnreadableError as error:
                self._bad[index] = error.status
                continue
            samples.add()
            found.append(index)
        if not found:
            raise InputError(f"{self.opened.info.path}: no frame can be read; check the recording")
        self._kept = dict(zip(found, samples.frames, strict=True))
        self._shrunk = dict(zip(found, samples.coarse, strict=True))
        return samples, found

    def _read_into(self, out: NDArray[Any], index: int) -> None:
        """Read a whole frame into an array."""
        rows, columns = self.shape
        stored = self.stored_rows(index, (0, rows), (rows, rows))
        if stored is None:
            out[:] = self.read(index)
            return
        levels, first, packed = stored
        if packed:
            unpack_12bit(levels.reshape(-1), first, 2 * levels.shape[1] // 3, out)
        else:
            out[:] = levels[:, first : first + columns]

    def release(self) -> None:
        """Let go of the sampled frames."""
        self._kept.clear()
        self._shrunk.clear()

    def close(self) -> None:
        """Close the recording."""
        self.release()
        self.opened.recording.close()


def open_clip(folder: Path, drop: Drop, name: str) -> Clip:
    """Open the view ``name`` of ``drop`` with what frames.csv in ``folder`` says of its frames.

    Raises ``InputError`` where table and recording disagree.
    """
    from wentry_cli.tables import read_table

    listed = read_table(folder, "frames")
    listed = listed[listed["view"] == name]
    opened = open_view(drop, name)
    if len(listed) != opened.info.frame_count:
        opened.recording.close()
        raise InputError(
            f"{folder / 'frames.csv'}: lists {len(listed)} frames of the {name} view, the recording has "
            f"{opened.info.frame_count}; run again with --force=ingest"
        )
    return Clip(opened, listed)


def flat_field(drop: Drop, name: str, clip: Clip) -> tuple[Background, list[int]]:
    """The empty scene of a view as its configuration says (``background``), and the frames sampled from the clip.

    It is the same for all stages of a run. Raises ``InputError`` where the background file does not fit the recording.
    """
    view = drop.view(name)
    key = ("flat field", drop.folder, name, view.model_dump_json(), clip.unreadable)
    return found_once(key, lambda: flat_field_of(drop, name, clip, view.polarity))


def flat_field_of(drop: Drop, name: str, clip: Clip, polarity: str) -> tuple[Background, list[int]]:
    """As ``flat_field``, for spheres of this polarity, whatever the configuration says of it."""
    view = drop.view(name)
    samples, sampled = clip.sample()
    if view.background == "auto":
        return build_background(samples, clip.full_scale, polarity=polarity), sampled
    empty = read_empty_scene(drop, name, clip.shape)
    return build_background(empty, clip.full_scale, polarity=polarity, empty=True), sampled
