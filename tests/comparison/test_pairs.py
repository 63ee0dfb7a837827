"""Drops and truths are matched by name, and told where they are not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from wentry_cli.comparison.campaign import compare
from wentry_cli.errors import InputError
from wentry_cli.tables import new_table, write_table


def _results(tmp_path: Path, *names: str) -> Path:
    for name in names:
        folder = tmp_path / "results" / name
        folder.mkdir(parents=True)
        (folder / "drop.json").write_text("{}")
        columns = {"frame": np.arange(3), "t_s": np.arange(3) * 1e-3, "y_b_m": [0.0] * 3, "status": ["ok"] * 3}
        write_table(folder, "side", new_table("side", columns))
    return tmp_path / "results"


def _truth(tmp_path: Path, *names: str) -> Path:
    for name in names:
        folder = tmp_path / "rend" / name / "truth"
        folder.mkdir(parents=True)
        (folder / "truth.csv").write_text("frame,y_b_m\n0,0\n1,0\n2,0\n")
        (folder / "truth.yaml").write_text("")
    return tmp_path / "rend"


def _compared(results: Path, truth: Path, *only: str) -> list[str]:
    return [line.drop for line in compare(results, truth, only)]


def test_a_campaign_is_matched_by_name(tmp_path: Path) -> None:
    results, truth = _results(tmp_path, "a", "b", "day__c"), _truth(tmp_path, "a", "day/c", "d")
    assert _compared(results, truth) == ["a", "day__c"]


@pytest.mark.parametrize(("folder", "drop"), [("a", "a"), ("day/c", "day__c")])
def test_the_truth_of_one_drop_is_that_of_its_name(tmp_path: Path, folder: str, drop: str) -> None:
    results, truth = _results(tmp_path, "a", "b", "day__c"), _truth(tmp_path, "a", "day/c")
    assert _compared(results, truth / folder) == [drop]


def test_the_truth_of_one_drop_is_that_of_the_only_one(tmp_path: Path) -> None:
    results, truth = _results(tmp_path, "a", "b"), _truth(tmp_path, "other")
    assert _compared(results, truth / "other", "b") == ["b"]
    with pytest.raises(InputError, match="holds none of that name but a, b; say with --drop which it is"):
        compare(results, truth / "other")


def test_names_of_both_sides_are_told_where_none_match(tmp_path: Path) -> None:
    results, truth = _results(tmp_path, "x", "y"), _truth(tmp_path, *"abcdefg")
    told = f"it holds the truth of a, b, c, d, e and 2 more, {results} the drops x, y; compare one drop"
    with pytest.raises(InputError, match=re.escape(told)):
        compare(results, truth)
    with pytest.raises(InputError, match=re.escape(f"wentry compare {results} {truth / 'a'} --drop y") + "$"):
        compare(results, truth, ["y"])
    assert _compared(results, truth / "a", "y") == ["y"]
    with pytest.raises(InputError, match="holds no truth for the drops of"):
        compare(results, results)


def test_the_folder_of_one_drop_is_told_with_the_command_that_is_meant(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results, truth = _results(tmp_path, "a"), _truth(tmp_path, "other")
    told = "is the folder of one drop; give the one above it: wentry compare {} {} --drop a"
    with pytest.raises(InputError, match=re.escape(told.format(results, truth / "other")) + "$"):
        compare(results / "a", truth / "other")
    monkeypatch.chdir(results / "a")
    with pytest.raises(InputError, match=re.escape(told.format(results, truth)) + "$"):
        compare(Path(), truth)
