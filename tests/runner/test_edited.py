"""Tables that somebody edited between two stages: said, and no mistake of ours where a stage cannot use them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import SMALL, call_wentry
from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError
from wentry_cli.pipeline import stages_of
from wentry_cli.runner.edited import edited_tables
from wentry_cli.runner.in_clip import check_before
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import new_table, write_table


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("edited")
    render_drop(Scene.model_validate(SMALL), folder / "small")
    assert call_wentry("process", folder / "small", "-o", folder / "results", "-q") == 0
    assert call_wentry("fit", folder / "results", "-q") == 0
    return folder / "results"


@pytest.fixture
def results(fitted: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(fitted, tmp_path / "results"))


def test_an_edited_table_is_said(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert edited_tables(results / "small") == {}
    path = results / "small" / "kinematics.csv"
    path.write_text(path.read_text() + "\n")
    assert edited_tables(results / "small") == {"kinematics": "kinematics"}
    assert call_wentry("fit", results) == 0
    assert f"{path}: not as the stage kinematics wrote it" in capsys.readouterr().err


def test_of_a_table_that_fit_writes_it_is_said_that_fit_makes_it_anew(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = results / "small" / "summary.csv"
    before = path.read_text()
    path.write_text(before + "\n")
    assert call_wentry("fit", results) == 0
    told = capsys.readouterr().err
    assert f"{path}: not as the stage summary wrote it; a report shows it as it is, `wentry fit` makes it anew" in told
    assert path.read_text() == before


@pytest.mark.parametrize("table", ["kinematics", "side", "geometry"])
def test_an_edit_that_breaks_a_stage_is_no_mistake_of_ours(
    results: Path, table: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = results / "small" / f"{table}.csv"
    path.write_text(path.read_text().splitlines()[0] + "\n")
    code = call_wentry("fit", results)
    told = capsys.readouterr().err
    assert code in (0, 4)
    assert str(path) in told
    assert "mistake in wentry" not in told


@pytest.mark.parametrize(
    "entry",
    [
        {"outputs": [1], "inputs": 3},
        {"fingerprint": {}, "outputs": {"colours": "a"}},
        {"fingerprint": [], "outputs": {}},
        {"error": ["too few"]},
        {"error": "too few", "exit_code": "five"},
        {"fingerprint": {}, "warnings": 3},
        "done",
    ],
)
def test_a_record_that_no_run_wrote_is_that_of_a_stage_that_has_not_run(
    results: Path, entry: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in (results / "small", results):
        known = json.loads((folder / "stages.json").read_text())
        name = "track" if "track" in known else "scaling"
        (folder / "stages.json").write_text(json.dumps(known | {name: entry}))
    assert call_wentry("status", results, "--json") == 0
    states = json.loads(capsys.readouterr().out)
    assert states["small"]["track"] == ["stale", "not run yet"]
    assert states["*"]["scaling"][0] == "stale"
    assert call_wentry("fit", results) == 4
    assert "small: track: stage track has not run; run `wentry process` first" in capsys.readouterr().err
    assert call_wentry("report", results, "-n") == 0


def test_a_first_peak_that_no_sphere_has_is_told_with_its_table(drop: Drop, tmp_path: Path) -> None:
    (model,) = (stage for stage in stages_of("fit") if stage.name == "model")
    for peak, later in ((1.4, 50.0), (50.0, 1.4)):
        columns = {"period": [1, 2], "t_peak_s": [0.01, 0.02], "stretch_peak": [peak, later], "status": ["ok", "ok"]}
        path = write_table(tmp_path, "periods", new_table("periods", columns))
        if peak < 20.0:
            check_before(tmp_path, model, drop)
    with pytest.raises(InputError, match=r"periods\.csv: stretch_peak of period 1 is 50") as error:
        check_before(tmp_path, model, drop)
    assert str(error.value).startswith(str(path))
