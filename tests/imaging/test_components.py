"""Connected dark parts against the labelling of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wentry_cli.imaging.components import DarkParts, find_dark_parts


def picture(seed: int, share: float, shape: tuple[int, int] = (23, 31)) -> np.ndarray:
    values = np.random.default_rng(seed).uniform(0.0, 1.0, shape).astype(np.float32)
    return np.where(values < share, np.float32(0.2), np.float32(1.0))


def painted(parts: DarkParts, chosen: np.ndarray) -> np.ndarray:
    out = np.zeros(parts.shape, np.uint8)
    for row, first, last in zip(parts.row[chosen], parts.first[chosen], parts.last[chosen], strict=True):
        out[row, first : last + 1] = 1
    return out


@given(seed=st.integers(0, 10_000), share=st.floats(0.0, 1.0), diagonal=st.booleans())
@settings(max_examples=60, deadline=None)
def test_same_parts_as_labelling_pixel_by_pixel(seed: int, share: float, diagonal: bool) -> None:
    values = picture(seed, share)
    parts = find_dark_parts(values, 0.5, diagonal=diagonal)
    mask = (values < 0.5).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8 if diagonal else 4)
    assert len(parts.boxes) == count - 1
    for number, (left, top, right, bottom, area) in enumerate(parts.boxes):
        run = np.flatnonzero(parts.label == number)[0]
        label = labels[parts.row[run], parts.first[run]]
        expected = stats[label]
        assert (left, top, right - left + 1, bottom - top + 1, area) == tuple(expected)
        np.testing.assert_array_equal(painted(parts, parts.label == number), labels == label)
        spans = parts.spans(np.arange(len(parts.boxes)) == number)
        for row, span in enumerate(zip(*spans, strict=True)):
            columns = np.flatnonzero(labels[row] == label)
            assert span == ((columns[0], columns[-1]) if columns.size else (-1, -1))


def test_not_a_number_is_not_dark() -> None:
    values = np.full((4, 6), np.nan, np.float32)
    values[1, 2:4] = 0.1
    parts = find_dark_parts(values, 0.5)
    assert parts.boxes.tolist() == [[2, 1, 3, 1, 2]]


@pytest.mark.parametrize("level", [0.0, 2.0])
def test_all_bright_and_all_dark(level: float) -> None:
    parts = find_dark_parts(np.ones((5, 7), np.float32), level)
    assert parts.boxes.tolist() == ([[0, 0, 6, 4, 35]] if level > 1 else [])
    assert int(painted(parts, parts.label >= 0).sum()) == (35 if level > 1 else 0)
