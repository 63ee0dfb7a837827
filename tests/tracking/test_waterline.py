"""Which dark line is the free surface: the one at which the sphere stops falling whole and round."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.free_surface import SurfaceRow, find_surfaces
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.source import FrameArray
from wentry_cli.tracking.waterline import FirstChange, changes_far_above, choose_surface, first_change, follow_to_change

WATER, SEAM, RIM = 100.25, 160.5, 60.5
RADIUS, SPEED = 20.0, 4.0


def falling(frame: int) -> StillBody:
    """Round above the water; below it wider from frame to frame, and slower."""
    bottom = 46.0 + SPEED * frame
    if bottom <= WATER:
        return StillBody(80.3, bottom - RADIUS, RADIUS)
    deep = bottom - WATER
    stretch = 1.0 + 0.3 * math.sin(min(deep / 20.0, 1.2))
    return StillBody(80.3, WATER + 0.6 * deep - RADIUS / stretch**2, RADIUS, stretch)


def with_lines(count: int, lines: dict[float, float]) -> FrameArray:
    """A clip with dark lines across it: row and depth of each."""
    plain = clip(falling, count)
    y = np.arange(SHAPE[0])[:, None]
    shade = np.ones((SHAPE[0], 1))
    for row, depth in lines.items():
        shade *= 1.0 - depth * np.clip(2.0 - np.abs(y - row), 0.0, 1.0)
    return FrameArray(np.stack([np.round(plain.read(k) * shade) for k in range(count)]).astype(np.uint8))


def seed() -> Path:
    path = Path(RADIUS)
    for frame in (0, 1):
        path.add(frame, EllipseShape(80.3, 26.0 + SPEED * frame, RADIUS))
    return path


@pytest.mark.parametrize("other", [SEAM, RIM])
def test_a_darker_line_that_the_sphere_passes_unchanged_or_changed_is_not_the_surface(other: float) -> None:
    frames = with_lines(30, {WATER: 0.2, other: 0.6})
    ground = ground_of(frames)
    rows = find_surfaces(ground.level, rows=(40.0, 200.0))
    assert [row.y_px for row in rows] == pytest.approx([other, WATER], abs=0.3)
    change = follow_to_change(frames, ground, seed(), max(row.y_px for row in rows), 0.0)
    assert change.changed
    assert change.by_shape
    assert abs(change.whole_px - WATER) < 2.0 * SPEED
    (found,) = choose_surface(rows, change, RADIUS)
    assert found.y_px == pytest.approx(WATER, abs=0.3)


def test_a_seam_far_below_where_the_sphere_is_round_is_no_surface() -> None:
    frames = with_lines(30, {SEAM: 0.6})
    ground = ground_of(frames)
    (row,) = find_surfaces(ground.level, rows=(40.0, 200.0))
    change = follow_to_change(frames, ground, seed(), row.y_px, 0.0)
    assert choose_surface([row], change, RADIUS) == []


def line(y: float, contrast: float = 0.5) -> SurfaceRow:
    return SurfaceRow(y, 0.05, 3.0, contrast, "ok")


def test_a_cavity_hides_a_rigid_sphere_later_than_a_soft_one_is_deformed() -> None:
    rows = [line(100.0), line(200.0)]
    assert choose_surface(rows, FirstChange(122.0, 2.0, False, True), 20.0) == rows[:1]
    assert choose_surface(rows, FirstChange(122.0, 2.0, True, True), 20.0) == []


def test_without_a_change_the_order_of_the_lines_stays() -> None:
    rows = [line(100.0), line(200.0)]
    assert choose_surface(rows, first_change([]), 20.0) == rows
    assert not changes_far_above(rows[0], [], 20.0)
