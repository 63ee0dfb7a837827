"""Clips whose speed is measured: raw ones are rendered, the other formats hold the same frames, written again."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import yaml

from wentry_cli.frames.formats import open_recording
from wentry_cli.synthetic.campaign import FIRST_NUMBER
from wentry_cli.synthetic.frame_writers import FrameWriter, ImageWriter, Levels
from wentry_cli.tables import write_text

SUFFIX = {"png": ".png", "tiff": ".tif"}


@dataclass(frozen=True)
class SpeedCase:
    """A raw clip of ``bits`` with a sphere of ``radius_px``, written again as ``copy``: "png", "tiff", "avi" or not."""

    name: str
    bits: int
    radius_px: float
    copy: str = ""

    @property
    def raw(self) -> str:
        """Name of the folder with the raw clip."""
        return f"raw_{self.bits}_{self.radius_px:.0f}"


class MotionJpegWriter:
    """``<view>.avi`` of motion JPEG, what the software of most cameras exports, with OpenCV's default quality."""

    def __init__(self, folder: Path, view: str) -> None:
        """Nothing is opened before the first frame, which tells the size."""
        self.source = f"{view}.avi"
        self._path = folder / self.source
        self._video: Any = None

    def write(self, number: int, levels: Levels) -> None:
        """Append one frame of 8 bit."""
        if self._video is None:
            size = levels.shape[::-1]
            self._video = cv2.VideoWriter(str(self._path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, size)
            if not self._video.isOpened():
                raise OSError(f"cannot encode {self._path}")
        self._video.write(cv2.cvtColor(levels, cv2.COLOR_GRAY2BGR))

    def close(self) -> None:
        """Finish the file."""
        if self._video is not None:
            self._video.release()


def write_copy(raw: Path, folder: Path, kind: str) -> None:
    """Write the frames of the rendered drop ``raw`` into ``folder`` as ``kind``, its truth beside them."""
    folder.mkdir()
    experiment = yaml.safe_load((raw / "experiment.yaml").read_text(encoding="utf-8"))
    side = experiment["views"]["side"]
    recording = open_recording(raw / side["source"])
    writer: FrameWriter = (
        MotionJpegWriter(folder, "side") if kind == "avi" else ImageWriter(folder, "side", SUFFIX[kind])
    )
    for index in range(recording.info.frame_count):
        writer.write(FIRST_NUMBER + index, recording.read(index))
    writer.close()
    recording.close()
    shutil.copytree(raw / "truth", folder / "truth")
    side |= {"source": writer.source, "fps": recording.info.fps, "exposure_s": recording.info.exposure_s}
    write_text(folder / "experiment.yaml", yaml.safe_dump(experiment, sort_keys=False))
