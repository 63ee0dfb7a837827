"""The rays of a flank, and where an outline is said to leave the sphere."""

import math

import numpy as np
import pytest

from tests.contours.scenes import draw
from wentry_cli.contours.departure import waves_at
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.flank import SPACING_PX, Flank, both_flanks, off_outline, see, walk
from wentry_cli.contours.leaving import clings, first_departure
from wentry_cli.imaging.outer_edge import AT, UNSEEN

WAVES = (0.004, -0.003, 0.002, 0.001, -0.002, 0.001, 0.0, 0.001)
SHAPES = [
    EllipseShape(80.0, 90.0, 60.0),
    EllipseShape(80.0, 90.0, 30.0, 1.5, 8.0),
    EllipseShape(80.0, 90.0, 60.0, 0.8, -5.0),
]


def tilt_of(shape: EllipseShape) -> tuple[float, float]:
    return math.cos(math.radians(shape.tilt_deg)), math.sin(math.radians(shape.tilt_deg))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rays_begin_on_the_outline_equally_far_apart(shape, side):
    path = walk(shape.vector(), tilt_of(shape))[0 if side > 0 else 1]
    apart = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert apart == pytest.approx(SPACING_PX, rel=0.03)
    assert path[0, 1] == pytest.approx(shape.bottom_y, abs=1e-9)
    assert path[-1, 1] == pytest.approx(2.0 * shape.y - shape.bottom_y, abs=1.0)
    assert (side * (path[len(path) // 2, 0] - shape.x)) < 0.0
    for x, y, nx, ny in path:
        off, *normal = off_outline(shape.vector(), tilt_of(shape), x, y)
        assert off == pytest.approx(0.0, abs=1e-4)
        assert normal == pytest.approx([nx, ny], abs=1e-4)


def test_a_known_departure_moves_the_rays():
    shape = SHAPES[0]
    vector = shape.vector(departure=WAVES)
    path = walk(vector, tilt_of(shape))[0]
    x, y = path[:, 0] - shape.x, path[:, 1] - shape.y
    expected = 1.0 + waves_at(np.arctan2(x, y)) @ np.array(WAVES)
    assert np.hypot(x, y) / shape.radius == pytest.approx(expected, abs=1e-6)
    off = np.array([off_outline(vector, tilt_of(shape), *row[:2])[0] for row in path])
    assert off == pytest.approx(0.0, abs=0.01)


def flank_with(off: np.ndarray) -> Flank:
    """A flank on which everything has been seen."""
    found = np.stack([off, np.ones_like(off)], axis=1)
    path = np.stack([np.zeros(off.size), -SPACING_PX * np.arange(off.size)] + 2 * [np.zeros(off.size)], axis=1)
    return Flank(np.zeros((4, 4), np.float32), np.zeros(5), (1.0, 0.0), path, found, 0.5)


def outline(seed: int = 0, size: int = 120, base: float = 0.0) -> np.ndarray:
    return np.random.default_rng(seed).normal(base, 0.04, size)


@pytest.mark.parametrize("base", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize("leaves", [37, 60, 75])
def test_a_wall_is_found_where_it_leaves(leaves, base):
    for seed in range(5):
        off = outline(seed, base=base)
        off[leaves:] += 0.5 * np.arange(off.size - leaves)
        off[off > 10.0] = np.nan
        assert leaves <= first_departure(flank_with(off)) <= leaves + 2


def test_an_outline_that_stays_on_the_sphere_is_never_left():
    assert first_departure(flank_with(outline())) == -1


@pytest.mark.parametrize("begin", [20, 21, 22, 23])
def test_a_drop_is_passed_over(begin):
    off = outline(1)
    off[begin : begin + 12] += 5.0 * np.sin(np.linspace(0.2, 2.9, 12))
    assert first_departure(flank_with(off)) == -1
    off[80:] = np.nan
    assert first_departure(flank_with(off)) == 80


def test_a_drift_below_the_corner_is_a_wall_that_clings():
    off = outline(2)
    assert not clings(flank_with(off), 70)
    off[60:70] += 0.05 * np.arange(10)
    assert clings(flank_with(off), 70)


def test_few_rays_are_looked_along_to_find_the_departure():
    along = 60.0
    probe = draw(3, stretch=1.0, margin=40)
    row = probe.shape.y - probe.patch.y0 - 0.1 * along
    s = draw(3, stretch=1.0, margin=40, body={"separation_y_px": row, "cavity_flare": 0.4})
    for flank in both_flanks(s.patch.values, s.shape.vector(s.patch.x0, s.patch.y0)):
        at = first_departure(flank)
        assert flank.path[at, 1] == pytest.approx(row, abs=4.0)
        assert np.count_nonzero(flank.found[:, AT] != UNSEEN) < 0.6 * len(flank.path)
        see(flank, 0, len(flank.path), 1)
        assert not np.any(flank.found[:, AT] == UNSEEN)
        assert first_departure(flank) == at
