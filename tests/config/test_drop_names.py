"""Names of drops, made of the folders that hold them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wentry_cli.config.campaign import find_drops
from wentry_cli.errors import ConfigurationError, InputError

ROOT = Path(__file__).resolve().parents[2]


def test_a_name_that_no_folder_can_have_is_refused(tmp_path: Path) -> None:
    deep = tmp_path / ("n" * 200) / ("m" * 60)
    deep.mkdir(parents=True)
    (deep / "experiment.yaml").write_text("kind: free_flight\n")
    with pytest.raises(InputError, match="at most 255 bytes, not 262"):
        find_drops(tmp_path)
    assert list(find_drops(deep.parent)) == ["m" * 60]


@pytest.mark.parametrize(
    "name", ["summary.csv", "Materials.csv", "run.json", "stages.json", "report.html", "figures", "error.log"]
)
def test_a_name_of_the_tools_own_files_is_refused(tmp_path: Path, name: str) -> None:
    for folder in (tmp_path / name, tmp_path / "sound"):
        folder.mkdir(parents=True)
        (folder / "experiment.yaml").write_text("kind: free_flight\n")
    with pytest.raises(ConfigurationError, match=f"^{name}: .*; rename it$"):
        find_drops(tmp_path)


def test_letters_that_the_locale_does_not_know_are_blamed_on_the_locale(tmp_path: Path) -> None:
    folder = tmp_path / "größe"
    folder.mkdir()
    (folder / "experiment.yaml").write_text("kind: free_flight\n")
    code = "from pathlib import Path; from wentry_cli.config.campaign import find_drops; find_drops(Path('.'))"
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=os.environ | plain, capture_output=True, text=True, check=False
    )
    assert "the locale says that names of files are in ascii" in done.stderr
    assert "set a UTF-8 locale" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux alone")
def test_a_name_in_no_known_letters_is_not_blamed_on_the_locale(tmp_path: Path) -> None:
    folder = os.fsencode(tmp_path) + b"/gr\xf6sse"
    os.mkdir(folder)
    Path(os.fsdecode(folder), "experiment.yaml").write_text("kind: free_flight\n")
    with pytest.raises(InputError, match="a name of one line of text; rename it"):
        find_drops(tmp_path)
