"""What is bright only since a cavity is there is no ground; what goes right across the picture is a surface."""

from __future__ import annotations

import numpy as np

from wentry_cli.imaging.ground import block_means
from wentry_cli.imaging.late_ground import false_ground


def scene(line: float, core: float) -> np.ndarray:
    """A ground of 180 with a surface in four rows and a disc below it."""
    level = np.full((160, 200), 180.0, np.float32)
    y, x = np.mgrid[:160, :200]
    level[np.hypot(x - 100, y - 100) < 20] = core
    level[40:44] = line
    return level


def test_the_core_of_a_cavity_is_no_ground() -> None:
    found = false_ground(scene(80.0, 160.0), block_means(scene(80.0, 20.0)))
    assert found[100, 100]
    assert not found[:60].any()


def test_a_surface_before_a_camera_that_shakes_is_ground() -> None:
    """In the first frame the rows at its edge are darker than in the brightest of all frames."""
    found = false_ground(scene(110.0, 160.0), block_means(scene(80.0, 20.0)))
    assert found[100, 100]
    assert not found[:60].any()


def test_the_edge_of_a_surface_above_a_mirror_image_is_ground() -> None:
    """The band ends within a block; a twin of the falling sphere covers the ground from there on in the first frame."""
    level = scene(80.0, 180.0)
    level[38:46] = 80.0
    first = level.copy()
    first[46:100, 80:120] = 70.0
    assert not false_ground(level, block_means(first)).any()


def test_the_core_of_a_cavity_below_the_edge_of_a_surface_is_no_ground() -> None:
    level = scene(80.0, 160.0)
    level[38:46] = 80.0
    first = level.copy()
    first[46:130, 75:125] = 70.0
    found = false_ground(level, block_means(first))
    assert found[100, 100]
    assert not found[:60].any()
