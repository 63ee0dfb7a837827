"""One recording under two names in one folder of results, and two drops that share a recording."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError
from wentry_cli.runner.record import read_drops, write_drop
from wentry_cli.runner.twice import warn_of_twice
from wentry_cli.tables import new_table, write_table


def _measured(results: Path, drop: Drop, name: str, content: str, frames: tuple[int, int] | None = None) -> None:
    views = drop.experiment.views
    assert views.side is not None
    side = views.side.model_copy(update={"frames": frames})
    experiment = drop.experiment.model_copy(update={"views": views.model_copy(update={"side": side})})
    write_drop(results, replace(drop, name=name, experiment=experiment))
    marks = {"recording side": f"sampled:{name} content:{content}"}
    (results / name / "stages.json").write_text(json.dumps({"ingest": {"fingerprint": marks}}))
    write_table(results / name, "geometry", new_table("geometry", {"view": ["side"]}))


def test_a_recording_under_two_names_is_told_with_what_to_do(drop: Drop, tmp_path: Path) -> None:
    results = tmp_path / "results"
    assert warn_of_twice(results) == []
    for name, content in (("mine", "a"), ("vid__mine", "a"), ("vid__other", "b")):
        _measured(results, drop, name, content)
    (told,) = warn_of_twice(results)
    assert told.startswith("mine and vid__mine were measured from the same recording")
    assert f"keep the folder of one of them in {results}, remove the rest" in told
    assert warn_of_twice(results, ("mine", "vid__other")) == []
    (results / "mine" / "geometry.csv").unlink()  # it could not be measured
    assert warn_of_twice(results) == []


def test_a_drop_that_failed_counts_nowhere(drop: Drop, tmp_path: Path) -> None:
    for name in ("mine", "vid__mine"):
        _measured(tmp_path, drop, name, "a")
    assert len(warn_of_twice(tmp_path)) == 1
    record = tmp_path / "mine" / "stages.json"
    record.write_text(json.dumps(json.loads(record.read_text()) | {"track": {"error": "mine: no sphere is seen"}}))
    assert warn_of_twice(tmp_path) == []


def test_two_drops_in_one_recording_are_two(drop: Drop, tmp_path: Path) -> None:
    _measured(tmp_path, drop, "first", "a", (0, 200))
    _measured(tmp_path, drop, "second", "a", (201, 400))
    assert warn_of_twice(tmp_path) == []


def test_results_under_the_name_of_another_drop_are_told(drop: Drop, tmp_path: Path) -> None:
    _measured(tmp_path, drop, "e", "a")
    shutil.copytree(tmp_path / "e", tmp_path / "f")
    drops, damaged = read_drops(tmp_path)
    assert [each.name for each in drops] == ["e"]
    assert damaged["f"].startswith(f"{tmp_path / 'f'}: holds the results of the drop e; remove this copy, or process")
    assert warn_of_twice(tmp_path) == []
    shutil.rmtree(tmp_path / "e")
    with pytest.raises(InputError, match="holds the results of the drop e; name the folder e again"):
        read_drops(tmp_path)
