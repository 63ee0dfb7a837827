"""Photron recordings: headers written by hand, every depth, cut files, and a real recording."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest
from recording_bytes import SHARED, cih, cihx, grey, pack_bits, write_photron

from wentry_cli.errors import InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.given_rate import GivenRate
from wentry_cli.frames.oriented import orient

NEEDS_SPARSE = pytest.mark.skipif(sys.platform == "win32", reason="files with holes take room here")
EIGHT = grey(6, 4, frames=3).astype(np.uint8)


@pytest.mark.parametrize("header", [cih(), cihx()], ids=["cih", "cihx"])
def test_eight_bit(tmp_path: Path, header: str | bytes) -> None:
    recording = open_recording(write_photron(tmp_path, header, EIGHT.tobytes()))
    assert (recording.info.width, recording.info.height, recording.info.frame_count) == (6, 4, 3)
    assert recording.info.bit_depth == 8
    for index in range(3):
        frame = recording.read(index)
        assert frame.dtype == np.uint8
        np.testing.assert_array_equal(frame, EIGHT[index])
        np.testing.assert_array_equal(recording.read(index, (1, 2, 5, 3)), EIGHT[index, 2:3, 1:5])
    recording.close()


@pytest.mark.parametrize(("width", "height"), [(6, 4), (5, 4), (5, 3), (1, 1)])
def test_twelve_bit_packed_where_rows_and_frames_start_at_half_a_byte(tmp_path: Path, width: int, height: int) -> None:
    levels = grey(width, height, 4095, frames=3)
    header = cihx(bits=12, depth=12, width=width, height=height)
    recording = open_recording(write_photron(tmp_path, header, pack_bits(levels, 12)))
    assert recording.info.format == "Photron MRAW, 12 bit packed"
    for index in range(3):
        whole = recording.read(index)
        assert whole.dtype == np.uint16
        np.testing.assert_array_equal(whole, levels[index])
        for x0 in range(width):
            region = (x0, height // 2, width, height)
            np.testing.assert_array_equal(recording.read(index, region), levels[index, height // 2 :, x0:])


def test_stored_rows_are_those_of_the_file_cropped_and_never_turned(tmp_path: Path) -> None:
    levels = grey(6, 5, 4095, frames=3)
    header = cihx(bits=12, depth=12, width=6, height=5)
    recording = open_recording(write_photron(tmp_path, header, pack_bits(levels, 12)))
    part = orient(GivenRate(recording, 1000.0), roi_px=(1, 2, 5, 5), frames=(1, 2))
    stored, first, packed = part.stored_rows(1, (1, 3), (3, 3)) or (EIGHT[0], -1, False)
    assert packed
    a, b, c = np.moveaxis(stored.reshape(2, 3, 3).astype(int), 2, 0)
    pixels = np.stack([(a << 4) | (b >> 4), ((b & 15) << 8) | c], axis=2).reshape(2, 6)
    np.testing.assert_array_equal(pixels[:, first : first + 4], levels[2, 3:5, 1:5])
    assert orient(recording, rotate=180).stored_rows(0, (0, 5), (5, 5)) is None
    assert orient(recording, flip="h").stored_rows(0, (0, 5), (5, 5)) is None


@pytest.mark.parametrize("bits", [8, 16])
def test_whole_words_are_stored_as_they_are(tmp_path: Path, bits: int) -> None:
    levels = grey(6, 5, 2**bits - 1, frames=3)
    header = cihx(bits=bits, depth=bits, width=6, height=5)
    recording = open_recording(write_photron(tmp_path, header, levels.astype(f"<u{bits // 8}").tobytes()))
    stored, first, packed = orient(recording, roi_px=(2, 1, 6, 5)).stored_rows(1, (0, 3), (3, 3)) or (EIGHT, 0, True)
    assert (first, packed) == (2, False)
    np.testing.assert_array_equal(stored, levels[1, 1:4])


def test_rows_between_may_stay_unread(tmp_path: Path) -> None:
    levels = grey(6, 5, 255, frames=3)
    recording = open_recording(
        write_photron(tmp_path, cihx(bits=8, depth=8, width=6, height=5), levels.astype(np.uint8).tobytes())
    )
    oriented = orient(recording)
    oriented.read(0)
    stored, _, _ = oriented.stored_rows(1, (0, 5), (1, 4)) or (EIGHT, 0, True)
    np.testing.assert_array_equal(stored[[0, 4]], levels[1, [0, 4]])
    np.testing.assert_array_equal(stored[1:4], levels[0, 1:4])  # what the buffer held


def test_rows_that_begin_within_a_byte_are_not_given(tmp_path: Path) -> None:
    levels = grey(5, 4, 4095, frames=3)
    header = cihx(bits=12, depth=12, width=5, height=4)
    recording = open_recording(write_photron(tmp_path, header, pack_bits(levels, 12)))
    assert orient(recording).stored_rows(0, (0, 4), (4, 4)) is None


@pytest.mark.parametrize(("side", "stored"), [("Lower", 1), ("Higher", 16)])
def test_sixteen_bit_words_with_twelve_significant(tmp_path: Path, side: str, stored: int) -> None:
    levels = grey(6, 4, 4095, frames=3)
    data = (levels * stored).astype("<u2").tobytes()
    recording = open_recording(write_photron(tmp_path, cih(bits=16, depth=12, side=side), data))
    assert recording.info.bit_depth == 12
    np.testing.assert_array_equal(recording.read(2), levels[2])
    np.testing.assert_array_equal(recording.read(1, (2, 1, 6, 4)), levels[1, 1:, 2:])


def test_rate_is_divided_by_the_save_step_and_numbers_are_kept(tmp_path: Path) -> None:
    header = cihx(rate=60000, step=36, start=-72)
    recording = open_recording(write_photron(tmp_path, header, EIGHT.tobytes()))
    assert recording.info.fps == pytest.approx(60000 / 36, rel=1e-15)
    assert recording.info.fps_source == "cihx recordRate / skipFrame"
    assert recording.camera_frames().tolist() == [-72, -36, 0]
    assert recording.times_s() is None


@pytest.mark.parametrize(
    ("header", "exposure_s"),
    [
        (cihx(shutter_ns=20000, shutter=7), 20e-6),
        (cihx(shutter_ns=0, shutter=50000), 20e-6),
        (cih(shutter="1/800000"), 1.25e-6),
        (cih(shutter="0.0005"), 5e-4),
        (cih(shutter="1/800000", shutter_ns=1250), 1.25e-6),
        (cih(shutter="open"), None),
    ],
)
def test_exposure(tmp_path: Path, header: str | bytes, exposure_s: float | None) -> None:
    recording = open_recording(write_photron(tmp_path, header, EIGHT.tobytes()))
    if exposure_s is None:
        assert recording.info.exposure_s is None
    else:
        assert recording.info.exposure_s == pytest.approx(exposure_s, rel=1e-12)


def test_rate_of_zero_is_unknown(tmp_path: Path) -> None:
    info = open_recording(write_photron(tmp_path, cih(rate=0), EIGHT.tobytes())).info
    assert info.fps is None
    assert info.fps_source == "unknown"
    assert not info.rate_trusted


def test_the_mraw_itself_can_be_given_and_case_does_not_matter(tmp_path: Path) -> None:
    write_photron(tmp_path, cih(), EIGHT.tobytes())
    (tmp_path / "clip.mraw").rename(tmp_path / "clip.MRAW")
    recording = open_recording(tmp_path / "clip.MRAW")
    np.testing.assert_array_equal(recording.read(0), EIGHT[0])
    recording = open_recording(tmp_path / "clip.cih")
    np.testing.assert_array_equal(recording.read(0), EIGHT[0])


def test_missing_partner(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(), EIGHT.tobytes())
    (tmp_path / "clip.mraw").rename(tmp_path / "other.mraw")
    with pytest.raises(InputError, match=r"no clip\.mraw beside it"):
        open_recording(path)
    with pytest.raises(InputError, match=r"no header other\.cihx or other\.cih"):
        open_recording(tmp_path / "other.mraw")


def test_a_truncated_mraw_says_what_is_whole_and_how_to_use_it(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(), EIGHT.tobytes()[:-5])
    with pytest.raises(InputError, match=r"67 bytes, but clip\.cih claims 72 .*`frames: \[0, 1\]`"):
        open_recording(path)
    with pytest.raises(InputError, match=r"frames: \[0, 1\]"):
        open_recording(path, frames=(0, 2))
    recording = open_recording(path, frames=(0, 1))
    np.testing.assert_array_equal(recording.read(1), EIGHT[1])
    assert recording.info.frame_count == 2
    assert recording.camera_frames().tolist() == [0, 1]
    assert recording.info.notes == ("clip.mraw holds 2 of the 3 frames",)


@pytest.mark.parametrize(
    ("claimed", "fits"),
    [
        ({"height": 50}, " (they would be 20 frames of 64 x 40 pixels, 8 bit)"),  # 16 frames of the header
        ({"height": 48}, " (they would be 20 frames of 64 x 40 pixels, 8 bit)"),
        ({"width": 71}, " (they would be 20 frames of 64 x 40 pixels, 8 bit)"),
        ({"bits": 16, "depth": 12}, " (they would be 20 frames of 64 x 40 pixels, 8 bit)"),
        ({"height": 30}, " (they would be 20 frames of 64 x 40 pixels, 8 bit)"),  # more than the header claims
        ({"frames": 19}, ""),
    ],
)
def test_a_header_of_other_data_is_no_cut_copy(tmp_path: Path, claimed: dict[str, int], fits: str) -> None:
    path = write_photron(tmp_path, cih(**{"width": 64, "height": 40, "frames": 20, **claimed}), bytes(64 * 40 * 20))
    with pytest.raises(InputError) as caught:
        open_recording(path)
    assert f"; header and data disagree{fits}: use the header and MRAW that were saved together" in str(caught.value)
    assert "frames: [0" not in str(caught.value)


@pytest.mark.parametrize(("size", "last"), [(64 * 40 * 19, 18), (64 * 40 * 15 + 1000, 14), (64 * 40 * 15 - 1, 13)])
def test_a_copy_that_ends_early_can_be_used(tmp_path: Path, size: int, last: int) -> None:
    path = write_photron(tmp_path, cih(width=64, height=40, frames=20), bytes(size))
    with pytest.raises(InputError, match=rf"copy both again, or set `frames: \[0, {last}\]`"):
        open_recording(path)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"frames": 2}, "72 bytes, but clip.cih claims 48"),
        ({"width": 7}, "claims 84"),
        ({"width": 65536, "height": 65536, "frames": 1 << 31}, "not one frame is whole"),
        ({"width": 0}, "'Image Width' is '0'"),
        ({"width": -6}, "'Image Width' is '-6'"),
        ({"height": 10**30}, "not a whole number from 1"),
        ({"frames": -1}, "'Total Frame' is '-1'"),
        ({"frames": "many"}, "'Total Frame' is 'many'"),
        ({"width": None}, "'Image Width' is missing"),
        ({"bits": 24}, "a colour MRAW"),
        ({"colour": "Bayer"}, "a colour MRAW"),
        ({"bits": 10}, "10 bit is not supported"),
        ({"side": "Left"}, "neither Lower nor Higher"),
        ({"format": "Tiff"}, "not an MRAW"),
    ],
)
def test_a_header_that_cannot_be_true(tmp_path: Path, changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        open_recording(write_photron(tmp_path, cih(**changes), EIGHT.tobytes()))
    assert sentence in str(caught.value)


BILLION_LAUGHS = (
    b'<?xml version="1.0"?><!DOCTYPE cih [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
    b"<cih><imageDataInfo>&b;</imageDataInfo></cih>"
)


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        (BILLION_LAUGHS, "declares a document type or entities"),
        (b"", "no complete <cih>"),
        (cihx()[:700], "no complete <cih>"),
        (b"<cih><a></b></cih>", "not well-formed"),
        (b"<cih>&undeclared;</cih>", "not well-formed"),
        (b"<cih>" + b"<a>" * 100000 + b"</cih>", "nested deeper"),
        (b"<cih></cih>", "is missing"),
        (b" " * (5 << 20), "larger than"),
    ],
)
def test_hostile_xml(tmp_path: Path, raw: bytes, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        open_recording(write_photron(tmp_path, raw, EIGHT.tobytes()))
    assert sentence in str(caught.value)


def test_reading_after_closing_is_an_error(tmp_path: Path) -> None:
    recording = open_recording(write_photron(tmp_path, cih(), EIGHT.tobytes()))
    recording.close()
    recording.close()
    with pytest.raises(ValueError, match="after it was closed"):
        recording.read(0)


@NEEDS_SPARSE
def test_memory_does_not_grow_with_the_frames_read(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(width=1024, height=1024, frames=300, bits=12, depth=12), b"")
    os.truncate(tmp_path / "clip.mraw", 300 * 1024 * 1024 * 3 // 2)
    recording = open_recording(path)
    recording.read(0)
    before = psutil.Process().memory_info().rss
    for index in range(0, 300, 3):
        recording.read(index)
        recording.read(index, (300, 300, 600, 600))
    assert psutil.Process().memory_info().rss - before < 16 << 20


@NEEDS_SPARSE
def test_offsets_do_not_overflow_for_narrow_integers(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(width=60000, height=50000, frames=2), b"")
    os.truncate(tmp_path / "clip.mraw", 6_000_000_000)
    region = tuple(np.array([59999, 49999, 60000, 50000], np.int32))
    assert open_recording(path).read(np.int32(1), region).tolist() == [[0]]


def test_frames_and_regions_that_do_not_exist(tmp_path: Path) -> None:
    recording = open_recording(write_photron(tmp_path, cih(), EIGHT.tobytes()))
    for index in (-1, 3):
        with pytest.raises(IndexError):
            recording.read(index)
    for region in ((0, 0, 7, 4), (2, 0, 2, 4), (-1, 0, 3, 3), (0, 3, 3, 1)):
        with pytest.raises(ValueError, match="region"):
            recording.read(0, region)


REAL = SHARED / "photron" / "ball_12bit.cihx"


@pytest.mark.skipif(not REAL.exists(), reason=f"real recordings absent: {SHARED}")
def test_a_real_recording() -> None:
    recording = open_recording(REAL)
    info = recording.info
    assert (info.frame_count, info.width, info.height, info.bit_depth) == (15, 384, 384, 12)
    assert (info.fps, info.exposure_s) == (30000.0, pytest.approx(20e-6))
    assert recording.camera_frames().tolist() == list(range(52, 67))
    frames = [recording.read(index) for index in range(15)]
    sums = [int(frame.sum(dtype=np.int64)) for frame in frames]
    assert sums[:3] == [515377976, 515217314, 515156446]
    assert sum(sums) == 7728115494
    assert (min(f.min() for f in frames), max(f.max() for f in frames)) == (84, 4095)
    np.testing.assert_array_equal(recording.read(7, (101, 33, 250, 300)), frames[7][33:300, 101:250])
