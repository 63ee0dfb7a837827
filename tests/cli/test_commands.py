"""The command line without videos: help, wrong words, exit codes, messages; no traceback reaches a user."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.frames.recording_bytes import png
from wentry_cli.cli.main import run
from wentry_cli.config.materials import packaged_config

EXPERIMENT = """\
kind: water_entry
sphere: {diameter_m: 0.051, density_kg_m3: 1070, material: rigid}
views:
  side: {source: side, fps: 2000}
"""


def wentry(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command line in this process, in a folder and with streams of its own."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(cwd or Path.cwd()), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run([str(word) for word in words])
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def wentry_alone(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command line as a user does."""
    command = [sys.executable, "-m", "wentry_cli.cli.main", *map(str, words)]
    environment = {**os.environ, "PYTHONUTF8": "1"}
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False, env=environment, timeout=300)


def _drop(folder: Path, text: str = EXPERIMENT) -> Path:
    folder.mkdir(parents=True)
    (folder / "experiment.yaml").write_text(text)
    return folder


def test_help_lists_every_command_of_the_contract() -> None:
    done = wentry_alone("--help")
    assert done.returncode == 0
    names = "process fit report run calibrate render info check init status compare bench doctor".split()
    assert [
        line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ") and line.split()[0] in names
    ] == names


@pytest.mark.parametrize(
    "name", "process fit report run calibrate render info check init status compare bench doctor".split()
)
def test_every_command_explains_itself(name: str) -> None:
    done = wentry(name, "--help")
    assert done.returncode == 0, done.stderr
    assert "Usage:" in done.stdout
    assert ("--quiet" in done.stdout) is ("Errors and warnings only." in done.stdout)


def test_help_answers_at_once() -> None:
    """Processor time, so that a busy machine does not count; wall time where the system does not tell it."""
    assert min(_seconds("--help") for _ in range(5)) < 0.2


