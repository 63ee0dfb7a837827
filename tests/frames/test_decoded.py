"""Frames are decoded once a run, whatever part of them is asked for, and nothing is left behind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames import decoded, image_folder
from wentry_cli.frames import video as video_module
from wentry_cli.frames.decoded import decoded_once, found_once
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.reader import StoresRows

COUNT, SHAPE = 5, (24, 36)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "side"
    path.mkdir()
    for index in range(COUNT):
        assert cv2.imwrite(str(path / f"{index:03d}.png"), picture(index))
    return path


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the images that were decoded."""
    names: list[str] = []
    plain = image_folder.decode_grey

    def counted(data: bytes, name: str) -> Any:
        names.append(Path(name).name)
        return plain(data, name)

    monkeypatch.setattr(image_folder, "decode_grey", counted)
    return names


def picture(index: int) -> np.ndarray:
    return np.random.default_rng(index).integers(0, 256, SHAPE).astype(np.uint8)


def read_all(folder: Path) -> None:
    """Read whole frames, a region, and whole frames again, each from a recording opened anew."""
    for region in (None, (3, 5, 20, 9), None, (0, 2, 36, 3)):
        recording = open_recording(folder)
        for index in range(COUNT):
            x0, y0, x1, y1 = region or (0, 0, SHAPE[1], SHAPE[0])
            np.testing.assert_array_equal(recording.read(index, region), picture(index)[y0:y1, x0:x1])
        recording.close()


def test_each_image_is_decoded_once(folder: Path, calls: list[str], tmp_path: Path) -> None:
    with decoded_once(tmp_path / "results"):
        read_all(folder)
        assert sorted(calls) == sorted(path.name for path in folder.iterdir())
    assert list((tmp_path / "results").iterdir()) == []


def test_outside_of_a_run_images_are_decoded_again(folder: Path, calls: list[str]) -> None:
    read_all(folder)
    assert len(calls) == 4 * COUNT


def test_what_a_caller_does_to_a_frame_is_not_seen_by_the_next(folder: Path, tmp_path: Path) -> None:
    with decoded_once(tmp_path):
        for _ in range(3):
            frame = open_recording(folder).read(1)
            np.testing.assert_array_equal(frame, picture(1))
            frame[:] = 0


def test_rows_of_a_decoded_frame_come_from_the_file_and_those_not_wanted_are_not_read(
    folder: Path, calls: list[str], tmp_path: Path
) -> None:
    with decoded_once(tmp_path):
        recording = open_recording(folder)
        assert isinstance(recording, StoresRows)
        assert recording.stored_rows(1, (4, 20), (20, 20)) is None  # it has not been decoded yet
        recording.read(1)
        found = recording.stored_rows(1, (4, 20), (9, 15))
        assert found is not None
        levels, first, packed = found
        kept = np.r_[0:5, 11:16]
        np.testing.assert_array_equal(levels[kept], picture(1)[4 + kept])
        assert levels.shape == (16, SHAPE[1])
        assert (first, packed) == (0, False)
    assert calls == ["001.png"]


def test_without_room_frames_are_decoded_again(
    folder: Path, calls: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decoded, "MOST_BYTES", 2 * SHAPE[0] * SHAPE[1] + 7)
    with decoded_once(tmp_path / "results"):
        read_all(folder)
    assert calls.count("000.png") == calls.count("001.png") == 1
    assert calls.count("002.png") == 4


def test_a_folder_that_cannot_be_written_costs_time_alone(folder: Path, calls: list[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with decoded_once(tmp_path / "file"):
        read_all(folder)
    assert len(calls) == 4 * COUNT


def test_a_damaged_image_stays_one(folder: Path, tmp_path: Path) -> None:
    image = folder / "002.png"
    image.write_bytes(image.read_bytes()[:-40])
    with decoded_once(tmp_path):
        for _ in range(2):
            with pytest.raises(FrameUnreadableError):
                open_recording(folder).read(2)
            np.testing.assert_array_equal(open_recording(folder).read(3), picture(3))


@pytest.fixture
def video(tmp_path: Path) -> Path:
    path = tmp_path / "side.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (64, 48))
    for index in range(COUNT):
        writer.write(np.full((48, 64, 3), 40 * index + 20, np.uint8))
    writer.release()
    return path


@pytest.fixture
def grabbed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Places of the frames of videos that were gone to."""
    places: list[int] = []
    plain = video_module._Stream.grab

    def counted(stream: Any) -> int | None:
        place = plain(stream)
        places.append(-1 if place is None else place)
        return place

    monkeypatch.setattr(video_module._Stream, "grab", counted)
    return places


def test_a_video_is_gone_through_once_whatever_the_order(video: Path, grabbed: list[int], tmp_path: Path) -> None:
    with decoded_once(tmp_path / "results"):
        recording = open_recording(video)
        for index in (3, 1, 4, 0, 2):
            assert abs(int(recording.read(index)[24, 32]) - (40 * index + 20)) < 3
    assert grabbed == list(range(COUNT))


def test_a_video_for_whose_frames_there_is_no_room_is_read_all_the_same(
    video: Path, grabbed: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decoded, "MOST_BYTES", 64 * 48 * 2)
    with decoded_once(tmp_path / "results"):
        recording = open_recording(video)
        for index in (3, 4, 3, 4):
            assert abs(int(recording.read(index)[24, 32]) - (40 * index + 20)) < 3
    assert len(grabbed) <= 2 * COUNT


def test_what_is_found_is_found_once_a_run(tmp_path: Path) -> None:
    found: list[int] = []
    for _ in range(2):
        with decoded_once(tmp_path):
            for key in ("a", "b", "a"):
                found_once(key, lambda: found.append(0))
    assert len(found) == 4
    found_once("a", lambda: found.append(0))
    assert len(found) == 5
