"""Phantom cines: bytes laid by hand, damage at every place, and real cines with their decoded frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recording_bytes import SHARED, cine, grey, pack_bits

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.linearisation import levels_of_10bit_codes
from wentry_cli.frames.reader import Recording

LEVELS = grey(4, 2, frames=3)
EIGHT = [frame[::-1].astype(np.uint8).tobytes() for frame in LEVELS]  # bottom row first


def opened(tmp_path: Path, data: bytes, **options: tuple[int, int]) -> Recording:
    path = tmp_path / "clip.cine"
    path.write_bytes(data)
    return open_recording(path, **options)


def test_eight_bit_is_stored_from_the_bottom_up(tmp_path: Path) -> None:
    recording = opened(tmp_path, cine(EIGHT, annotation=b"a note on the frame"))
    assert recording.info.bit_depth == 8
    for index in range(3):
        frame = recording.read(index)
        assert frame.dtype == np.uint8
        np.testing.assert_array_equal(frame, LEVELS[index])
        np.testing.assert_array_equal(recording.read(index, (1, 1, 3, 2)), LEVELS[index, 1:2, 1:3])
    assert recording.camera_frames().tolist() == [-2, -1, 0]


def test_a_negative_height_means_top_row_first(tmp_path: Path) -> None:
    recording = opened(tmp_path, cine([f.astype(np.uint8).tobytes() for f in LEVELS], height=-2))
    np.testing.assert_array_equal(recording.read(1), LEVELS[1])


def test_rows_padded_to_four_bytes(tmp_path: Path) -> None:
    levels = grey(3, 2)[0]
    padded = b"".join(row.astype(np.uint8).tobytes() + b"\xee" for row in levels[::-1])
    np.testing.assert_array_equal(opened(tmp_path, cine([padded], width=3)).read(0), levels)


def test_sixteen_bit_words_with_their_real_depth(tmp_path: Path) -> None:
    levels = grey(4, 2, 4095, frames=2)
    images = [frame[::-1].astype("<u2").tobytes() for frame in levels]
    recording = opened(tmp_path, cine(images, bits=16, real=12))
    assert recording.info.bit_depth == 12
    np.testing.assert_array_equal(recording.read(1), levels[1])
    np.testing.assert_array_equal(recording.read(0, (2, 0, 4, 1)), levels[0, :1, 2:])
    assert opened(tmp_path, cine(images, bits=16, real=0)).info.bit_depth == 16


@pytest.mark.parametrize("width", [4, 5, 8])
def test_ten_bit_packed_is_linearised_and_top_row_first(tmp_path: Path, width: int) -> None:
    codes = grey(width, 3, 1023, frames=2)
    images = [pack_bits(frame, 10) for frame in codes]
    recording = opened(tmp_path, cine(images, width=width, height=3, bits=16, packing=256, real=10))
    assert recording.info.bit_depth == 12
    expected = levels_of_10bit_codes()[codes]
    for index in range(2):
        np.testing.assert_array_equal(recording.read(index), expected[index])
        np.testing.assert_array_equal(recording.read(index, (1, 1, width, 3)), expected[index, 1:, 1:])


def test_twelve_bit_packed(tmp_path: Path) -> None:
    levels = grey(5, 3, 4095, frames=2)
    images = [pack_bits(frame, 12) for frame in levels]
    recording = opened(tmp_path, cine(images, width=5, height=3, bits=16, packing=1024, real=12))
    np.testing.assert_array_equal(recording.read(1), levels[1])
    np.testing.assert_array_equal(recording.read(1, (2, 1, 5, 3)), levels[1, 1:, 2:])


def test_stamps_win_over_the_rate_of_the_header(tmp_path: Path) -> None:
    start = 20.25
    data = cine(EIGHT, times=[start, start + 1e-5, start + 2e-5], rate=65535, rate16=65535)
    recording = opened(tmp_path, data)
    assert recording.info.fps == pytest.approx(1e5, rel=1e-4)
    assert recording.info.fps_source == "cine time stamps"
    assert "65535 fps" in recording.info.notes[0]
    np.testing.assert_allclose(recording.times_s(), [0, 1e-5, 2e-5], atol=2e-9)


def test_a_gap_in_the_stamps_does_not_bend_the_rate(tmp_path: Path) -> None:
    recording = opened(tmp_path, cine(EIGHT * 2, times=[0, 0.001, 0.002, 0.009, 0.010, 0.011]))
    assert recording.info.fps == pytest.approx(1000, rel=1e-5)
    assert recording.info.notes == ("1 intervals between frames differ from the usual one",)
    assert recording.times_s()[3] == pytest.approx(0.009, abs=1e-8)


@pytest.mark.parametrize("times", [None, [5.0, 5.0, 5.0], [3.0, 2.0, 1.0]])
def test_without_usable_stamps_the_header_serves(tmp_path: Path, times: list[float] | None) -> None:
    info = opened(tmp_path, cine(EIGHT, times=times, rate=70000, rate16=65535)).info
    assert (info.fps, info.fps_source) == (70000.0, "cine header frame rate")
    assert opened(tmp_path, cine(EIGHT, rate=0, rate16=0)).info.fps is None


def test_a_short_setup_of_an_old_camera(tmp_path: Path) -> None:
    info = opened(tmp_path, cine(EIGHT, setup_length=160, rate16=1200)).info
    assert info.fps == 1200.0
    assert info.exposure_s is None


def test_exposure_from_block_or_header(tmp_path: Path) -> None:
    assert opened(tmp_path, cine(EIGHT, exposures=[2e-5] * 3)).info.exposure_s == pytest.approx(2e-5, rel=1e-4)
    assert opened(tmp_path, cine(EIGHT, shutter_ns=1500)).info.exposure_s == pytest.approx(1.5e-6)
    assert opened(tmp_path, cine(EIGHT, shutter_ns=0, shutter=30)).info.exposure_s == pytest.approx(3e-5)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"mark": b"XX"}, "does not begin as a cine"),
        ({"compression": 1}, "JPEG-compressed"),
        ({"compression": 2}, "raw colour (Bayer)"),
        ({"compression": 77}, "unknown compression 77"),
        ({"bits": 24}, "a colour cine (24 bit)"),
        ({"bits": 48}, "a colour cine (48 bit)"),
        ({"bits": 12}, "12 bit with compression 0"),
        ({"packing": 3}, "compression 3"),
        ({"width": 0}, "0 x 2 pixels"),
        ({"width": -4}, "-4 x 2 pixels"),
        ({"width": 2**31 - 1}, "pixels; the header is damaged"),
        ({"height": 0}, "4 x 0 pixels"),
        ({"size": 9}, "claims 9 bytes"),
        ({"width": 400, "height": 200, "size": 0}, "hold 0 of the 3 images"),
        ({"count": 0}, "claims 0 images"),
        ({"count": 2**32 - 1}, "claims 4294967295 images"),
        ({"shift_offsets": 10**9}, "hold 0 of the 3 images"),
        ({"shift_offsets": -(10**9)}, "hold 0 of the 3 images"),
    ],
)
def test_a_header_that_cannot_be_read(tmp_path: Path, changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        opened(tmp_path, cine(EIGHT, **changes))
    assert sentence in str(caught.value)


def test_a_truncated_cine_says_what_is_whole_and_how_to_use_it(tmp_path: Path) -> None:
    data = cine(EIGHT, times=[0, 0.5, 1.0])[:-3]
    with pytest.raises(InputError, match=r"hold 2 of the 3 images .* `frames: \[0, 1\]`"):
        opened(tmp_path, data)
    recording = opened(tmp_path, data, frames=(0, 1))
    np.testing.assert_array_equal(recording.read(1), LEVELS[1])
    assert recording.info.frame_count == 2
    assert recording.camera_frames().tolist() == [-2, -1]
    assert recording.times_s().tolist() == pytest.approx([0, 0.5], abs=1e-8)
    assert "cut off after 2 images" in recording.info.notes


def test_one_damaged_image_is_one_bad_frame(tmp_path: Path) -> None:
    data = bytearray(cine(EIGHT))
    at_images = len(data) - 3 * 16
    data[at_images + 16 : at_images + 20] = b"\xff\xff\xff\x7f"  # the annotation of image 1
    recording = opened(tmp_path, bytes(data))
    with pytest.raises(FrameUnreadableError, match="image 1 is damaged"):
        recording.read(1)
    np.testing.assert_array_equal(recording.read(2), LEVELS[2])
    recording = opened(tmp_path, cine(EIGHT, image_size=5))
    with pytest.raises(FrameUnreadableError, match="claims 5 bytes"):
        recording.read(0)


@pytest.mark.skipif(not SHARED.exists(), reason=f"real recordings absent: {SHARED}")
@pytest.mark.parametrize(
    ("name", "depth", "fps", "first", "exposure_s"),
    [
        ("phantom_v1610", 8, 100.0, -85, 3e-3),
        ("phantom_v611_raw_16bpp", 12, 2000.0, 151325, 1e-4),
        ("packed_12bpp", 12, 100.0, 60, 99e-6),
    ],
)
def test_real_cines_against_their_decoded_frames(
    name: str, depth: int, fps: float, first: int, exposure_s: float
) -> None:
    recording = open_recording(SHARED / "phantom" / f"{name}.cine")
    assert (recording.info.frame_count, recording.info.bit_depth) == (6, depth)
    assert recording.info.fps == pytest.approx(fps, rel=1e-6)
    assert recording.info.exposure_s == pytest.approx(exposure_s, rel=1e-3)
    assert recording.camera_frames().tolist() == list(range(first, first + 6))
    for index in (0, 5):
        raw = (SHARED / "phantom" / f"{name}_{index}.rawi").read_bytes()
        width, height, _ = np.frombuffer(raw[:12], "<u4")
        reference = np.frombuffer(raw[12:], "<f4").reshape(height, width)
        scale = 1.0 if depth == 8 else 255.0 / 4095.0
        frame = recording.read(index)
        assert np.abs(frame * scale - reference).max() < 1.5e-5
        np.testing.assert_array_equal(recording.read(index, (3, 5, 78, 91)), frame[5:91, 3:78])
