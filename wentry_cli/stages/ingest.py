"""Stage ingest: list the frames of each view with their times, levels and what is wrong with them (frames.csv)."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.config.blame import wrong_key
from wentry_cli.config.values import FASTEST, SLOWEST
from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.oriented import Oriented, orient
from wentry_cli.frames.reader import Frame, RecordingInfo, Region
from wentry_cli.imaging.exposure import sum_and_clipped
from wentry_cli.progress import tick
from wentry_cli.stages.inputs.agreement import check_clocks, check_view
from wentry_cli.stages.inputs.empty_scene import check_empty_scene
from wentry_cli.tables import new_table, write_table

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

STRIP_ROWS = 4
STRIPS = 3
SHOWN = 5  # frames that a message names
logger = logging.getLogger(__name__)
RANDOM_ACCESS = ("Photron", "Phantom")
FOR_THE_EYE, LOSSLESS = ("video", "JPEG"), ("FFV1", "HFYU", "Y800")


@dataclass(frozen=True)
class OpenView:
    """A view as the measurement sees it, and where its optical axis meets it by default (middle of the whole image)."""

    recording: Oriented
    middle_px: tuple[float, float]

    @property
    def info(self) -> RecordingInfo:
        """What is known of the recording, after turning and cropping."""
        return self.recording.info

    @property
    def full_scale(self) -> float:
        """The highest grey level."""
        return float(2**self.info.bit_depth - 1)


def open_view(drop: Drop, name: str) -> OpenView:
    """Open the recording of the view ``name`` of ``drop``, turned, mirrored and cropped as its configuration says.

    Raises ``InputError`` where it is missing or unreadable, ``ConfigurationError`` where its region lies outside of it.
    """
    view = drop.view(name)
    fps = None if view.fps == "from_header" else float(view.fps)
    raw = open_recording(drop.existing_source(name), fps=fps, frames=view.frames)
    width, height = raw.info.width, raw.info.height
    if view.rotate in (90, 270):
        width, height = height, width
    if view.roi_px is not None and not (view.roi_px[2] <= width and view.roi_px[3] <= height):
        raw.close()
        told = f"{list(view.roi_px)} is not within the image of {width} x {height} pixels (turned by rotate)"
        raise wrong_key(drop, f"views.{name}.roi_px", list(view.roi_px), told)
    recording = orient(raw, rotate=view.rotate, flip=view.flip, roi_px=view.roi_px, frames=view.frames)
    left, top = recording.origin_px
    return OpenView(recording, ((width - 1) / 2 - left, (height - 1) / 2 - top))


def frame_rate(drop: Drop, name: str, info: RecordingInfo) -> float:
    """The camera's rate in 1/s; raises ``ConfigurationError`` where neither file nor configuration tells it."""
    if info.fps is None or not info.rate_trusted:
        told = "" if info.fps is None else f" ({info.fps:g} is a {info.fps_source})"
        told = f"{info.path.name} has no frame rate that can be trusted{told}; give that of the camera in frames/s"
        raise wrong_key(drop, f"views.{name}.fps", drop.view(name).fps, told)
    if not SLOWEST <= info.fps <= FASTEST:
        raise InputError(
            f"{info.path}: its header claims {info.fps:g} frames/s, which no camera films with; set views.{name}.fps"
        )
    return float(info.fps)


def frame_times(drop: Drop, name: str, opened: OpenView) -> NDArray[np.float64]:
    """Mid-exposure of every frame on the camera clock in s: the camera's stamps where it gives them, else the rate.

    0 at the first frame of the side view; the top view starts at its ``offset_s``. All frames are exposed equally long,
    so mid-exposure and start differ by a constant that drops out.
    """
    rate = frame_rate(drop, name, opened.info)
    stamps = opened.recording.times_s()
    if stamps is None:
        stamps = np.arange(opened.info.frame_count) / rate
    return np.asarray(stamps + (drop.view(name).offset_s if name == "top" else 0.0), np.float64)


