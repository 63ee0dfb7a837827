"""Folders of images written byte by byte, and what users put into such folders."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from recording_bytes import bmp, cih, cihx, grey, png, tiff

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.image_headers import read_image_header

LEVELS = grey(7, 5, frames=4)


def write_pngs(folder: Path, levels: np.ndarray = LEVELS, bits: int = 8, first: int = 0) -> None:
    for number, frame in enumerate(levels, first):
        (folder / f"f{number}.png").write_bytes(png(frame, bits))


def encoded(levels: np.ndarray, suffix: str, *options: int) -> bytes:
    ok, data = cv2.imencode(suffix, levels, options)
    assert ok
    return data.tobytes()


def test_png_of_eight_bit(tmp_path: Path) -> None:
    write_pngs(tmp_path, first=8)
    recording = open_recording(tmp_path)
    assert (recording.info.width, recording.info.height, recording.info.frame_count) == (7, 5, 4)
    assert recording.info.format == "PNG images, 8 bit"
    assert (recording.info.fps, recording.info.fps_source) == (None, "unknown")
    assert recording.camera_frames().tolist() == [8, 9, 10, 11]
    for index in range(4):
        frame = recording.read(index)
        assert frame.dtype == np.uint8
        np.testing.assert_array_equal(frame, LEVELS[index])
        np.testing.assert_array_equal(recording.read(index, (2, 1, 6, 5)), LEVELS[index, 1:5, 2:6])


def test_frames_belong_to_the_caller(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    recording = open_recording(tmp_path)
    recording.read(0)[:] = 0
    np.testing.assert_array_equal(recording.read(0), LEVELS[0])


@pytest.mark.parametrize(("stored", "top", "depth"), [(1, 4095, 12), (1, 3000, 12), (1, 16383, 14), (16, 4095, 12)])
def test_sixteen_bit_files_of_a_camera_with_fewer(tmp_path: Path, stored: int, top: int, depth: int) -> None:
    levels = grey(7, 5, top, frames=3)
    write_pngs(tmp_path, levels * stored, 16)
    (tmp_path / "f1.png").unlink()
    recording = open_recording(tmp_path)
    assert recording.info.format == "PNG images, 16 bit"
    assert recording.info.bit_depth == depth
    assert recording.info.notes[0].startswith("16-bit files")
    frame = recording.read(2)
    assert frame.dtype == np.uint16
    np.testing.assert_array_equal(frame, levels[2])
    np.testing.assert_array_equal(recording.read(2, (1, 1, 3, 3)), levels[2, 1:3, 1:3])


def test_sixteen_bit_files_that_use_all_bits(tmp_path: Path) -> None:
    levels = grey(7, 5, 65535, frames=2)
    write_pngs(tmp_path, levels, 16)
    recording = open_recording(tmp_path)
    assert recording.info.bit_depth == 16
    np.testing.assert_array_equal(recording.read(1), levels[1])


def test_a_small_file_that_claims_a_gigabyte(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    data = bytearray(png(LEVELS[0], 8))
    data[16:24] = (32768).to_bytes(4, "big") * 2
    (tmp_path / "f1.png").write_bytes(data)
    recording = open_recording(tmp_path)
    with pytest.raises(FrameUnreadableError, match="which no compression brings into"):
        recording.read(1)


def test_the_camera_header_beside_the_images_tells_rate_and_exposure(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "clip.cihx").write_bytes(cihx(width=7, height=5, format="Png", rate=10000, step=4, bits=24))
    info = open_recording(tmp_path).info
    assert (info.fps, info.fps_source) == (2500.0, "cihx recordRate / skipFrame")
    assert info.exposure_s == pytest.approx(1e-4)
    (tmp_path / "other.cih").write_text(cih())
    info = open_recording(tmp_path).info
    assert (info.fps, info.notes) == (
        None,
        ("several headers (clip.cihx, other.cih) lie beside the images: none is used",),
    )


@pytest.mark.parametrize(
    ("header", "note"), [(cihx(), "clip.cihx describes 6 x 4 pixels: not used"), (b"<cih>", "not used: ")]
)
def test_a_camera_header_of_something_else_is_not_used(tmp_path: Path, header: bytes, note: str) -> None:
    write_pngs(tmp_path)
    (tmp_path / "clip.cihx").write_bytes(header)
    info = open_recording(tmp_path).info
    assert info.fps is None
    assert info.notes[0].startswith(note)


def test_a_flipped_byte_is_found_without_noise(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_pngs(tmp_path)
    data = bytearray((tmp_path / "f1.png").read_bytes())
    data[len(data) - 30] ^= 4
    (tmp_path / "f1.png").write_bytes(data)
    with pytest.raises(FrameUnreadableError, match=r"f1\.png: the image is cut off or damaged"):
        open_recording(tmp_path).read(1)
    assert capfd.readouterr().err == ""


def test_the_end_of_a_thumbnail_is_not_the_end_of_the_image(tmp_path: Path) -> None:
    data = encoded(np.add.outer(np.arange(40), np.arange(60)).astype(np.uint8), ".jpg")
    comment = b"\xff\xfe" + (2 + 8).to_bytes(2, "big") + b"\xff\xd8..\xff\xd9.."
    whole = data[:2] + comment + data[2:]
    (tmp_path / "f1.jpg").write_bytes(whole)
    assert open_recording(tmp_path).read(0).shape == (40, 60)
    (tmp_path / "f1.jpg").write_bytes(whole[:-20])
    with pytest.raises(FrameUnreadableError):
        open_recording(tmp_path).read(0)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("bits", [8, 16])
def test_tiff(tmp_path: Path, order: str, bits: int) -> None:
    levels = grey(7, 5, 2**bits - 1, frames=2)
    for number, frame in enumerate(levels):
        (tmp_path / f"f{number}.tif").write_bytes(tiff([frame], bits, order))
    recording = open_recording(tmp_path)
    assert recording.info.format == f"TIFF images, {bits} bit"
    np.testing.assert_array_equal(recording.read(1), levels[1])


def test_bmp(tmp_path: Path) -> None:
    for number, frame in enumerate(LEVELS):
        (tmp_path / f"f{number}.bmp").write_bytes(bmp(frame))
    recording = open_recording(tmp_path)
    assert recording.info.format == "BMP images, 8 bit"
    np.testing.assert_array_equal(recording.read(3), LEVELS[3])


def test_jpeg(tmp_path: Path) -> None:
    smooth = np.add.outer(np.arange(40), np.arange(60)).astype(np.uint8)
    (tmp_path / "f1.jpg").write_bytes(encoded(smooth, ".jpg", cv2.IMWRITE_JPEG_QUALITY, 100))
    recording = open_recording(tmp_path)
    assert recording.info.format == "JPEG images, 8 bit"
    assert np.abs(recording.read(0).astype(int) - smooth).max() <= 2


@pytest.mark.parametrize("bits", [8, 16])
def test_grey_stored_as_colour_is_exact(tmp_path: Path, bits: int) -> None:
    levels = grey(7, 5, 2**bits - 1)[0].astype(np.uint8 if bits == 8 else np.uint16)
    (tmp_path / "f1.png").write_bytes(encoded(np.dstack([levels] * 3), ".png"))
    recording = open_recording(tmp_path)
    assert recording.info.format == f"PNG images, {bits} bit, colour, converted to grey"
    np.testing.assert_array_equal(recording.read(0), levels)


def test_colour_becomes_luminance(tmp_path: Path) -> None:
    image = np.zeros((5, 7, 3), np.uint8)
    image[..., 2] = 200  # red
    (tmp_path / "f1.png").write_bytes(encoded(image, ".png"))
    assert open_recording(tmp_path).read(0) == pytest.approx(np.full((5, 7), 60), abs=1)


def test_a_gap_is_a_frame_that_says_so(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f2.png").unlink()
    recording = open_recording(tmp_path)
    assert (recording.info.frame_count, recording.info.gaps) == (4, 1)
    with pytest.raises(FrameUnreadableError, match="no image with the number 2") as caught:
        recording.read(2)
    assert caught.value.status == "gap"
    np.testing.assert_array_equal(recording.read(3), LEVELS[3])


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".tif"])
@pytest.mark.parametrize("kept", [0.0, 0.01, 0.3, 0.9])
def test_one_truncated_image_is_one_bad_frame(tmp_path: Path, suffix: str, kept: float) -> None:
    levels = grey(40, 30, frames=3).astype(np.uint8)
    for number, frame in enumerate(levels):
        (tmp_path / f"f{number}{suffix}").write_bytes(encoded(frame, suffix))
    odd = tmp_path / f"f1{suffix}"
    data = odd.read_bytes()
    odd.write_bytes(data[: int(kept * len(data))])
    recording = open_recording(tmp_path)
    assert recording.info.frame_count == 3
    with pytest.raises(FrameUnreadableError) as caught:
        recording.read(1)
    assert caught.value.status == "bad_frame"
    assert "f1" in str(caught.value)
    assert recording.read(2).shape == (30, 40)


def test_a_file_of_something_else_is_a_bad_frame(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f1.png").write_text("no image at all, but a text of some length, longer than any header")
    recording = open_recording(tmp_path)
    with pytest.raises(FrameUnreadableError, match="no PNG, TIFF, JPEG or BMP image"):
        recording.read(1)


@pytest.mark.parametrize("target", ["f1.png", "gone.png"])
def test_a_link_that_leads_nowhere_is_a_bad_frame(tmp_path: Path, target: str) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f1.png").unlink()
    try:
        (tmp_path / "f1.png").symlink_to(target)
    except OSError:
        pytest.skip("links need rights that this system does not give")
    recording = open_recording(tmp_path)
    with pytest.raises(FrameUnreadableError, match=r"f1\.png: cannot be opened"):
        recording.read(1)


def test_a_file_that_goes_away_is_a_bad_frame(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    recording = open_recording(tmp_path)
    (tmp_path / "f1.png").unlink()
    with pytest.raises(FrameUnreadableError, match=r"f1\.png: cannot be opened"):
        recording.read(1)


def test_frames_of_different_sizes(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f2.png").write_bytes(png(grey(6, 5)[0], 8))
    with pytest.raises(InputError, match=r"f2\.png: 6 x 5 pixels of 8 bit, but 3 of the 4 images"):
        open_recording(tmp_path)
    (tmp_path / "f2.png").write_bytes(png(grey(7, 5)[0], 16))
    with pytest.raises(InputError, match=r"f2\.png: 7 x 5 pixels of 16 bit"):
        open_recording(tmp_path)


def test_the_first_file_can_be_the_odd_one(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f0.png").write_bytes(png(grey(6, 5)[0], 8))
    with pytest.raises(InputError, match=r"f0\.png: 6 x 5"):
        open_recording(tmp_path)


def test_an_empty_folder_and_one_with_a_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no image here"):
        open_recording(tmp_path)
    (tmp_path / ".hidden1.png").write_bytes(png(LEVELS[0], 8))
    (tmp_path / "notes.txt").write_text("x")
    (tmp_path / "f1.png").mkdir()
    with pytest.raises(InputError, match="no image here"):
        open_recording(tmp_path)
    (tmp_path / "ball.cihx").write_text("x")
    with pytest.raises(InputError, match=r"'ball\.cihx': give that file as the source"):
        open_recording(tmp_path)


def test_nothing_readable_at_all(tmp_path: Path) -> None:
    for number in range(3):
        (tmp_path / f"f{number}.png").write_bytes(b"")
    with pytest.raises(InputError, match=r"not one of the images can be read: .*f0\.png: empty file"):
        open_recording(tmp_path)


def test_two_series_are_told_apart_by_a_pattern(tmp_path: Path) -> None:
    for number, frame in enumerate(LEVELS):
        (tmp_path / f"top_{number}.png").write_bytes(png(frame, 8))
    (tmp_path / "side_1.png").write_bytes(png(grey(6, 5)[0], 8))
    with pytest.raises(InputError, match="which one"):
        open_recording(tmp_path)
    np.testing.assert_array_equal(open_recording(tmp_path / "top_*.png").read(3), LEVELS[3])
    with pytest.raises(InputError, match=r"no image matches 'bottom_\*'"):
        open_recording(tmp_path / "bottom_*")


def test_duplicates_are_counted(tmp_path: Path) -> None:
    write_pngs(tmp_path)
    (tmp_path / "f02.png").write_bytes(png(LEVELS[0], 8))
    info = open_recording(tmp_path).info
    assert (info.frame_count, info.duplicates) == (4, 1)


def test_a_tiff_of_several_pages_is_no_still(tmp_path: Path) -> None:
    (tmp_path / "f1.tif").write_bytes(tiff(list(LEVELS), 8))
    with pytest.raises(InputError, match="a TIFF of several pages; give that file"):
        open_recording(tmp_path)


def test_unsupported_depth(tmp_path: Path) -> None:
    (tmp_path / "f1.tif").write_bytes(encoded(np.zeros((5, 7), np.float32), ".tif"))
    with pytest.raises(InputError, match="32 bit are not supported"):
        open_recording(tmp_path)


@pytest.mark.parametrize("place", [16, 20])
def test_an_absurd_size_is_refused_before_decoding(tmp_path: Path, place: int) -> None:
    data = bytearray(png(LEVELS[0], 8))
    data[place : place + 4] = b"\x7f\xff\xff\xff"
    (tmp_path / "f1.png").write_bytes(data)
    with pytest.raises(FrameUnreadableError, match="the header is damaged"):
        read_image_header(tmp_path / "f1.png")
    with pytest.raises(InputError, match="not one of the images"):
        open_recording(tmp_path)
