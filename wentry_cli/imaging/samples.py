"""Frames that show the whole of a clip, with small copies of them made while each is at hand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.clean_mean import BLOCK_PX
from wentry_cli.imaging.detection import shrink
from wentry_cli.imaging.ground import block_means


class Samples:
    """Grey levels of some frames, and of each a copy for the first look at it and the means of its blocks.

    ``coarse`` are the results of ``shrink``, ``blocks`` (frames, blocks down and across) those of ``block_means``.
    They are made as a frame comes in, while the processor still has it in its cache.
    """

    def __init__(self, room: NDArray[Any]) -> None:
        """Take an array (frames, rows, columns) that will be filled, frame by frame."""
        self._room = room
        self.coarse: list[tuple[NDArray[np.float32], float]] = []
        rows, columns = room.shape[1:]
        self._blocks = np.empty((len(room), -(-rows // BLOCK_PX), -(-columns // BLOCK_PX)), np.float32)
        self._black: list[int] = []

    @classmethod
    def of(cls, frames: NDArray[Any]) -> Samples:
        """Those of an array (frames, rows, columns) that is filled already."""
        samples = cls(frames)
        for _ in frames:
            samples.add()
        return samples

    @property
    def next(self) -> NDArray[Any]:
        """Where the grey levels of the next frame go, before it is added."""
        return np.asarray(self._room[len(self.coarse)])

    def add(self) -> None:
        """Count the frame that was written to ``next``."""
        frame, index = self.next, len(self.coarse)
        if not frame.min():
            self._black.append(index)
        self._blocks[index] = block_means(frame)
        self.coarse.append(shrink(frame))

    def lift_black(self) -> None:
        """Turn grey levels of 0, which stand for what is covered, into 1."""
        for index in self._black:
            frame = self._room[index]
            np.maximum(frame, 1, out=frame)
            self._blocks[index], self.coarse[index] = block_means(frame), shrink(frame)
        self._black.clear()

    @property
    def frames(self) -> NDArray[Any]:
        """The grey levels (frames, rows, columns)."""
        return self._room[: len(self.coarse)]

    @property
    def blocks(self) -> NDArray[np.float32]:
        """The means of their blocks."""
        return self._blocks[: len(self.coarse)]
