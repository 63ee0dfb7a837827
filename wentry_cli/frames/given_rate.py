"""A recording whose frame rate the user gives: it wins over what the file says, stamps included."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import ConfigurationError
from wentry_cli.frames.reader import RATE_GIVEN, Frame, Recording, Region, StoredRows, StoresRows


class GivenRate:
    """``recording`` with ``fps`` frames per second and no stamps."""

    def __init__(self, recording: Recording, fps: float) -> None:
        """Wrap ``recording``; ConfigurationError for a rate that is not positive."""
        if not (math.isfinite(fps) and fps > 0):
            recording.close()
            raise ConfigurationError(f"{recording.info.path}: a frame rate of {fps:g} is impossible; give it in 1/s")
        self._recording = recording
        self._stored = recording if isinstance(recording, StoresRows) else None
        self.close = recording.close
        self.info = replace(recording.info, fps=float(fps), fps_source=RATE_GIVEN)

    def read(self, index: int, region: Region | None = None) -> Frame:
        """Return frame ``index`` as the recording has it."""
        return self._recording.read(index, region)

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows | None:
        """Return rows of frame ``index`` as the recording stores them."""
        return self._stored.stored_rows(index, rows, unread) if self._stored else None

    def camera_frames(self) -> NDArray[np.int64]:
        """Return the camera's numbers."""
        return self._recording.camera_frames()

    def times_s(self) -> None:
        """Return None: the given rate holds."""
