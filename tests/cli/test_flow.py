"""Process, fit, report and run as a user calls them twice, partly, forced or dry; what goes to which stream."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Command, Outcome, call_wentry
from wentry_cli.tables import read_table

Files = dict[str, tuple[int, bytes]]


@pytest.fixture(scope="module")
def done(rendered: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the small drop, complete with report; tests copy them before they spoil them."""
    results = tmp_path_factory.mktemp("flow") / "results"
    assert call_wentry("run", rendered, "-o", results, "-q") == 0
    return results


@pytest.fixture
def results(done: Path, tmp_path: Path) -> Path:
    """A copy; the times of change are kept."""
    return Path(shutil.copytree(done, tmp_path / "results"))


def _files(results: Path) -> Files:
    paths = [path for path in results.rglob("*") if path.is_file() and path.name != ".lock"]
    return {str(path.relative_to(results)): (path.stat().st_mtime_ns, path.read_bytes()) for path in paths}


def _drawn(files: Files) -> Files:
    return {name: told for name, told in files.items() if name.startswith(("report.", "figures"))}


def test_a_report_of_unchanged_results_does_nothing_and_says_so(wentry: Command, results: Path) -> None:
    before = _drawn(_files(results))
    assert len(before) > 20
    told = wentry("report", results)
    assert told.code == 0
    assert told.err == (
        f"{results / 'report.html'} and {results / 'report.pdf'} show today's results already; "
        "--force draws them again\n"
    )
    assert told.out == ""
    assert _drawn(_files(results)) == before
    assert wentry("report", results, "-q").err == ""
    assert "report fresh: nothing that it reads has changed" in wentry("report", results, "-v").err
    assert json.loads(wentry("report", results, "--json").out)["stages"]["report"]["seconds"] > 0


def test_a_forced_report_is_drawn_again_with_the_same_bytes(wentry: Command, results: Path) -> None:
    before = _drawn(_files(results))
    told = wentry("report", results, "--force", "-v")
    assert told.code == 0
    assert "report done" in told.err
    after = _drawn(_files(results))
    assert {name: data for name, (_, data) in after.items()} == {name: data for name, (_, data) in before.items()}
    assert all(after[name][0] > before[name][0] for name in before)


def test_a_changed_table_is_told_and_drawn(wentry: Command, results: Path) -> None:
    path = results / "small" / "side.csv"
    path.write_text(path.read_text().replace("ok", "poor_fit", 1))
    planned = wentry("report", results, "-n")
    assert planned.out.split() == "all drops report run small/side.csv changed".split()
    states = json.loads(wentry("status", results, "--json").out)
    assert states["small"]["track"] == ["stale", "side.csv was changed or removed"]
    assert states["*"]["scaling"] == ["stale", "summary of small runs before it"]
    assert "report done" in wentry("report", results).err


def test_a_table_edited_by_hand_is_told_in_the_report_too(wentry: Command, results: Path) -> None:
    path, page = results / "small" / "kinematics.csv", results / "report.html"
    sentence, text = "kinematics.csv is not as this stage wrote it; its numbers are shown, and used", path.read_text()
    assert sentence not in page.read_text(encoding="utf-8")
    path.write_text(text + "\n")
    assert "report done" in wentry("report", results).err
    assert sentence in page.read_text(encoding="utf-8")
    assert "show today's results already" in wentry("report", results).err
    path.write_text(text)
    assert "report done" in wentry("report", results).err
    assert sentence not in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "steps"),
    [
        (("report",), {"*": {"report": "fresh"}}),
        (("fit",), {"small": {"model": "not_needed", "summary": "fresh"}, "*": {"scaling": "fresh"}}),
        (("fit", "--force"), {"small": {"model": "not_needed", "summary": "run"}, "*": {"scaling": "run"}}),
        (("fit", "--until", "model"), {"small": {"model": "not_needed"}}),
        (("report", "--force"), {"*": {"report": "run"}}),
    ],
)
def test_plans_of_commands_on_results(wentry: Command, results: Path, words: tuple[str, ...], steps: object) -> None:
    before = _files(results)
    told = wentry(words[0], results, "-n", "--json", *words[1:])
    assert told.code == 0, told.err
    found = {name: {step["stage"]: step["action"] for step in given} for name, given in json.loads(told.out).items()}
    assert found == steps
    assert _files(results) == before


def test_a_plan_of_run_goes_to_the_report(wentry: Command, rendered: Path, done: Path) -> None:
    told = wentry("run", rendered, "-o", done, "-n", "--force=summary")
    lines = {line[25:37].strip(): line[38:51].strip() for line in told.out.splitlines()}
    assert lines == {
        "ingest": "fresh", "track": "fresh", "cavity": "fresh", "stretch": "not needed", "kinematics": "fresh",
        "model": "not needed", "summary": "run", "scaling": "run", "report": "run",
    }  # fmt: skip
    assert told.err == ""


def test_run_until_a_stage(wentry: Command, video: Path, tmp_path: Path) -> None:
    told = wentry("run", video, "-o", tmp_path / "r", "--until", "track")
    assert told.code == 0, told.err
    assert "stopped after track" in told.err
    assert sorted(path.stem for path in (tmp_path / "r").rglob("*.csv")) == ["frames", "geometry", "side"]
    assert not (tmp_path / "r" / "report.html").exists()


def test_one_drop_of_several_leaves_the_table_of_all(wentry: Command, results: Path) -> None:
    shutil.copytree(results / "small", results / "other")
    for name in ("drop.json", "summary.csv"):
        path = results / "other" / name
        path.write_text(path.read_text().replace("small", "other"))
    told = wentry("fit", results, "--drop", "small")
    assert told.code == 0, told.err
    assert read_table(results, "summary")["drop"].tolist() == ["other", "small"]


def test_an_interrupted_drop_is_no_bug(wentry: Command, results: Path) -> None:
    path = results / "small" / "stages.json"
    record = json.loads(path.read_text())
    record["track"] = {"error": "interrupted"}
    path.write_text(json.dumps(record))
    told = wentry("fit", results)
    assert told.code == 4
    assert "small: track: stage track was interrupted; run `wentry process` again" in told.err


def test_status_writes_nothing(wentry: Command, results: Path) -> None:
    (results / ".lock").unlink()
    told = wentry("status", results)
    assert told.code == 0
    assert told.out.count("fresh") == 7
    assert not (results / ".lock").exists()
    assert "all drops" not in wentry("status", results, "--drop", "small").out
    assert wentry("status", results, "--drop", "smal").code == 4


READING: dict[str, Callable[[Path, Path], tuple[str | Path, ...]]] = {
    "info": lambda video, results: (video / "side",),
    "check": lambda video, results: (video,),
    "status": lambda video, results: (results,),
    "compare": lambda video, results: (results, video),
    "doctor": lambda video, results: (),
}


@pytest.mark.parametrize("name", READING)
def test_what_reads_tells_json_on_stdout_alone(wentry: Command, rendered: Path, done: Path, name: str) -> None:
    told: Outcome = wentry(name, *READING[name](rendered, done), "--json")
    assert told.code == 0, told.err
    assert json.loads(told.out, parse_constant=_refuse)
    assert told.err == ""


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def test_compare_takes_one_drop(wentry: Command, rendered: Path, done: Path) -> None:
    assert wentry("compare", done, rendered, "--drop", "small").out == wentry("compare", done, rendered).out
    assert "has no drop smal; its drops are small" in wentry("compare", done, rendered, "--drop", "smal").err
