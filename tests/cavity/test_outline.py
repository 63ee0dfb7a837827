"""Outlines of dark components against a labelling of every pixel."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.body import find_body
from wentry_cli.cavity.outline import follow_outline, no_spans
from wentry_cli.cavity.region import Region, region_of_patch
from wentry_cli.imaging.patch import Patch


def blobs(seed: int, *, blur: float, share: float = 0.5) -> tuple[Region, NDArray[np.int32]]:
    """A region (0 dark, 1 bright) of random blobs of which a ``share`` is dark, and the label of every dark pixel."""
    noise = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(50, 70)), (0, 0), blur)
    dark = noise < np.quantile(noise, share)
    _, labels = cv2.connectedComponents(dark.astype(np.uint8), connectivity=8)
    return region_of_patch(Patch(np.where(dark, 0.0, 1.0).astype(np.float32))), np.asarray(labels, np.int32)


def spans_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last column per row where ``mask`` is true, -1 where it is nowhere."""
    seen = mask.any(axis=1)
    last = mask.shape[1] - 1 - np.argmax(mask[:, ::-1], axis=1)
    return np.where(seen, np.argmax(mask, axis=1), -1), np.where(seen, last, -1)


@pytest.mark.parametrize("blur", [0.4, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_spans_and_box_of_every_component_whatever_pixel_one_begins_with(seed: int, blur: float) -> None:
    region, labels = blobs(seed, blur=blur)
    random = np.random.default_rng(seed)
    for label in range(1, labels.max() + 1):
        rows, columns = np.nonzero(labels == label)
        begin = random.integers(rows.size)
        spans = no_spans(50)
        box = follow_outline(region, np.float32(0.5), int(rows[begin]), int(columns[begin]), spans)
        assert box == (columns.min(), rows.min(), columns.max(), rows.max())
        for found, wanted in zip(spans, spans_of(labels == label), strict=True):
            np.testing.assert_array_equal(found, wanted)


def test_a_ring_is_followed_on_its_outside_from_its_hole() -> None:
    values = np.ones((9, 9), np.float32)
    values[1:8, 1:8] = 0.0
    values[3:6, 3:6] = 1.0
    spans = no_spans(9)
    assert follow_outline(region_of_patch(Patch(values)), np.float32(0.5), 4, 7, spans) == (1, 1, 7, 7)
    np.testing.assert_array_equal(spans[0], [-1, 1, 1, 1, 1, 1, 1, 1, -1])
    np.testing.assert_array_equal(spans[1], [-1, 7, 7, 7, 7, 7, 7, 7, -1])


@pytest.mark.parametrize("seed", range(30))
def test_the_body_is_the_sphere_and_what_reaches_from_the_surface_over_the_axis(seed: int) -> None:
    region, labels = blobs(seed, blur=4.0, share=0.4)
    axis, reach, equator = 35, 5, 40
    strip = labels[equator - 3 : equator + 1, axis - 3 * reach : axis + 3 * reach + 1]
    counts = np.bincount(strip[strip > 0], minlength=labels.max() + 1)
    kept = np.zeros(labels.max() + 1, bool)
    if counts.any():
        kept[np.argmax(counts)] = True
    for label in range(1, labels.max() + 1):
        rows, columns = np.nonzero(labels == label)
        wide = columns.min() <= axis <= columns.max() and np.ptp(columns) + 1 >= reach
        kept[label] |= bool(wide and rows.min() <= 12 and np.ptp(rows) + 1 >= 4)
    for found, wanted in zip(find_body(region, 0.5, (axis, reach, equator)), spans_of(kept[labels]), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_what_was_not_read_ends_a_component() -> None:
    values = np.ones((12, 9), np.float32)
    values[1:11, 3:6] = 0.0
    region = region_of_patch(Patch(values))._replace(unread=(4, 8))
    for row, box in ((2, (3, 1, 5, 3)), (9, (3, 8, 5, 10))):
        assert follow_outline(region, np.float32(0.5), row, 4, no_spans(12)) == box
