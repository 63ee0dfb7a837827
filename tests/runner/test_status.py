"""What ``status`` says of drops whose configuration or recording is wrong, and of those that were never measured."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import SMALL, Command, wentry
from wentry_cli.runner.status import campaign_status
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene

__all__ = ["wentry"]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drop as MRAW and one as images, of which only the frames' times are needed."""
    folder = tmp_path_factory.mktemp("status")
    raw = SMALL | {"name": "raw", "side": SMALL["side"] | {"bits": 12, "format": "mraw"}}
    for scene in (raw, SMALL | {"name": "images"}):
        render_drop(Scene.model_validate(scene), folder / "videos" / str(scene["name"]))
    return folder


@pytest.fixture
def campaign(drawn: Path, tmp_path: Path, wentry: Command) -> Path:
    shutil.copytree(drawn / "videos", tmp_path / "videos")
    done = wentry("process", tmp_path / "videos", "-o", tmp_path / "results", "--until", "ingest")
    assert done.code == 0, done.err
    return tmp_path


def _input(campaign: Path, drop: str) -> tuple[str, str]:
    return campaign_status(campaign / "results")[drop].get("input", ("", ""))


@pytest.mark.parametrize(
    ("suffix", "told"),
    [
        (".mraw", "side.cihx: no side.mraw beside it; copy the frames there"),
        (".cihx", "side.cihx: no such file or folder"),
    ],
)
@pytest.mark.parametrize("measured", [True, False])
def test_a_missing_half_of_a_recording_is_told_once(
    campaign: Path, wentry: Command, suffix: str, told: str, measured: bool
) -> None:
    if not measured:
        shutil.rmtree(campaign / "results")
    (campaign / "videos" / "raw" / "side").with_suffix(suffix).unlink()
    if not measured:
        assert wentry("process", campaign / "videos", "-o", campaign / "results", "--until", "ingest").code == 6
    assert _input(campaign, "images") == ("", "")
    state, sentence = _input(campaign, "raw")
    assert state == "wrong"
    assert told in sentence
    stages = {name: told for name, told in campaign_status(campaign / "results")["raw"].items() if name != "input"}
    assert set(stages.values()) == {("stale", "see input")}
    lines = wentry("status", campaign / "results").out.splitlines()
    assert sum(told in line for line in lines) == 1


def test_a_folder_without_its_images_is_told(campaign: Path) -> None:
    for path in (campaign / "videos" / "images" / "side").glob("*.png"):
        path.unlink()
    state, sentence = _input(campaign, "images")
    assert (state, "side: no image here (png, tif, jpg, bmp)" in sentence) == ("wrong", True)


def test_a_drop_with_a_wrong_configuration_is_not_left_out(campaign: Path, wentry: Command) -> None:
    """Neither one that was measured before nor a new one; two mistakes stand in one line."""
    shutil.copytree(campaign / "videos" / "images", campaign / "videos" / "new")
    for name in ("raw", "new"):
        path = campaign / "videos" / name / "experiment.yaml"
        path.write_text(path.read_text().replace("diameter_m:", "diameter_mm:"))
    for name in ("raw", "new"):
        state, sentence = _input(campaign, name)
        assert state == "wrong"
        assert "sphere.diameter_m: is required; " in sentence
        assert "sphere.diameter_mm: unknown key" in sentence
        assert "\n" not in sentence
    shutil.move(campaign / "videos", campaign / "elsewhere")
    assert "new" not in campaign_status(campaign / "results")
    shutil.move(campaign / "elsewhere", campaign / "videos")
    assert wentry("process", campaign / "videos", "-o", campaign / "results", "--until", "ingest").code == 6
    shutil.move(campaign / "videos", campaign / "elsewhere")
    assert "unknown key" in _input(campaign, "new")[1], "as the last run saw it"
    shutil.move(campaign / "elsewhere", campaign / "videos")
    path = campaign / "videos" / "new" / "experiment.yaml"
    path.write_text(path.read_text().replace("diameter_mm:", "diameter_m:"))
    assert "new" not in campaign_status(campaign / "results"), "it was mended"
