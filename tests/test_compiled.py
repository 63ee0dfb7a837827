"""Cached kernels must not outlive the code that they call."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from wentry_cli import compiled as module
from wentry_cli.compiled import compiled


def test_the_cache_of_a_room_depends_on_the_rooms_it_imports() -> None:
    assert {"contours", "imaging"} <= module._closure("contours")
    assert "synthetic" not in module._closure("contours")


def test_a_change_in_a_callee_is_a_new_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for room in ("contours", "imaging", "mechanics"):
        shutil.copytree(module.PACKAGE / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    before = {room: module._digest(room) for room in ("contours", "mechanics")}
    edges = tmp_path / "imaging" / "edges.py"
    edges.write_text(edges.read_text() + "# changed\n")
    assert module._digest("contours") != before["contours"]
    assert module._digest("mechanics") == before["mechanics"]


def test_a_function_outside_the_package_is_compiled_too() -> None:
    @compiled
    def double(values: np.ndarray) -> np.ndarray:
        return 2.0 * values

    np.testing.assert_array_equal(double(np.ones(3)), np.full(3, 2.0))
