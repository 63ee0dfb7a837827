"""Regions of packed and of unpacked pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.region import read_region, transmission, transmission_of_row, was_read
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.source import FrameArray

LEVELS = np.random.default_rng(5).integers(0, 4096, (1, 9, 14)).astype(np.uint16)
GAIN = np.random.default_rng(6).uniform(1e-4, 1e-3, (9, 10)).astype(np.float32)
GROUND = Background(1.0 / GAIN, GAIN, 0.01, float("inf"), 4095.0, 0.0)


@dataclass
class PackedFrames:
    """Frames of 12 bits of which column 0 is column ``first`` of the stored rows."""

    first: int
    shape: tuple[int, int] = (9, 10)
    count: int = 1
    full_scale: float = 4095.0

    def stored_rows(
        self, index: int, rows: tuple[int, int], unread: tuple[int, int]
    ) -> tuple[NDArray[np.uint8], int, bool]:
        """The rows of the frame, two pixels in three bytes."""
        even, odd = LEVELS[index, rows[0] : rows[1], ::2], LEVELS[index, rows[0] : rows[1], 1::2]
        stored = np.stack([even >> 4, ((even & 15) << 4) | (odd >> 8), odd & 255], axis=2)
        stored[unread[0] - rows[0] : unread[1] - rows[0]] = 0
        return np.ascontiguousarray(stored.reshape(rows[1] - rows[0], -1).astype(np.uint8)), self.first, True

    def read(self, index: int, region: tuple[int, int, int, int] | None = None) -> NDArray[Any]:
        """Nothing is to be unpacked."""
        raise AssertionError


@pytest.mark.parametrize("first", [0, 1, 4])
@pytest.mark.parametrize("x0", [0, 3])
def test_packed_pixels_have_the_transmission_of_unpacked_ones(first: int, x0: int) -> None:
    box = (x0, 2, 10, 7)
    packed = read_region(PackedFrames(first), 0, box, GROUND)
    plain = read_region(FrameArray(LEVELS[:, :, first : first + 10]), 0, box, GROUND)
    assert (packed.packed, plain.packed) == (True, False)
    assert packed.columns == plain.columns == 10 - x0
    for row in range(5):
        for column in range(10 - x0):
            wanted = np.float32(LEVELS[0, 2 + row, first + x0 + column]) * GAIN[2 + row, x0 + column]
            assert transmission(packed, row, column) == transmission(plain, row, column) == wanted


@pytest.mark.parametrize("first", [0, 1, 4])
@pytest.mark.parametrize("columns", [(0, 10), (1, 10), (2, 9), (5, 6)])
def test_a_row_at_once_is_its_pixels_one_by_one(first: int, columns: tuple[int, int]) -> None:
    packed = read_region(PackedFrames(first), 0, (0, 2, 10, 7), GROUND)
    plain = read_region(FrameArray(LEVELS[:, :, first : first + 10]), 0, (0, 2, 10, 7), GROUND)
    for region in (packed, plain):
        pixels = [transmission(region, 3, column) for column in range(*columns)]
        np.testing.assert_array_equal(transmission_of_row(region, 3, *columns), pixels)


def test_rows_may_stay_unread_where_that_saves_time() -> None:
    part = read_region(PackedFrames(1), 0, (0, 1, 10, 9), GROUND, (3, 6))
    assert [was_read(part, row) for row in range(8)] == [True, True, False, False, False, True, True, True]
    whole = read_region(PackedFrames(1), 0, (0, 1, 10, 9), GROUND)
    for row in (1, 5):
        assert transmission(part, row, 4) == transmission(whole, row, 4) > 0.0
    plain = read_region(FrameArray(LEVELS), 0, (0, 1, 10, 9), GROUND, (3, 6))
    assert all(was_read(plain, row) for row in range(8))
