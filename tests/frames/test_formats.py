"""Which source is opened how, the rate that a user gives, identity and description."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from recording_bytes import cih, cihx, cine, grey, png, write_photron

from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.frames.description import count_duplicate_frames, describe
from wentry_cli.frames.formats import FORMATS, open_recording
from wentry_cli.frames.identity import recording_bytes, recording_content, recording_identity

LEVELS = grey(6, 4, frames=3).astype(np.uint8)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("side", "no such file or folder; did you mean 'sides'?"),
        ("nowhere/clip.cine", "nor its folder"),
        ("quite_another.avi", "no such file or folder; check"),
    ],
)
def test_a_missing_source(tmp_path: Path, name: str, sentence: str) -> None:
    (tmp_path / "sides").mkdir()
    with pytest.raises(InputError) as caught:
        open_recording(tmp_path / name)
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("clip.cin", "did you mean 'clip.cine'? supported:"),
        ("clip.chix", "are not read; rename it if it is a .cihx file; supported:"),
        ("README.md", "files of kind '.md' are not read; supported:"),
        ("clip.xyzzy", "files of kind '.xyzzy' are not read"),
        ("clip", "files without an ending are not read"),
        ("f1.png", "a single image; give its folder"),
    ],
)
def test_an_unknown_kind_names_what_is_read(tmp_path: Path, name: str, sentence: str) -> None:
    (tmp_path / name).write_bytes(b"x")
    (tmp_path / "clip.cine").write_bytes(b"x")
    with pytest.raises(InputError) as caught:
        open_recording(tmp_path / name)
    assert sentence in str(caught.value)
    if "single" not in sentence:
        assert all(suffix in str(caught.value) for suffix in FORMATS)


def test_a_given_rate_wins_over_stamps(tmp_path: Path) -> None:
    path = tmp_path / "clip.cine"
    path.write_bytes(cine([bytes(8)] * 3, times=[0, 0.001, 0.002]))
    recording = open_recording(path, fps=500.0)
    assert (recording.info.fps, recording.info.fps_source) == (500.0, "given")
    assert recording.times_s() is None
    assert recording.camera_frames().tolist() == [-2, -1, 0]
    assert recording.read(1, (0, 0, 2, 1)).shape == (1, 2)


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_an_impossible_rate(tmp_path: Path, fps: float) -> None:
    with pytest.raises(ConfigurationError, match="frame rate"):
        open_recording(write_photron(tmp_path, cih(), LEVELS.tobytes()), fps=fps)


def test_identity_follows_content_size_and_time(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(), LEVELS.tobytes())
    mraw = tmp_path / "clip.mraw"
    first = recording_identity(path)
    assert first == recording_identity(mraw)
    assert first.startswith("sampled:")
    full = recording_bytes(path)
    os.utime(mraw, ns=(1, 1))
    assert recording_identity(path) != first
    assert recording_bytes(path) == full
    again = recording_identity(path)
    changed = bytearray(LEVELS.tobytes())
    changed[30] ^= 1
    mraw.write_bytes(changed)
    os.utime(mraw, ns=(1, 1))
    assert recording_identity(path) != again
    assert recording_bytes(path) != full


def test_identity_of_a_folder_sees_every_file(tmp_path: Path) -> None:
    for number in range(5):
        (tmp_path / f"f{number}.png").write_bytes(png(LEVELS[0], 8))
    first = recording_identity(tmp_path)
    os.utime(tmp_path / "f1.png", ns=(7, 7))
    second = recording_identity(tmp_path)
    assert second != first
    (tmp_path / "notes.txt").write_text("no part of the recording")
    assert recording_identity(tmp_path) == second
    (tmp_path / "f3.png").unlink()
    assert recording_identity(tmp_path) != second


def test_the_content_of_a_recording_is_that_of_its_copy(tmp_path: Path) -> None:
    for number in range(5):
        (tmp_path / "a" / f"f{number}.png").parent.mkdir(exist_ok=True)
        (tmp_path / "a" / f"f{number}.png").write_bytes(png(LEVELS[0], 8))
    shutil.copytree(tmp_path / "a", tmp_path / "b", copy_function=shutil.copyfile)
    os.utime(tmp_path / "b" / "f1.png", ns=(7, 7))
    assert recording_identity(tmp_path / "a") != recording_identity(tmp_path / "b")
    assert recording_content(tmp_path / "a") == recording_content(tmp_path / "b")
    (tmp_path / "b" / "f1.png").write_bytes(png(LEVELS[1], 8))
    assert recording_content(tmp_path / "a") != recording_content(tmp_path / "b")
    with pytest.raises(InputError, match="cannot be read"):
        recording_content(tmp_path / "clip.avi")


@pytest.mark.skipif(sys.platform == "win32", reason="files with holes take room here")
def test_identity_reads_samples_of_a_large_file(tmp_path: Path) -> None:
    path = tmp_path / "clip.cine"
    path.touch()
    os.truncate(path, 1 << 33)  # 8 GB that take no room
    assert recording_identity(path).startswith("sampled:")


def test_identity_of_what_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        recording_identity(tmp_path / "clip.avi")


def test_a_description_is_json(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cihx(step=4, start=8), np.stack([LEVELS[0], LEVELS[0], LEVELS[1]]).tobytes())
    said = describe(path, count_duplicates=True)
    assert json.loads(json.dumps(said)) == said
    assert said["fps"] == 500.0
    assert said["fps_source"] == "cihx recordRate / skipFrame"
    assert said["duration_s"] == pytest.approx(2 / 500)
    assert (said["first_camera_frame"], said["last_camera_frame"]) == (8, 16)
    assert said["duplicate_frames"] == 1
    assert said["notes"] == ["one frame in 4 of the camera was saved"]
    assert said["bytes"] == 72 + path.stat().st_size


def test_a_gap_is_no_duplicate(tmp_path: Path) -> None:
    for number in (0, 2, 3):
        (tmp_path / f"f{number}.png").write_bytes(png(LEVELS[0], 8))
    assert count_duplicate_frames(open_recording(tmp_path)) == 2
    said = describe(tmp_path)
    assert (said["gaps"], said["duplicates"], said["duplicate_frames"]) == (1, 0, None)


def test_opening_a_recording_imports_only_what_it_needs(tmp_path: Path) -> None:
    path = write_photron(tmp_path, cih(), LEVELS.tobytes())
    code = (
        "import sys; from pathlib import Path; from wentry_cli.frames.formats import open_recording\n"
        "assert 'numba' not in sys.modules and 'cv2' not in sys.modules\n"
        f"open_recording(Path({str(path)!r})).read(0)\n"
        "assert 'cv2' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