def _strips(info: RecordingInfo) -> list[Region] | None:
    """Rows that stand for a frame where parts can be read at random; None where a frame is decoded whole anyway."""
    if not info.format.startswith(RANDOM_ACCESS) or info.height <= STRIPS * STRIP_ROWS:
        return None
    firsts = ((2 * k + 1) * info.height // (2 * STRIPS) - STRIP_ROWS // 2 for k in range(STRIPS))
    return [(0, first, info.width, first + STRIP_ROWS) for first in firsts]


class _Looks:
    """Levels of the frames of one view, and which frames equal the one before bit by bit."""

    def __init__(self, opened: OpenView) -> None:
        strips = _strips(opened.info)
        self._recording, self._full_scale = opened.recording, int(opened.full_scale)
        self._wanted: list[Region | None] = [None] if strips is None else [*strips]
        self._last: tuple[list[Frame], list[int], int] = ([], [], -1)
        self.repeated: list[int] = []

    def level(self, index: int) -> tuple[float, float]:
        """Mean level and share of clipped pixels; raises ``FrameUnreadableError``."""
        parts = [self._recording.read(index, region) for region in self._wanted]
        found = [sum_and_clipped(part, self._full_scale) for part in parts]
        sums, size = [total for total, _ in found], sum(part.size for part in parts)
        before, before_sums, last = self._last
        if sums == before_sums and all(np.array_equal(*pair) for pair in zip(parts, before, strict=True)):
            whole = self._wanted == [None] or self._equal(index, last)
            self.repeated += [index] if whole else []
        self._last = parts, sums, index
        return sum(sums) / size, sum(clipped for _, clipped in found) / size

    def _equal(self, index: int, other: int) -> bool:
        return bool(np.array_equal(self._recording.read(index), self._recording.read(other)))


def tell_notes(drop: Drop, name: str, info: RecordingInfo) -> None:
    """Warn of what the recording of the view ``name`` itself has to tell."""
    for note in info.notes:
        logger.warning("%s: views.%s.source: %s", drop.name, name, note)
    if info.bit_depth == 8 and info.format.startswith(FOR_THE_EYE) and not any(c in info.format for c in LOSSLESS):
        logger.warning(
            "%s: views.%s.source: grey levels of %s are usually not linear in the light: a gamma of 0.45 makes the "
            "sphere 1 %% too small and speeds as much too high, which no uncertainty here holds; export raw or TIFF",
            drop.name, name, info.format,
        )  # fmt: skip


def look_at_frames(drop: Drop, name: str, opened: OpenView, done: int = 0) -> tuple[NDArray[np.float64], list[str]]:
    """Read the frames of the view ``name``: their levels and their status words; nothing is written.

    Levels are the mean and the share of clipped pixels, (frames, 2), NaN where a frame cannot be read. Frames that are
    damaged, missing or those before them once more are told in a warning; ``done`` frames came before, for the bar.
    """
    count = opened.info.frame_count
    looks = _Looks(opened)
    levels = np.full((count, 2), np.nan)
    status, numbers = ["ok"] * count, opened.recording.camera_frames()
    named = [f"{index} (number {number})" if index != number else f"{index}" for index, number in enumerate(numbers)]
    for index in range(count):
        try:
            levels[index] = looks.level(index)
        except FrameUnreadableError as error:
            status[index] = error.status
            named[index] = f"{index} ({error.file})" if error.file else named[index]
        if index % 32 == 0:
            tick(done + index, done + count)
    _tell_damage(drop.name, name, status, named)
    if looks.repeated:
        # what such a frame shows is not of its own time
        for index in looks.repeated:
            status[index] = "bad_frame"
        logger.warning(
            "%s: %d of %d frames of the %s view equal the frame before bit by bit, first frame %s, which "
            "no camera does; they are left out; export the recording again, or times and speeds may be wrong",
            drop.name, len(looks.repeated), count, name, named[looks.repeated[0]],
        )  # fmt: skip
    return levels, status


def _view_rows(drop: Drop, name: str, done: int) -> dict[str, Any]:
    opened = open_view(drop, name)
    try:
        tell_notes(drop, name, opened.info)
        check_view(drop, name, opened.info)
        check_empty_scene(drop, name, (opened.info.height, opened.info.width))
        times = frame_times(drop, name, opened)
        levels, status = look_at_frames(drop, name, opened, done)
        return {
            "view": [name] * len(status),
            "frame": np.arange(len(status)),
            "camera_frame": opened.recording.camera_frames(),
            "time_s": times,
            "mean_level": levels[:, 0],
            "saturated_fraction": levels[:, 1],
            "status": status,
        }
    finally:
        opened.recording.close()


def _tell_damage(drop: str, view: str, status: list[str], named: list[str]) -> None:
    """Say which frames cannot be read and which the numbering skips, by index and file or the camera's number."""
    for word, what in (("bad_frame", "cannot be read"), ("gap", "are missing")):
        lost = [index for index, one in enumerate(status) if one == word]
        if lost:
            shown = ", ".join(named[index] for index in lost[:SHOWN]) + (" and others" if len(lost) > SHOWN else "")
            logger.warning(
                "%s: %d of %d frames of the %s view %s: %s; they are left out",
                drop, len(lost), len(status), view, what, shown,
            )  # fmt: skip


def run(folder: Path, drop: Drop) -> None:
    """Write frames.csv.

    Raw recordings (Photron, Phantom) are read at three strips of four rows per frame, which stand for it; images and
    video have to be decoded whole to know whether they can be. Raises ``ConfigurationError`` where no rate is known or
    the configuration cannot be that of the recording, and ``InputError`` where a recording or its background cannot be
    opened.
    """
    parts: list[dict[str, Any]] = []
    done = 0
    for name in drop.experiment.sides:
        parts.append(_view_rows(drop, name, done))
        done += len(parts[-1]["frame"])
    check_clocks(drop, {part["view"][0]: (part["time_s"][0], part["time_s"][-1]) for part in parts})
    columns = {key: np.concatenate([np.asarray(part[key]) for part in parts]) for key in parts[0]}
    write_table(folder, "frames", new_table("frames", columns))
