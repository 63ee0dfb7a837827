"""``wentry render`` on disks that are full and folders that are taken."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterable
from pathlib import Path

import pytest
import yaml

from tests.cli.conftest import SMALL, Command
from wentry_cli import compiled
from wentry_cli.config.materials import packaged_config, read_materials
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
    """Of those that measure; kernels of the rendering are no sign that they are there."""
    needed: list[set[str]] = []

    def anew(rooms: Iterable[str]) -> bool:
        needed.append({*rooms})
        return True

    monkeypatch.setattr(compiled, "compiles_anew", anew)
    first = "first run: the numerics of this command are compiled now, once; this takes some minutes\n"
    drawn = wentry("render", scenes, "-o", tmp_path / "drawn")
    assert drawn.err.startswith("1 of 1 drop drawn"), "its kernels take seconds"
    told = wentry("process", video, "-o", tmp_path / "results", "--until", "track")
    assert told.err.startswith(first)
    wentry("fit", tmp_path / "results")
    assert needed == [{"contours"}, set()]


def test_a_full_disk_is_one_sentence(
    wentry: Command, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(ImageWriter, "write", full)
    done = wentry("render", scenes, "-o", tmp_path / "videos")
    assert done.code == 4
    (said,) = done.err.splitlines()
    assert said.startswith(f"{tmp_path / 'videos' / 'small'}: cannot be written (No space left on device)")
    assert not (tmp_path / "videos" / "small" / "experiment.yaml").exists()  # no drop for `wentry process`


LAW = {"g_inf_pa": 6700.0, "g_t_pa": 8000.0, "n": -0.19, "eps0_dot_1_s": 0.02}


def _soft(path: Path, drops: list[str], **materials: object) -> Path:
    """A scenes file of short films of spheres, each of the material of its name."""
    side = {**SMALL["side"], "width": 64, "height": 100, "scale_px_per_m": 250, "surface_y_px": 30.4}
    short = {"side": side, "impact_speed_m_s": 3.0, "clip": {"before_s": 0.006, "longest_s": 0.014}}
    given = [{"name": name, "sphere": {"diameter_m": 0.051, "material": name}, **short} for name in drops]
    path.write_text(json.dumps({"drops": given, "materials": materials or str(packaged_config("materials.yaml"))}))
    return path


def test_materials_of_a_scene_lie_beside_its_drops(wentry: Command, tmp_path: Path) -> None:
    videos = tmp_path / "videos"
    file = videos / "materials.yaml"
    done = wentry("render", _soft(tmp_path / "a.yaml", ["soft"], soft=LAW, spare=LAW), "-o", videos)
    assert done.code == 0, done.err
    assert wentry("check", videos).code == 0, "the material is found"
    assert read_materials(file)["soft"].g_t_pa == 8000.0
    assert not list(videos.glob("*.part"))
    before = file.read_bytes()
    assert wentry("render", tmp_path / "a.yaml", "-o", videos).code == 0
    assert file.read_bytes() == before
    known = _soft(tmp_path / "b.yaml", ["dragonskin_6p70_small"])
    assert wentry("render", known, "-o", videos).code == 0
    assert wentry("check", videos).code == 0, "drops of both scenes are there, and both materials"
    assert wentry("render", known, "-o", tmp_path / "others").code == 0
    assert not (tmp_path / "others" / "materials.yaml").exists(), "the packaged file has it"


def test_materials_that_no_rendering_wrote_are_left_alone(wentry: Command, tmp_path: Path) -> None:
    file = tmp_path / "videos" / "materials.yaml"
    file.parent.mkdir()
    file.write_text("materials: {}\n")
    done = wentry("render", _soft(tmp_path / "a.yaml", ["soft"], soft=LAW), "-o", tmp_path / "videos")
    assert done.code == 4
    assert done.err.endswith(
        f"{file}: not written by `wentry render`; move it away, or choose another folder with -o\n"
    )
    assert file.read_text() == "materials: {}\n"
    assert not (tmp_path / "videos" / "soft").exists()


def test_two_do_not_draw_into_one_folder(wentry: Command, scenes: Path, tmp_path: Path) -> None:
    with locked(tmp_path / "videos"):
        assert wentry("render", scenes, "-o", tmp_path / "videos").code == 7


def test_nothing_is_left_of_a_wrong_scenes_file(wentry: Command, tmp_path: Path) -> None:
    (tmp_path / "scenes.yaml").write_text("drops: [{name: a, speeed: 3}]")
    assert wentry("render", tmp_path / "scenes.yaml", "-o", tmp_path / "videos").code == 3
    assert not (tmp_path / "videos").exists()


@pytest.mark.parametrize(
    ("file", "output", "told"),
    [
        ("lab/run03/experiment.yaml", "lab/run03", "is a drop"),
        ("lab/run03/experiment.yaml", "lab", "holds the drop run03, which was not rendered"),
        ("lab/run03/clip.CINE", "lab/run03", "holds a recording, clip.CINE"),
        ("lab/run03/side/a_1.png", "lab/run03", "holds a recording, side/a_1.png"),
        ("lab/run03/truth/truth.yaml", "lab/run03", ""),
        ("lab/notes.txt", "lab", ""),
    ],
)
def test_nothing_is_drawn_beside_a_recording(
    wentry: Command, scenes: Path, tmp_path: Path, file: str, output: str, told: str
) -> None:
    (tmp_path / file).parent.mkdir(parents=True)
    (tmp_path / file).touch()
    done = wentry("render", scenes, "-o", tmp_path / output)
    assert done.code == (4 if told else 0), done.err
    if told:
        assert (
            done.err
            == f"{tmp_path / output}: {told}; give an empty folder with -o, or one that `wentry render` wrote\n"
        )
        assert {path for path in tmp_path.rglob("*") if path.is_file()} == {scenes, tmp_path / file}
    assert (tmp_path / output / "small").is_dir() is not bool(told)
