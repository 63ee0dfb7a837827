"""`wentry info` on a recording, a drop, a campaign and a folder of recordings."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.cli.test_damaged_recordings import _photron
from tests.frames.recording_bytes import png
from wentry_cli.frames.listing import recordings_in


def _told(wentry: Command, path: Path) -> list[dict[str, object]]:
    done = wentry("info", path, "--json")
    assert (done.code, done.err) == (0, "")
    found: list[dict[str, object]] = json.loads(done.out)
    return found


def _write(folder: Path, *names: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_bytes(png(np.zeros((8, 8), np.uint8), 8) if name.endswith("png") else b"")


def test_a_drop_shows_its_views_with_the_rate_that_is_given(wentry: Command, video: Path) -> None:
    (one,) = _told(wentry, video)
    assert (one["drop"], one["view"], one["path"]) == ("small", "side", str(video / "side"))
    assert (one["fps"], one["fps_source"], one["fps_trusted"]) == (1000.0, "given", True)
    assert (one["exposure_s"], one["exposure_source"]) == (1e-4, "given")
    shown = wentry("info", video).out
    assert "duplicate_frames:      –  (frames that equal the one before; --duplicates counts them)" in shown
    assert "duplicate_frames:      0\n" in wentry("info", video, "--duplicates").out
    assert shown.startswith("drop:                  small\nview:                  side\n")


def test_a_campaign_shows_each_drop_and_tells_what_is_missing(wentry: Command, video: Path) -> None:
    shutil.copytree(video, video.parent / "other")
    assert [one["drop"] for one in _told(wentry, video.parent)] == ["other", "small"]
    shutil.rmtree(video.parent / "other" / "side")
    done = wentry("info", video.parent)
    assert done.code == 4
    assert "drop:                  small" in done.out
    assert f"{video.parent / 'other' / 'side'}: no such file or folder" in done.err
    (video.parent / "other" / "experiment.yaml").write_text("kind: water_entery\n")
    done = wentry("info", video.parent)
    assert done.code == 3
    assert "drop:                  small" in done.out
    assert "experiment.yaml:1:1: error: kind: must be one of" in done.err


def test_a_drop_that_is_not_filled_in_shows_what_lies_there(wentry: Command, video: Path) -> None:
    (video / "experiment.yaml").unlink()
    assert wentry("init", video).code == 0
    _write(video / "still", "a_1.png")
    done = wentry("info", video)
    assert done.code == 3
    assert f"\n\npath:                  {video / 'still'}\n" in done.out  # that of nobody, as far as is known
    assert "sphere.diameter_m: is left empty; fill it in" in done.err
    assert done.out.startswith(
        f"drop:                  small\nview:                  side\npath:                  {video / 'side'}\n"
    )


def test_a_folder_of_recordings_shows_each(wentry: Command, video: Path) -> None:
    """Without any configuration; header and raw data are one recording."""
    header = _photron(video)
    store = video.parent.parent / "store"
    _write(store / "day" / "images", "img_1.png", "img_2.png")
    shutil.copytree(video / "side", store / "a")
    for path in (header, header.with_suffix(".mraw")):
        shutil.copy(path, store)
    told = {str(one["path"]): one["frame_count"] for one in _told(wentry, store)}
    count = len(list((video / "side").iterdir()))
    assert told == {str(store / "a"): count, str(store / header.name): count, str(store / "day" / "images"): 2}


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (("a_1.png", "a_2.png"), ["."]),
        (("a_1.png", "clip.cihx"), ["."]),
        (("a.png", "clip.cih", "clip.mraw"), [".", "clip.cih"]),
        (("clip.cihx", "clip.cih", "clip.mraw"), ["clip.cihx"]),
        (("clip.mraw", "b.mp4", "c.cine", "notes.txt", ".hidden.avi"), ["b.mp4", "c.cine", "clip.mraw"]),
        (("notes.txt",), []),
    ],
)
def test_recordings_by_their_files(tmp_path: Path, names: tuple[str, ...], found: list[str]) -> None:
    _write(tmp_path, *names)
    _write(tmp_path / ".cache", "a.avi")
    assert recordings_in(tmp_path) == [tmp_path / name for name in found]


def test_a_folder_without_recordings_is_told(wentry: Command, tmp_path: Path) -> None:
    done = wentry("info", tmp_path)
    assert done.code == 4
    assert f"{tmp_path}: no image here" in done.err


@pytest.mark.parametrize(
    ("names", "left", "parts"),
    [
        (("cam1/a_1.png", "overhead.tif"), ["overhead.tif"], "the sphere, its material and fps"),
        (("a.cihx", "a.cih", "b.cihx"), ["b.cihx"], "the sphere and its material"),
        (("side.cine", "top.cine"), [], "the sphere and its material"),
    ],
)
def test_init_says_what_it_could_not_name(
    wentry: Command, tmp_path: Path, names: tuple[str, ...], left: list[str], parts: str
) -> None:
    for name in names:
        _write((tmp_path / "drop" / name).parent, Path(name).name)
    *told, closing = wentry("init", tmp_path / "drop").err.splitlines()
    assert [line.split(":")[0] for line in told] == [str(tmp_path / "drop" / name) for name in left]
    assert f"fill in {parts}, then" in closing


def test_init_says_that_the_images_are_beside_it(wentry: Command, tmp_path: Path) -> None:
    for number in range(3):
        _write(tmp_path / "drop", f"a_{number}.png")
    told = wentry("init", tmp_path / "drop").err
    assert told.startswith(f"{tmp_path / 'drop'}: its own images are the side view, source: .\n")
