"""A small rendered drop, and the command line called in this process."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from wentry_cli.cli.main import run
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene

SMALL = {
    "name": "small",
    "seed": 11,
    "sphere": {"diameter_m": 0.051, "material": "rigid"},
    "impact_speed_m_s": 3.0,
    "side": {"width": 240, "height": 400, "scale_px_per_m": 1000, "surface_y_px": 120.4, "fps": 1000},
    "clip": {"before_s": 0.016, "after_pinch_off_s": 0.006, "longest_s": 0.16},
}


@dataclass(frozen=True)
class Outcome:
    """What a command left: exit code and its words."""

    code: int
    out: str
    err: str


Command = Callable[..., Outcome]


def call_wentry(*words: str | Path) -> int:
    """Call the command line in this process; its exit code."""
    return run([str(word) for word in words])


@pytest.fixture
def wentry(capsys: pytest.CaptureFixture[str]) -> Command:
    """Call the command line in this process; a traceback among the words fails the test."""

    def call(*words: str | Path) -> Outcome:
        capsys.readouterr()
        code = call_wentry(*words)
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture(scope="session")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rigid drop filmed from the side, rendered once; tests copy it before they spoil it."""
    folder = tmp_path_factory.mktemp("rendered") / "small"
    render_drop(Scene.model_validate(SMALL), folder)
    return folder


@pytest.fixture
def video(rendered: Path, tmp_path: Path) -> Path:
    """A copy of the small drop that a test may spoil; its truth is left out."""
    folder = tmp_path / "videos" / "small"
    shutil.copytree(rendered, folder, ignore=shutil.ignore_patterns("truth"))
    return folder
