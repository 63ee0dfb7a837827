"""``wentry render`` on disks that are full and folders that are taken."""

from __future__ import annotations

import errno
from collections.abc import Iterable
from pathlib import Path

import pytest
import yaml

from tests.cli.conftest import SMALL, Command
from wentry_cli import compiled
from wentry_cli.runner.lock import locked
from wentry_cli.synthetic.frame_writers import ImageWriter


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    path = tmp_path / "scenes.yaml"
    short = SMALL | {"clip": {"before_s": 0.004, "longest_s": 0.006}}
    path.write_text(yaml.safe_dump({"drops": [short]}))
    return path


def test_a_campaign_is_drawn_and_counted(wentry: Command, scenes: Path, tmp_path: Path) -> None:
    done = wentry("render", scenes, "-o", tmp_path / "videos")
    assert done.code == 0, done.err
    assert wentry("render", scenes, "-o", tmp_path / "videos", "--drop", "smal").code == 4
    assert "1 of 1 drop drawn" in done.err
    assert (tmp_path / "videos" / "small" / "experiment.yaml").is_file()


def test_the_first_run_is_told(
    wentry: Command, scenes: Path, video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kernels of the rendering are no sign that those of the measurement are there."""
    needed: list[set[str]] = []

    def anew(rooms: Iterable[str]) -> bool:
        needed.append({*rooms})
        return True

    monkeypatch.setattr(compiled, "compiles_anew", anew)
    first = "first run: the numerics of this command are compiled now, once; this takes some minutes\n"
    assert wentry("render", scenes, "-o", tmp_path / "videos").err.startswith(first)
    told = wentry("process", video, "-o", tmp_path / "results", "--until", "track")
    assert told.err.startswith(first)
    wentry("fit", tmp_path / "results")
    assert needed == [{"synthetic"}, {"contours"}, set()]


def test_a_full_disk_is_one_sentence(
    wentry: Command, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(ImageWriter, "write", full)
    done = wentry("render", scenes, "-o", tmp_path / "videos")
    assert done.code == 4
    assert done.err.startswith(f"{tmp_path / 'videos' / 'small'}: cannot be written (No space left on device)")
    assert done.err.count("\n") == 1
    assert not (tmp_path / "videos" / "small" / "experiment.yaml").exists()  # no drop for `wentry process`


def test_two_do_not_draw_into_one_folder(wentry: Command, scenes: Path, tmp_path: Path) -> None:
    with locked(tmp_path / "videos"):
        assert wentry("render", scenes, "-o", tmp_path / "videos").code == 7


def test_nothing_is_left_of_a_wrong_scenes_file(wentry: Command, tmp_path: Path) -> None:
    (tmp_path / "scenes.yaml").write_text("drops: [{name: a, speeed: 3}]")
    assert wentry("render", tmp_path / "scenes.yaml", "-o", tmp_path / "videos").code == 3
    assert not (tmp_path / "videos").exists()
