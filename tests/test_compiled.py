"""Cached kernels must not outlive the code that they call."""

from __future__ import annotations

import importlib.util
import math
import shutil
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from wentry_cli import compiled as module
from wentry_cli.compiled import compiled, reordered


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


def test_the_first_run_is_known_by_the_kernels_that_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where kernels are kept is written in one place; a kernel that numba compiles there ends the first run."""
    shutil.copytree(module.PACKAGE / "imaging", tmp_path / "imaging", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    module._cache_folder.cache_clear()
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    try:
        assert module.compiles_anew(["imaging"])
        source = "import numba\nfrom wentry_cli.compiled import compiled\n@compiled\ndef twice(x):\n    return 2 * x\n"
        path = tmp_path / "imaging" / "twice.py"
        path.write_text(source)
        name = f"{tmp_path.name}.imaging.twice"
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        made = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, made)
        spec.loader.exec_module(made)
        assert module.compiles_anew(["imaging"])
        assert made.twice(2.0) == 4.0
        assert not module.compiles_anew(["imaging"])
        assert module.compiles_anew(["imaging", "contours"]), "kernels of another room are no help"
        path.write_text(f"{source}# changed\n")
        assert module.compiles_anew(["imaging"]), "nor are those of other sources"
        assert not module.compiles_anew([]), "nothing is needed"
    finally:
        module._cache_folder.cache_clear()


def test_a_package_that_cannot_be_written_is_never_new(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    monkeypatch.setattr(module.os, "access", lambda path, mode: False)
    assert not module.compiles_anew(["imaging"])


def test_a_folder_that_somebody_else_made_is_not_taken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where it exists and is read-only, that of NUMBA_CACHE_DIR is; where that is too, numba chooses."""
    package, given = tmp_path / "package", tmp_path / "given"
    (package / "imaging").mkdir(parents=True)
    monkeypatch.setattr(module, "PACKAGE", package)
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    own = module._folder("imaging")
    assert own is not None
    assert own.is_relative_to(package)
    monkeypatch.setattr(module.os, "access", lambda path, mode: not Path(path).is_relative_to(package))
    assert module._folder("imaging") is None
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(given))
    assert module._folder("imaging") == given / own.name


def test_where_nothing_can_be_written_kernels_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    real = numba.njit

    def refusing(**settings: object) -> object:
        if settings.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return real(**settings)

    monkeypatch.setattr(numba, "njit", refusing)

    @compiled
    def treble(value: float) -> float:
        return 3.0 * value

    assert treble(2.0) == 6.0


def test_a_function_outside_the_package_is_compiled_too() -> None:
    @compiled
    def double(values: np.ndarray) -> np.ndarray:
        return 2.0 * values

    np.testing.assert_array_equal(double(np.ones(3)), np.full(3, 2.0))


def test_a_reordered_sum_differs_by_roundings_and_is_the_same_each_time() -> None:
    @reordered
    def total(values):
        found = 0.0
        for value in values:
            found += value
        return found

    values = np.random.default_rng(3).normal(size=10_001)
    exact = math.fsum(values)
    assert abs(total(values) - exact) < 1e-12 * np.abs(values).sum()
    assert total(values) == total(values.copy())
