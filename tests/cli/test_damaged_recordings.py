"""Raw recordings that were cut off, or whose headers lie, through the command line: one sentence, no table left."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.frames.recording_bytes import cihx, cine, write_photron
from wentry_cli.tables import read_table

ENTITIES = """<!DOCTYPE cih [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>"""


def _images(video: Path) -> np.ndarray:
    return np.stack([cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((video / "side").iterdir())])


def _name(video: Path, source: str) -> None:
    path = video / "experiment.yaml"
    lines = [line for line in path.read_text().splitlines() if "fps" not in line]
    path.write_text("\n".join(lines).replace("source: side", f"source: {source}") + "\n")


def _photron(video: Path, **lies: object) -> Path:
    images = _images(video)
    count, height, width = images.shape
    said = {"width": width, "height": height, "frames": count, "rate": 1000} | lies
    header = write_photron(video, cihx(**said), images.tobytes())
    _name(video, header.name)
    return header


def _phantom(video: Path, **lies: object) -> Path:
    images = _images(video)
    said = {"width": images.shape[2], "height": -images.shape[1], "size": images[0].size, "rate": 1000} | lies
    path = video / "clip.cine"
    path.write_bytes(cine([image.tobytes() for image in images], **said))
    _name(video, path.name)
    return path


def test_check_finds_damaged_frames_where_it_is_asked_to_read_them(
    wentry: Command, video: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A damaged frame is a warning, as it is to `process`; only too few good ones are a failure."""
    images = sorted((video / "side").iterdir())
    images[40].write_bytes(images[40].read_bytes()[:-200])
    images[50].unlink()
    done = wentry("check", video)
    assert (done.code, caplog.text) == (0, "")
    assert (
        f"headers alone were read; wentry check {video} --frames reads every frame and names damaged ones" in done.err
    )
    done = wentry("check", video, "--set", "views.side.frames=[0, 10]")
    assert done.code == 5
    assert "small: the recording has 11 frames, analysis.min_frames asks for 12" in done.err
    done = wentry("check", video, "--frames")
    assert done.code == 0, done.err
    assert f"small: 1 of {len(images)} frames of the side view cannot be read: 40 ({images[40].name})" in caplog.text
    assert f"small: 1 of {len(images)} frames of the side view are missing: 50" in caplog.text
    assert "small: frames done" in done.err
    assert "headers alone" not in done.err
    told = json.loads(wentry("check", video, "--frames", "--json", "-q").out)
    assert told["damage"] == {"small": {"side": {"bad_frame": [40], "gap": [50]}}}
    for image in images[11:50]:
        image.write_bytes(image.read_bytes()[:-200])
    for image in images[51:]:
        image.write_bytes(image.read_bytes()[:-200])
    done = wentry("check", video, "--frames")
    assert done.code == 5
    assert "small: only 11 frames can be read, analysis.min_frames asks for 12" in done.err


def test_check_tells_what_a_recording_says_of_itself(
    wentry: Command, video: Path, caplog: pytest.LogCaptureFixture
) -> None:
    image = sorted((video / "side").iterdir())[3]
    image.with_name("side_3.png").write_bytes(image.read_bytes())
    assert wentry("check", video).code == 0
    assert "small: views.side.source: 'side_3.png' has the number of" in caplog.text


def _cut(path: Path, image_bytes: int) -> None:
    path.write_bytes(path.read_bytes()[: -40 * image_bytes - 7])


@pytest.mark.parametrize("camera", [_photron, _phantom])
def test_a_recording_that_was_cut_off_says_how_to_use_the_rest(
    wentry: Command, video: Path, tmp_path: Path, camera: object
) -> None:
    header = camera(video)  # type: ignore[operator]
    assert wentry("check", video).code == 0
    size = _images(video)[0].size
    last = len(_images(video)) - 42
    if camera is _photron:
        _cut(video / "clip.mraw", size)
    else:
        _cut(header, size + 8)  # each image has its own head
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 4
    assert "clip" in done.err
    assert f"frames: [0, {last}]" in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))
    done = wentry("process", video, "-o", tmp_path / "r", "--set", f"views.side.frames=[0, {last}]")
    assert done.code == 0, done.err
    assert (read_table(tmp_path / "r" / "small", "side")["status"] == "ok").sum() > 20


@pytest.mark.parametrize(
    "lies",
    [
        {"width": 10**6, "height": 10**6},
        {"frames": 10**9},
        {"bits": 12, "depth": 12, "frames": 2**31 - 1},
        {"width": 0},
        {"frames": -3},
        {"rate": 0},
    ],
)
def test_a_photron_header_that_lies(wentry: Command, video: Path, tmp_path: Path, lies: dict[str, object]) -> None:
    _photron(video, **lies)
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code in (3, 4)
    assert "clip" in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))


@pytest.mark.parametrize("lies", [{"width": 10**6, "height": 10**6}, {"count": 2**31 - 1}, {"shift_offsets": 10**9}])
def test_a_phantom_header_that_lies(wentry: Command, video: Path, tmp_path: Path, lies: dict[str, object]) -> None:
    _phantom(video, **lies)
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 4
    assert "clip.cine" in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))


def test_entities_in_a_header_are_not_expanded(wentry: Command, video: Path, tmp_path: Path) -> None:
    header = _photron(video)
    header.write_bytes(header.read_bytes().replace(b"<cih>", ENTITIES.encode() + b"<cih>", 1))
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 4
    assert "clip.cihx" in done.err
