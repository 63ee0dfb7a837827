"""Standard streams that are closed or full, a terminal that ends, a current directory that is gone."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import call_wentry

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the shell and the devices of Linux")


@pytest.fixture(scope="module")
def results(rendered: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("streams") / "results"
    assert call_wentry("process", rendered, "-o", folder, "-q") == 0
    return folder


def _shell(line: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of the shell, in which ``wentry`` is the command."""
    known = f'wentry() {{ {shlex.quote(sys.executable)} -m wentry_cli.cli.main "$@"; }}\n'
    environment = {**os.environ, "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        ["bash", "-c", known + line], capture_output=True, text=True, cwd=cwd, check=False, env=environment, timeout=300
    )


@pytest.mark.parametrize("words", ["status results", "process {video} -o results --json -q", "--help"])
def test_a_full_disk_under_stdout_is_one_sentence(results: Path, rendered: Path, words: str) -> None:
    done = _shell(f"wentry {words.format(video=rendered)} > /dev/full", results.parent)
    assert done.returncode == 4
    told = "what there is to print cannot be written (No space left on device); free space or print elsewhere\n"
    assert done.stderr == told


@pytest.mark.parametrize("closed", ["2>&-", "2>&- 1>&- 0<&-", "2> /dev/full > /dev/full"])
@pytest.mark.parametrize("words", ["process {video} -o new -j 2", "fit results"])
def test_closed_streams_stop_no_work(results: Path, rendered: Path, words: str, closed: str) -> None:
    code = 4 if "full" in closed else 0
    done = _shell(f"wentry {words.format(video=rendered)} {closed}", results.parent)
    assert (done.returncode, done.stdout) == (code, "")


def test_the_end_of_the_terminal_is_a_termination(tmp_path: Path) -> None:
    code = (
        "import os, signal, time\nfrom wentry_cli.cli import main\n"
        "main.run = lambda: (os.kill(os.getpid(), signal.SIGHUP), time.sleep(0.1), 7)[-1]\n"
        "try:\n    main.main()\nfinally:\n    print('in order')\n"
    )
    done = _shell(f"{sys.executable} -c {shlex.quote(code)}", tmp_path)
    assert (done.returncode, done.stdout) == (128 + signal.SIGHUP, "in order\n")
    done = _shell(f"trap '' HUP; {sys.executable} -c {shlex.quote(code)}", tmp_path)
    assert (done.returncode, done.stdout) == (7, "in order\n")


@pytest.mark.parametrize(
    ("words", "relative"),
    [
        ("process {video} -o {results}", ""),
        ("fit {results}", ""),
        ("check {video}", ""),
        ("process {video}", "results"),
        ("process . -o {results}", "."),
        ("status", "results"),
        ("init .", "."),
    ],
)
def test_a_current_directory_that_was_removed(
    results: Path, rendered: Path, tmp_path: Path, words: str, relative: str
) -> None:
    line = words.format(video=rendered, results=results)
    done = _shell(f"mkdir gone; cd gone; rmdir ../gone; wentry {line}", tmp_path)
    assert done.returncode == (4 if relative else 0), done.stderr
    if relative:
        assert done.stderr.startswith(f"{relative}: is told from the current directory, which was removed")
        assert done.stderr.count("\n") == 1
