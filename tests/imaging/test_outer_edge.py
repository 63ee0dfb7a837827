"""The outermost edge on a ray against the candidates that the general search gives."""

import math

import numpy as np
import pytest
from scipy.special import ndtr

from wentry_cli.imaging.edges import edge_candidates
from wentry_cli.imaging.outer_edge import AT, HEIGHT, UNSEEN, outer_edges

SPAN = (-8.0, 17)


def rings(seed: int, noise: float = 0.02) -> np.ndarray:
    """A dark disc, a thin lighter ring round it and another dark one, in a noisy picture."""
    rows, columns = np.indices((80, 90))
    away = np.hypot(columns - 45.3, rows - 40.8)
    levels = 0.1 + 0.5 * ndtr(away - 20.0) - 0.4 * ndtr(away - 23.5) + 0.8 * ndtr(away - 26.0)
    return np.asarray(levels + np.random.default_rng(seed).normal(0.0, noise, levels.shape), np.float32)


def fan(seed: int, radius: float = 22.0, number: int = 60) -> np.ndarray:
    angle = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, number)
    return np.stack([45.3 + radius * np.cos(angle), 40.8 + radius * np.sin(angle), np.cos(angle), np.sin(angle)], 1)


def look(values: np.ndarray, rays: np.ndarray, least: float, span: tuple[float, int] = SPAN) -> np.ndarray:
    found = np.full((len(rays), 2), UNSEEN)
    outer_edges(values, rays, (0, len(rays), 1), span, least, found)
    return found


def outermost(values: np.ndarray, rays: np.ndarray, least: float) -> np.ndarray:
    at, height, _ = edge_candidates(values, rays, 8.0, 1.0, 1)
    return np.where(height >= least, at, -np.inf).max(axis=1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("radius", [22.0, 32.0])
def test_it_is_the_outermost_of_the_candidates(seed, radius):
    """Also where a ray leaves the picture, as those at 32 px from the centre do."""
    values, rays = rings(seed), fan(seed, radius)
    expected = outermost(values, rays, 0.15)
    expected[np.isneginf(expected)] = np.nan
    assert look(values, rays, 0.15)[:, AT] == pytest.approx(expected, abs=1e-3, nan_ok=True)
    assert np.isfinite(expected).sum() > 20


def test_masked_samples_are_filled_in_alike():
    values, rays = rings(5), fan(5)
    values[np.random.default_rng(5).random(values.shape) < 0.02] = np.nan
    expected = outermost(values, rays, 0.15)
    expected[np.isneginf(expected)] = np.nan
    assert look(values, rays, 0.15)[:, AT] == pytest.approx(expected, abs=1e-3, nan_ok=True)


def test_the_height_is_that_of_the_highest_edge():
    values, rays = rings(1, noise=0.0), fan(1)
    _, height, _ = edge_candidates(values, rays, 8.0, 1.0, 1)
    found = look(values, rays, math.inf)
    assert found[:, HEIGHT] == pytest.approx(height[:, 0], abs=1e-4)
    assert np.isnan(found[:, AT]).all()


def test_only_rays_that_are_asked_for_and_unseen_are_looked_along():
    values, rays = rings(2), fan(2)
    found = np.full((len(rays), 2), UNSEEN)
    found[4] = 1.25, 3.0
    outer_edges(values, rays, (2, 20, 2), SPAN, 0.15, found)
    looked = found[:, AT] != UNSEEN
    assert np.flatnonzero(looked).tolist() == list(range(2, 20, 2))
    assert found[4].tolist() == [1.25, 3.0]
    assert found[6] == pytest.approx(look(values, rays, 0.15)[6])


def test_a_ray_outside_of_the_picture_shows_nothing():
    found = look(rings(3), np.array([[500.0, 40.0, 1.0, 0.0]]), 0.1)
    assert np.isnan(found[0, AT])
    assert found[0, HEIGHT] == 0.0
