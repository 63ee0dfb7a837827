"""Cached kernels must not outlive the code that they call."""

from __future__ import annotations

import numpy as np

from wentry_cli import compiled as module
from wentry_cli.compiled import compiled


def test_the_cache_of_a_room_depends_on_the_rooms_it_imports() -> None:
    assert {"contours", "imaging"} <= module._closure("contours")
    assert "synthetic" not in module._closure("contours")


def test_a_change_in_a_callee_is_a_new_cache() -> None:
    folder = module.PACKAGE / "imaging"
    before = module._digest("contours")
    probe = folder / "zz_probe.py"
    probe.write_text("# a change in a room that contours imports\n")
    try:
        assert module._digest("contours") != before
    finally:
        probe.unlink()
    assert module._digest("contours") == before


def test_a_function_outside_the_package_is_compiled_too() -> None:
    @compiled
    def double(values: np.ndarray) -> np.ndarray:
        return 2.0 * values

    np.testing.assert_array_equal(double(np.ones(3)), np.full(3, 2.0))
