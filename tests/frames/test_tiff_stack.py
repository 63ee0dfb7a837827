"""TIFF files of many pages: both byte orders, both pointer sizes, strips, compression, ImageJ's long stacks."""

from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from recording_bytes import grey, tiff

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.reader import Recording


def opened(tmp_path: Path, data: bytes, **options: tuple[int, int]) -> Recording:
    path = tmp_path / "stack.tif"
    path.write_bytes(data)
    return open_recording(path, **options)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("compression", [1, 8])
def test_pages(tmp_path: Path, order: str, bits: int, big: bool, compression: int) -> None:
    levels = grey(7, 5, 2**bits - 1, frames=3)
    recording = opened(tmp_path, tiff(list(levels), bits, order, big=big, compression=compression))
    assert recording.info.format == f"TIFF of 3 pages, {bits} bit"
    assert recording.info.frame_count == 3
    for index in (2, 0, 1):
        frame = recording.read(index)
        assert frame.dtype == (np.uint8 if bits == 8 else np.uint16)
        np.testing.assert_array_equal(frame, levels[index])
        np.testing.assert_array_equal(recording.read(index, (1, 2, 6, 4)), levels[index, 2:4, 1:6])


def test_twelve_bits_in_the_upper_bits_of_the_words(tmp_path: Path) -> None:
    levels = grey(7, 5, 4095, frames=3)
    recording = opened(tmp_path, tiff(list(levels * 16), 16))
    assert recording.info.bit_depth == 12
    assert recording.info.random_access
    np.testing.assert_array_equal(recording.read(1, (1, 1, 6, 5)), levels[1, 1:, 1:6])


def test_white_may_be_zero(tmp_path: Path) -> None:
    levels = grey(7, 5)[0]
    np.testing.assert_array_equal(opened(tmp_path, tiff([levels], 8, photometric=0)).read(0), 255 - levels)


@pytest.mark.parametrize("colour", [False, True])
def test_what_a_common_library_writes(tmp_path: Path, colour: bool) -> None:
    levels = grey(33, 21, frames=4).astype(np.uint8)
    pages = [np.dstack([page] * 3) if colour else page for page in levels]
    assert cv2.imwritemulti(str(tmp_path / "stack.tif"), pages)  # LZW with a predictor
    recording = open_recording(tmp_path / "stack.tif")
    assert recording.info.format.endswith("converted to grey") == colour
    for index in range(4):
        np.testing.assert_array_equal(recording.read(index), levels[index])


def test_a_long_imagej_stack_has_one_directory(tmp_path: Path) -> None:
    levels = grey(7, 5, 65535, frames=4)
    first = tiff([levels[0]], 16, ">", strips=1, description=b"ImageJ=1.53k\nimages=4\nslices=4\n\0")
    data = first + b"".join(page.astype(">u2").tobytes() for page in levels[1:])
    recording = opened(tmp_path, data)
    assert recording.info.frame_count == 4
    np.testing.assert_array_equal(recording.read(3), levels[3])
    with pytest.raises(InputError, match="says it holds 4 frames, but only 3 are whole"):
        opened(tmp_path, data[:-2])


def test_pages_of_different_size(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="page 1 has 6 x 5 pixels"):
        opened(tmp_path, tiff([grey(7, 5)[0], grey(6, 5)[0]], 8))


def test_unsupported_depth(tmp_path: Path) -> None:
    data = tiff([grey(7, 5)[0]], 8)
    with pytest.raises(InputError, match="levels of 12 bit"):
        opened(tmp_path, data.replace(b"\x02\x01\x03\0\x01\0\0\0\x08", b"\x02\x01\x03\0\x01\0\0\0\x0c"))


def test_a_truncated_stack_says_what_is_whole_and_how_to_use_it(tmp_path: Path) -> None:
    pages = list(grey(7, 5, frames=3))
    data = tiff(pages, 8)
    two = len(tiff(pages[:2], 8))
    with pytest.raises(InputError, match=r"`frames: \[0, 1\]` in the view to use the 2 pages"):
        opened(tmp_path, data[: two + 20])
    recording = opened(tmp_path, data[: two + 20], frames=(0, 1))
    np.testing.assert_array_equal(recording.read(1), pages[1])
    recording = opened(tmp_path, data[:-4])
    with pytest.raises(FrameUnreadableError):
        recording.read(2)


def test_directories_in_a_circle(tmp_path: Path) -> None:
    data = bytearray(tiff([grey(7, 5)[0]], 8))
    entries = int.from_bytes(data[8:10], "little")
    data[10 + 12 * entries : 14 + 12 * entries] = (8).to_bytes(4, "little")
    with pytest.raises(InputError, match="run in a circle"):
        opened(tmp_path, bytes(data))


def test_the_last_page_costs_no_more_than_the_first(tmp_path: Path) -> None:
    pages = [grey(16, 16)[0]] * 600
    recording = opened(tmp_path, tiff(pages, 8, compression=8))
    recording.read(0)
    begin = time.perf_counter()
    for index in range(1, 21):
        recording.read(index)
    early = time.perf_counter() - begin
    begin = time.perf_counter()
    for index in range(580, 600):
        recording.read(index)
    assert time.perf_counter() - begin < 5 * early + 0.02
