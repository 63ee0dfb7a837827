"""Video containers: order of frames, colour, rotation metadata, containers that lie."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from wentry_cli.errors import FrameUnreadableError, InputError
from wentry_cli.frames.formats import open_recording

WIDTH, HEIGHT, COUNT = 64, 48, 20


def scene(index: int) -> np.ndarray:
    """A bright square that walks along the upper edge of a dark image; its place tells the frame."""
    image = np.full((HEIGHT, WIDTH), 30, np.uint8)
    image[4:12, 2 * index : 2 * index + 8] = 220
    return image


def write_video(path: Path, codec: str, colour: tuple[int, int, int] | None = None) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 25.0, (WIDTH, HEIGHT))
    if not writer.isOpened():
        pytest.skip(f"no encoder for {codec} here")
    for index in range(COUNT):
        grey = scene(index)
        writer.write(np.dstack([grey] * 3) if colour is None else np.full((HEIGHT, WIDTH, 3), colour, np.uint8))
    writer.release()
    return path


@pytest.fixture(scope="module")
def avi(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_video(tmp_path_factory.mktemp("video") / "clip.avi", "MJPG")


def place(frame: np.ndarray) -> int:
    """The frame number that the square tells."""
    return int(np.argmax(frame[8] > 120)) // 2


def test_frames_in_any_order(avi: Path) -> None:
    recording = open_recording(avi)
    assert (recording.info.frame_count, recording.info.width, recording.info.height) == (COUNT, WIDTH, HEIGHT)
    for index in [*range(COUNT), 19, 3, 4, 12, 2, 0, 19]:
        frame = recording.read(index)
        assert frame.dtype == np.uint8
        assert np.abs(frame.astype(int) - scene(index)).max() < 25
        assert place(frame) == index
    whole = recording.read(5)
    np.testing.assert_array_equal(recording.read(5, (3, 2, 40, 30)), whole[2:30, 3:40])
    recording.close()


def test_the_rate_is_one_of_playback(avi: Path) -> None:
    info = open_recording(avi).info
    assert (info.fps, info.fps_source) == (25.0, "container playback rate")
    assert not info.rate_trusted
    assert info.format == "video MJPG"


def test_a_given_rate_wins(avi: Path) -> None:
    info = open_recording(avi, fps=2000).info
    assert (info.fps, info.fps_source) == (2000.0, "given")
    assert info.rate_trusted


def test_colour_is_converted_and_said(tmp_path: Path) -> None:
    recording = open_recording(write_video(tmp_path / "clip.avi", "MJPG", (0, 0, 200)))
    assert recording.info.format == "video MJPG, colour, converted to grey"
    assert recording.read(0).mean() == pytest.approx(0.299 * 200, abs=4)


def test_reading_in_sequence_decodes_each_frame_once(avi: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = open_recording(avi)
    opened = []
    monkeypatch.setattr("wentry_cli.frames.video._Stream", opened.append)
    for index in range(COUNT):
        recording.read(index)
        recording.read(index, (0, 0, 4, 4))
        recording.read(max(0, index - 3))
    assert opened == []


@pytest.mark.parametrize("degrees", [90, 180])
def test_rotation_metadata_is_honoured(tmp_path: Path, degrees: int) -> None:
    path = write_video(tmp_path / "clip.mp4", "mp4v")
    upright = open_recording(path).read(6)
    turn = {90: (0, 1, -1, 0), 180: (-1, 0, 0, -1)}[degrees]
    data = bytearray(path.read_bytes())
    matrix = data.index(b"tkhd") + 4 + 4 + 20 + 16  # version and flags, times, layer and volume
    for number, value in zip((0, 4, 12, 16), turn, strict=True):
        struct.pack_into(">i", data, matrix + number, value << 16)
    path.write_bytes(data)
    recording = open_recording(path)
    size = (WIDTH, HEIGHT) if degrees == 180 else (HEIGHT, WIDTH)
    assert (recording.info.width, recording.info.height) == size
    turned = recording.read(6).astype(int)
    assert np.abs(turned - np.rot90(upright, -degrees // 90)).max() <= 2


def test_a_truncated_video_has_bad_frames_behind_the_cut(avi: Path, tmp_path: Path) -> None:
    data = avi.read_bytes()
    marks = [place for place in range(data.index(b"movi"), len(data)) if data.startswith(b"00dc", place)]
    path = tmp_path / "cut.avi"
    path.write_bytes(data[: marks[11] + 30])  # in the midst of frame 11
    recording = open_recording(path)
    assert recording.info.frame_count == COUNT
    assert recording.info.notes == (f"the container claims {COUNT} frames, 11 can be read",)
    assert place(recording.read(10)) == 10
    with pytest.raises(FrameUnreadableError, match=r"cut\.avi: frame 15"):
        recording.read(15)


@pytest.mark.parametrize("data", [b"", b"no video", b"RIFF\xff\xff\xff\xffAVI LIST" + bytes(200)])
def test_no_video_at_all(tmp_path: Path, data: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "clip.avi"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"clip\.avi"):
        open_recording(path)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(("name", "codec"), [("clip.avi", b"MJPG"), ("clip.mp4", b"mp4v")])
def test_a_codec_that_nobody_knows_is_named(tmp_path: Path, name: str, codec: bytes) -> None:
    path = write_video(tmp_path / name, codec.decode())
    content = path.read_bytes().replace(codec, b"ZZZ9")
    path.write_bytes(content.replace(b"esds", b"zzzz"))  # in an MP4 this box names the codec too
    with pytest.raises(InputError, match=r"clip\....: no codec here reads this video of codec ZZZ9; .* convert it"):
        open_recording(path)


def test_what_is_no_video_names_no_codec(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    path.write_bytes(b"no video at all" * 100)
    with pytest.raises(InputError, match=r"clip\.avi: no codec here reads this video; copy it again"):
        open_recording(path)