def _seconds(*words: str) -> float:
    before, started = os.times(), time.perf_counter()
    wentry(*words)
    after, wall = os.times(), time.perf_counter() - started
    processor = after.children_user + after.children_system - before.children_user - before.children_system
    return processor or wall


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (("proces", "x"), 2, "Did you mean 'process'?"),
        (("process",), 2, "Missing argument 'VIDEO_DIR'"),
        (("process", "nowhere"), 4, "nowhere: no such folder"),
        (("process", "nowhere", "--until", "trak"), 2, "Invalid value for '--until'"),
        (("fit", "nowhere"), 4, "nowhere: no such folder; run `wentry process VIDEO_DIR"),
        (("report", "nowhere"), 4, "nowhere: no such folder"),
        (("status", "nowhere"), 4, "nowhere: no such folder"),
        (("compare", "nowhere", "nowhere"), 4, "nowhere"),
        (("info", "nowhere"), 4, "nowhere"),
        (("render", "nowhere.yaml"), 4, "nowhere.yaml"),
        (("check", "nowhere"), 4, "nowhere"),
        (
            ("calibrate", "compression", "nowhere.csv", "--diameter-m", "0.05"),
            4,
            "nowhere.csv: no such file; give the CSV file of the compression test\n",
        ),
        (("calibrate", "compression", ".", "--diameter-m", "0.05"), 4, ".: is a folder; give the CSV file"),
        (("process", "x", "-j", "two"), 2, "'two': drops side by side are a whole number from 1 to 1024."),
        (("run", "x", "-j", "0"), 2, "'0': drops side by side are a whole number from 1 to 1024."),
        (("render", "x", "-j", "1.5"), 2, "'1.5': drops side by side are a whole number from 1 to 1024."),
        (("calibrate", "impact", "nowhere"), 4, "nowhere"),
    ],
)
def test_wrong_words_get_a_sentence(tmp_path: Path, words: tuple[str, ...], code: int, sentence: str) -> None:
    done = wentry(*words, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert not [item for item in tmp_path.iterdir() if item.suffix == ".csv"]


@pytest.mark.parametrize(
    "words", [("run", "a", "-o"), ("process", "a", "-o"), ("fit",), ("report",), ("status",), ("calibrate", "impact")]
)
def test_results_that_are_a_file_are_named(tmp_path: Path, words: tuple[str, ...]) -> None:
    (_drop(tmp_path / "a") / "side").mkdir()
    (tmp_path / "FILE").write_text("mine")
    done = wentry(*words, "FILE", cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr.startswith("FILE: is a file")
    assert ("choose another folder with -o" in done.stderr) == (words[-1] == "-o")
    assert done.stderr.count("\n") == 1
    assert (tmp_path / "FILE").read_text() == "mine"
    below = wentry("run", "a", "-o", Path("FILE", "r"), cwd=tmp_path)
    assert (below.returncode, below.stderr) == (4, "FILE: is a file, not a folder; choose another folder with -o\n")


@pytest.mark.parametrize("words", [("fit",), ("report",), ("calibrate", "impact")])
def test_the_folder_of_one_drop_is_told_from_its_results(tmp_path: Path, words: tuple[str, ...]) -> None:
    one = tmp_path / "results" / "small"
    one.mkdir(parents=True)
    (one / "drop.json").write_text("{}", encoding="utf-8")
    done = wentry(*words, str(one))
    assert done.returncode == 4
    assert done.stderr.strip() == f"{one}: is the folder of one drop; give the one above it, and --drop small"
    assert [path.name for path in one.iterdir()] == ["drop.json"]


def test_wrong_configuration_writes_nothing(tmp_path: Path) -> None:
    _drop(tmp_path / "videos" / "a", EXPERIMENT.replace("diameter_m", "diametre_m"))
    done = wentry_alone("process", "videos", cwd=tmp_path)
    assert done.returncode == 3
    assert "did you mean diameter_m?" in done.stderr
    assert not (tmp_path / "results").exists()


def test_missing_source(tmp_path: Path) -> None:
    _drop(tmp_path / "a")
    for words in (("process", "a"), ("check", "a")):
        done = wentry(*words, cwd=tmp_path)
        assert done.returncode == 4, done.stderr
        assert str(Path("a") / "side") in done.stderr
        assert "Traceback" not in done.stderr
    assert not list((tmp_path / "results").rglob("*.csv"))


def test_unknown_drop_is_named(tmp_path: Path) -> None:
    _drop(tmp_path / "videos" / "a")
    done = wentry("process", "videos", "--drop", "b", cwd=tmp_path)
    assert done.returncode == 4
    assert "has no drop b; its drops are a" in done.stderr


def test_dry_run_tells_the_plan_and_does_nothing(tmp_path: Path) -> None:
    folder = _drop(tmp_path / "a")
    (folder / "side").mkdir()
    done = wentry("process", "a", "-n", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    steps = {step["stage"]: step["action"] for step in json.loads(done.stdout)["a"]}
    assert steps == {"ingest": "run", "track": "run", "cavity": "run", "stretch": "not_needed", "kinematics": "run"}
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("words", [("check",), ("process", "-n"), ("run", "-n")])
def test_where_nothing_was_run_no_drop_is_called_complete(tmp_path: Path, words: tuple[str, ...]) -> None:
    for name in ("a", "b"):
        folder = _drop(tmp_path / "campaign" / name, EXPERIMENT if name == "a" else EXPERIMENT.replace("rigid", "none"))
        (folder / "side").mkdir()
        for number in range(12):
            (folder / "side" / f"side_{number}.png").write_bytes(png(np.zeros((8, 8), np.uint8), 8))
    done = wentry(words[0], "campaign", *words[1:], cwd=tmp_path)
    assert done.returncode == 6
    assert done.stderr.splitlines()[-1] == "1 of 2 drops cannot be processed: b; nothing was run"


def test_the_campaign_that_is_inherited_is_named(tmp_path: Path) -> None:
    for name in ("campaign/day/a", "campaign/1/2/3/4/b"):
        folder = _drop(tmp_path / name, EXPERIMENT.replace("kind: water_entry\n", ""))
        (folder / "side").mkdir()
        for number in range(12):
            (folder / "side" / f"side_{number}.png").write_bytes(png(np.zeros((8, 8), np.uint8), 8))
    shared = tmp_path / "campaign" / "campaign.yaml"
    shared.write_text("kind: water_entry\n")
    for words in (("campaign",), ("campaign/day",), ("campaign/day/a",)):
        done = wentry("check", *words, "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert set(json.loads(done.stdout)["campaign"].values()) == {str(shared)}
        assert done.stderr == ""
    done = wentry("check", "campaign", cwd=tmp_path)
    assert f"campaign.yaml: {shared}" in done.stdout
    assert "materials.yaml: none" in done.stdout, "a rigid sphere needs none"
    assert str(shared) not in done.stderr
    for words in (("check",), ("process", "-n")):
        assert f"{shared}, above campaign" in wentry(*words, str(Path("campaign/day/a")), cwd=tmp_path).stderr
        assert wentry(*words, "campaign/day/a", "-q", cwd=tmp_path).stderr == ""
    done = wentry("check", "campaign/1/2/3/4/b", cwd=tmp_path)
    assert done.returncode == 3
    assert "kind: is required" in done.stderr
    assert f"{shared} is not used: it lies more than 3 folders above" in done.stderr


def test_the_materials_file_that_is_used_is_named(tmp_path: Path) -> None:
    folder = _drop(tmp_path / "a", EXPERIMENT.replace("rigid", "dragonskin_6p70_small"))
    (folder / "side").mkdir()
    for number in (*range(1, 3), *range(4, 14)):
        (folder / "side" / f"side_{number}.png").write_bytes(png(np.zeros((8, 8), np.uint8), 8))
    packaged = packaged_config("materials.yaml")
    assert f"materials.yaml: {packaged}" in wentry("check", "a", cwd=tmp_path).stdout
    (folder / "materials.yaml").write_bytes(packaged.read_bytes())
    done = wentry("check", "a", cwd=tmp_path)
    assert f"materials.yaml: {Path('a', 'materials.yaml')}" in done.stdout
    assert "13 frames of 8 x 8 (1 missing by their numbers)" in done.stdout
    assert json.loads(wentry("check", "a", "--json", cwd=tmp_path).stdout)["materials"] == {"a": "a/materials.yaml"}


def test_init_then_check(tmp_path: Path) -> None:
    done = wentry("init", "new", cwd=tmp_path)
    assert done.returncode == 0
    made = "new: did not exist and was made, without a recording; remove it if its name was mistyped"
    assert done.stderr.splitlines()[0] == made
    (tmp_path / "there").mkdir()
    assert "did not exist" not in wentry("init", "there", cwd=tmp_path).stderr
    astray = wentry("init", "videso/run12", cwd=tmp_path)
    assert (astray.returncode, astray.stderr) == (4, "videso: no such folder; check the name, or make it first\n")
    assert not (tmp_path / "videso").exists()
    done = wentry("check", "new", cwd=tmp_path)
    assert done.returncode == 3
    assert "experiment.yaml:4:3: error: sphere.diameter_m: is left empty; fill it in" in done.stderr
    assert wentry("init", "new", cwd=tmp_path).returncode == 4


def test_doctor_finds_this_installation_sound() -> None:
    done = wentry("doctor", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["problems"] == []


def test_bench_says_before_it_measures_where_it_cannot_write(tmp_path: Path) -> None:
    (tmp_path / "page").touch()
    done = wentry("bench", "-o", "page", cwd=tmp_path)
    assert done.returncode == 2
    assert "'page' is a file" in done.stderr
    assert "nowhere.cihx" in wentry("bench", "--ball", "nowhere.cihx", cwd=tmp_path).stderr


def test_bench_renews_one_chapter_of_a_page(tmp_path: Path) -> None:
    kept = tmp_path / "page" / "accuracy_pinch_off.csv"
    kept.parent.mkdir()
    head = "chapter,case,method,quantity,unit,bias,rmse,ratio_to_bound,failures,time_us,note,items\n"
    text = head + "pinch_off,exponent 0.5,wentry,t_p,frames,0.0165,0.0812,,0,1.312e+04,,200\n"
    kept.write_text(text, encoding="utf-8")
    quick = wentry("bench", "--chapter", "ball", "--quick", "-o", "page", cwd=tmp_path)
    assert quick.returncode == 4
    assert "page: holds chapters measured in full" in quick.stderr
    assert sorted(path.name for path in kept.parent.iterdir()) == [kept.name]
    done = wentry("bench", "--chapter", "ball", "-o", "page", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (kept.parent / "accuracy.md").read_text(encoding="utf-8")
    assert page.index("- Pinch-off: an earlier run") < page.index("- A real ball: `wentry bench --chapter ball --seed")
    assert page.index("| exponent 0.5, wentry | 0.0165 | 0.0812 |") < page.index("## A real ball")
    assert kept.read_text(encoding="utf-8") == text


def test_bench_measures_chapters_beside_each_other_and_says_so(tmp_path: Path) -> None:
    words = ("--quick", "-j", "2", "--chapter", "solvers", "--chapter", "ball", "-o", "page", "--json")
    done = wentry("bench", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    chapters = [row["chapter"] for row in json.loads(done.stdout)]
    assert chapters == sorted(chapters, key=["solvers", "ball"].index)  # in the order asked for, not of their ends
    assert set(chapters) == {"solvers", "ball"}
    page = (tmp_path / "page" / "accuracy.md").read_text(encoding="utf-8")
    assert "`wentry bench --chapter solvers --chapter ball --quick -j 2 --seed 20170412`" in page
