"""Grey levels from beyond the edge: which pixels are summed, and which are not believed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from wentry_cli.bench.contours import ours
from wentry_cli.bench.outline_cases import find_case
from wentry_cli.bench.outline_frames import bounds_of, draw_frame
from wentry_cli.contours.arc import arc_geometry, quadrant_table, sector_angles, semi_axes
from wentry_cli.contours.band import SECTOR_ANGLE, SECTOR_PX, ellipse_distance
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.likelihood import INSIDE, OUTSIDE, STATE
from wentry_cli.contours.plateau import INNER, LD, OUTER, D, L, N, evenness, sum_plateaus
from wentry_cli.contours.sectors import LEAST_PIXELS
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch

SHAPE = EllipseShape(130.3, 90.6, 60.0, 1.2)
NEAR, FAR = 4.5, 10.0


def distances(shape: EllipseShape = SHAPE, size: tuple[int, int] = (180, 260)) -> np.ndarray:
    a, b = shape.semi_across, shape.semi_along
    rows, columns = np.indices(size)
    return np.vectorize(lambda u, v: ellipse_distance(a, b, u, v)[0])(columns - shape.x, rows - shape.y)


def plateaus_of(values: np.ndarray, top_y: float = -math.inf) -> np.ndarray:
    vector = SHAPE.vector()
    count, table = quadrant_table(*semi_axes(vector), SECTOR_PX, SECTOR_ANGLE)
    rows = arc_geometry(vector, sector_angles(count, table))
    starts = 100 * np.arange(len(rows) + 1)  # plenty of pixels on every edge
    return sum_plateaus(values.astype(np.float32), rows, starts, (NEAR, FAR), (NEAR, FAR), top_y, LEAST_PIXELS)


def flat_scene(noise: float = 0.01) -> np.ndarray:
    levels = np.where(distances() > 0.0, 1.0, 0.08)
    return levels + np.random.default_rng(3).normal(0.0, noise, levels.shape)


def states(count: int) -> np.ndarray:
    state = np.zeros((count, STATE))
    state[:, INSIDE], state[:, OUTSIDE] = 0.08, 1.0
    return state


@pytest.mark.parametrize(("side", "sign"), [(INNER, -1.0), (OUTER, 1.0)])
def test_every_pixel_between_the_distances_is_summed_once(side, sign):
    away = distances()
    plateaus = plateaus_of(flat_scene())
    inside = (sign * away > NEAR) & (sign * away < FAR)
    assert plateaus[:, side, N].sum() == pytest.approx(inside.sum(), rel=0.02)
    assert plateaus[:, side, D].sum() == pytest.approx(away[inside].sum(), rel=0.02)


def test_moments_are_of_levels_and_distances():
    away = distances()
    plateaus = plateaus_of(1.0 + 1e-4 * away)[:, OUTER]
    seen = plateaus[plateaus[:, N] > 0.0]
    mean = seen[:, D] / seen[:, N]
    assert np.allclose(seen[:, L] / seen[:, N], 1.0 + 1e-4 * mean, atol=2e-6)
    assert np.all(seen[:, LD] > 0.0)


def test_rows_above_the_top_are_left_out():
    plateaus = plateaus_of(flat_scene(), top_y=SHAPE.y)
    assert plateaus[:, :, N].sum() == pytest.approx(0.5 * plateaus_of(flat_scene())[:, :, N].sum(), rel=0.03)


def test_a_dark_neighbour_is_left_out_and_nothing_else():
    values, away = flat_scene(), distances()
    rows, columns = np.indices(values.shape)
    values[(away > NEAR + 1.0) & (columns > SHAPE.x + 30.0) & (rows > SHAPE.y)] = 0.3
    before, after = plateaus_of(flat_scene())[:, OUTER, N], plateaus_of(values)[:, OUTER, N]
    left_out = (before > 0.0) & (after == 0.0)
    assert 0.1 < left_out.mean() < 0.25
    assert np.all(after[~left_out] == before[~left_out])


def test_a_level_that_goes_on_to_change_counts_for_little():
    away, plain = distances(), flat_scene()
    state, noise = states(plateaus_of(plain).shape[0]), np.full(2, 1e-4)
    assert evenness(plateaus_of(plain), state, INNER, noise) > 0.5
    lighter = plain + np.where(away < 0.0, -0.002 * away, 0.0)
    assert evenness(plateaus_of(lighter), state, INNER, noise) < 0.02


def test_the_slope_of_the_ground_is_no_unevenness():
    away = distances()
    plateaus = plateaus_of(flat_scene() + np.where(away > 0.0, 5e-4 * away, 0.0))
    state, noise = states(plateaus.shape[0]), np.full(2, 1e-4)
    known = state.copy()
    known[:, 4] = 5e-4
    assert evenness(plateaus, state, OUTER, noise) < 0.1
    assert evenness(plateaus, known, OUTER, noise) > 0.5


def test_the_bound_is_reached_within_a_tenth():
    case = find_case("λ 1.0")
    measure = ours("accurate", case)
    frames = [draw_frame(case, 606, number) for number in range(80)]
    error = np.array([measure(frame)[0][:3] - frame.truth[:3] for frame in frames])
    ratio = np.sqrt(np.mean(error**2, axis=0)) / bounds_of(case)[:3]
    assert np.sqrt(np.mean(ratio**2)) < 1.12


@pytest.mark.parametrize("motion", [(0.0, 3.6), (3.6, 0.0), (2.5, 2.5)])
def test_motion_moves_no_edge(motion):
    """The mean of a blurred ellipse over its way, drawn without the renderer, is found where its middle was."""
    size, blur, instants = (180, 260), 1.04, 25
    total = np.zeros(size)
    for share in (np.arange(instants) + 0.5) / instants - 0.5:
        moved = EllipseShape(SHAPE.x + share * motion[0], SHAPE.y + share * motion[1], SHAPE.radius, SHAPE.stretch)
        away = distances(moved, size)
        rows, columns = np.indices(size)
        u, v = (columns - moved.x) / moved.semi_across, (rows - moved.y) / moved.semi_along
        norm = np.hypot(u, v) + 1e-9
        speed = np.hypot(moved.semi_across * v / norm, moved.semi_along * u / norm)
        bend = moved.semi_across * moved.semi_along / speed**3
        near = ndtr((np.nan_to_num(away, nan=-50.0) + 0.5 * np.minimum(bend, 0.2) * blur**2) / blur)
        total += near / instants
    noise = np.random.default_rng(1).normal(0.0, 5e-4, size)
    values = (0.08 + 0.92 * total + noise).astype(np.float32)
    fit = fit_silhouette(Patch(values), SHAPE, top_y_px=SHAPE.y, motion_px=motion)
    assert fit.status == "ok"
    assert abs(fit.center_x_px - SHAPE.x) < 0.001
    assert abs(fit.center_y_px - SHAPE.y) < 0.001
    assert abs(fit.stretch - SHAPE.stretch) < 1.5e-5
