"""Input that a stranger, or a slip, may leave behind: a sentence and an exit code, and the other drops go on."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.cli.test_damaged_recordings import _phantom, _photron
from wentry_cli.tables import read_table


def _edit(video: Path, old: str, new: str) -> None:
    path = video / "experiment.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


@pytest.fixture
def pair(video: Path) -> Path:
    """A campaign of a good drop and one to be spoilt, ``bad``."""
    shutil.copytree(video, video.parent / "bad")
    return video.parent


def test_a_source_that_links_to_itself_stops_no_other(wentry: Command, pair: Path, tmp_path: Path) -> None:
    shutil.rmtree(pair / "bad" / "side")
    (pair / "bad" / "side").symlink_to("side")
    done = wentry("process", pair, "-o", tmp_path / "r")
    assert done.code == 6
    assert "bad/side" in done.err
    assert (tmp_path / "r" / "small" / "side.csv").is_file()


def test_a_source_with_an_endless_name_stops_no_other(wentry: Command, pair: Path, tmp_path: Path) -> None:
    _edit(pair / "bad", "source: side", f"source: {'x' * 300}")
    done = wentry("process", pair, "-o", tmp_path / "r")
    assert done.code == 6
    assert "source: must not be longer" in done.err


@pytest.mark.parametrize(
    "words", ["info", "check", "fit", "report", "process ? -o", "calibrate compression --diameter-m 1"]
)
def test_a_path_that_no_disk_can_hold(wentry: Command, video: Path, words: str) -> None:
    done = wentry(*words.replace("?", str(video)).split(), "y" * 300)
    assert done.code == 4
    assert done.err.startswith("y" * 300)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_a_pipe_is_no_recording(wentry: Command, video: Path) -> None:
    os.mkfifo(video / "clip.cihx")
    _edit(video, "source: side", "source: clip.cihx")
    done = wentry("check", video)
    assert done.code == 4
    assert "clip.cihx: is a device or a pipe" in done.err


def test_a_rate_of_a_billion_digits_is_none(wentry: Command, video: Path) -> None:
    _photron(video, rate="1e999999999")
    done = wentry("check", video)
    assert done.code == 3
    assert "frame rate" in done.err


@pytest.mark.parametrize(
    "times", [[0.0] * 126, [1.0 - 0.001 * k for k in range(126)], [0.0, *(1e5 + k / 1e3 for k in range(125))]]
)
def test_stamps_that_no_clock_gives_are_not_used(
    wentry: Command, video: Path, tmp_path: Path, times: list[float]
) -> None:
    count = len(list((video / "side").iterdir()))
    _phantom(video, times=times[:1] * max(0, count - len(times)) + times[-count:] if len(times) > count else times)
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    assert read_table(tmp_path / "r" / "small", "geometry")["fps_source"].iloc[0] == "cine header frame rate"


def test_a_damaged_record_stops_no_other(wentry: Command, pair: Path, tmp_path: Path) -> None:
    assert wentry("process", pair, "-o", tmp_path / "r").code == 0
    (tmp_path / "r" / "bad" / "drop.json").write_text("[" * 100_000)
    done = wentry("fit", tmp_path / "r")
    assert done.code == 6
    assert "drop.json: damaged" in done.err
    assert (tmp_path / "r" / "small" / "summary.csv").is_file()
    assert wentry("status", tmp_path / "r").code in (0, 6)
    assert "bad: not complete: " + str(tmp_path / "r" / "bad" / "drop.json") in wentry("report", tmp_path / "r").err


def test_a_truth_that_holds_words(wentry: Command, video: Path, tmp_path: Path) -> None:
    assert wentry("process", video, "-o", tmp_path / "r").code == 0
    (tmp_path / "truth.csv").write_text("frame,y_b_m\n1,abc\n")
    done = wentry("compare", tmp_path / "r", tmp_path / "truth.csv")
    assert done.code == 4
    assert "column y_b_m holds what is no number" in done.err


def test_a_surface_given_far_from_the_one_in_the_picture_is_told(
    wentry: Command, video: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    wentry("process", video, "-o", tmp_path / "r", "--set", "views.side.surface_y_px=160")
    assert "the picture shows a surface at row 120" in caplog.text


@pytest.mark.parametrize("change", ["impact_speed_m_s: 1.0e+300", "clip: {longest_s: 1.0e+12}", "side: {fps: 1.0e+12}"])
def test_scenes_have_bounds(wentry: Command, tmp_path: Path, change: str) -> None:
    scene = {"impact_speed_m_s": "impact_speed_m_s: 3", "side": "side: {width: 64, height: 64, scale_px_per_m: 500}"}
    scene |= {change.split(":", maxsplit=1)[0]: change}
    if change.startswith("side"):
        scene["side"] = "side: {width: 64, height: 64, scale_px_per_m: 500, fps: 1.0e+12}"
    lines = "\n    ".join(["name: a", "sphere: {diameter_m: 0.05}", *scene.values()])
    (tmp_path / "scene.yaml").write_text(f"seed: 1\ndrops:\n  - {lines}\n")
    done = wentry("render", tmp_path / "scene.yaml", "-o", tmp_path / "v")
    assert done.code == 3, done.err
    assert "at most" in done.err


def test_a_failing_side_view_beside_a_top_view_has_its_sentence(wentry: Command, video: Path, tmp_path: Path) -> None:
    _edit(video, "views:", "views:\n  top: {source: above, fps: 1000, scale_px_per_m: 1000, camera_distance_m: 1.5}")
    shutil.copytree(video / "side", video / "above")
    done = wentry("run", video, "-o", tmp_path / "r", "--set", "views.side.polarity=bright")
    assert done.code == 5, done.err
    assert done.err.endswith(f"what failed, and what there is: {tmp_path / 'r' / 'report.html'}\n")
    assert "darker than what is behind it is seen, but polarity of views.side is bright: set polarity: dark" in done.err
