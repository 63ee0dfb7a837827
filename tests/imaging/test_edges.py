"""Edge samples along rays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr

from wentry_cli.imaging.edges import edge_candidates
from wentry_cli.imaging.ray_profiles import sample_ray, sample_rays


def step_image(place: float, blur: float = 1.0, low: float = 0.1, high: float = 1.0):
    """A vertical edge: dark on the left of column ``place``."""
    columns = np.arange(60.0)
    return np.tile(low + (high - low) * ndtr((columns - place) / blur), (40, 1)).astype(np.float32)


@given(place=st.floats(27.0, 33.0), half=st.sampled_from([5.0, 9.0]))
def test_a_step_is_found_where_it_is(place, half):
    rays = np.array([[30.0, 20.0, 1.0, 0.0]])
    at, height, _ = edge_candidates(step_image(place), rays, half, 0.5, 3)
    assert at[0, 0] == pytest.approx(place - 30.0, abs=0.01)
    assert height[0, 0] == pytest.approx(0.75, abs=0.2)
    assert np.isnan(at[0, 1])


@given(angle=st.floats(-1.2, 1.2))
def test_the_position_runs_along_the_ray(angle):
    rays = np.array([[30.0, 20.0, math.cos(angle), math.sin(angle)]])
    at, _, _ = edge_candidates(step_image(31.0), rays, 6.0, 1.0, 1)
    assert at[0, 0] * math.cos(angle) == pytest.approx(1.0, abs=0.06)


def test_bright_to_dark_is_no_edge():
    rays = np.array([[30.0, 20.0, -1.0, 0.0]])
    at, height, _ = edge_candidates(step_image(30.0), rays, 8.0, 1.0, 1)
    assert height.max() < 0.01 or np.isnan(at).all()


def test_two_edges_come_strongest_first():
    image = step_image(24.0, high=0.5) + step_image(36.0, low=0.0, high=0.9) - np.float32(0.1)
    at, height, _ = edge_candidates(image, np.array([[30.0, 20.0, 1.0, 0.0]]), 10.0, 1.0, 1)
    assert at[0, :2] == pytest.approx([6.0, -6.0], abs=0.1)
    assert height[0, 0] > height[0, 1]


def test_masked_and_missing_samples():
    image = step_image(30.0)
    image[:, 33:] = math.nan
    at, _, _ = edge_candidates(image, np.array([[30.0, 20.0, 1.0, 0.0]]), 5.0, 1.0, 1)
    assert at[0, 0] == pytest.approx(0.0, abs=0.3)
    at, _, noise = edge_candidates(
        np.full((40, 60), math.nan, np.float32), np.array([[30.0, 20.0, 1.0, 0.0]]), 5.0, 1.0, 1
    )
    assert np.isnan(at).all()
    assert math.isnan(noise)


def test_noise_of_a_profile():
    rng = np.random.default_rng(0)
    image = rng.normal(0.5, 0.03, (200, 200)).astype(np.float32)
    angle = np.linspace(0, 2 * np.pi, 64)
    rays = np.stack([np.full(64, 100.0), np.full(64, 100.0), np.cos(angle), np.sin(angle)], axis=1)
    _, _, noise = edge_candidates(image, rays, 10.0, 1.0, 1)
    assert 0.015 < noise < 0.045


def test_between_pixels():
    image = np.array([[0.0, 1.0], [2.0, 3.0]], np.float32)
    profile = np.empty(1)
    for column, row, value in ((0.5, 0.5, 1.5), (1.0, 1.0, 3.0)):
        assert sample_ray(image, np.array([column, row, 1.0, 0.0]), 0.0, 1.0, 1, profile) == (0, 0)
        assert profile[0] == pytest.approx(value)
    assert sample_ray(image, np.array([1.2, 0.5, 1.0, 0.0]), 0.0, 1.0, 1, profile) == (0, -1)


@pytest.mark.parametrize("lines", [1, 3])
def test_all_rays_at_once_are_as_one_by_one(lines):
    rng = np.random.default_rng(3)
    image = rng.uniform(size=(50, 70)).astype(np.float32)
    image[40:48, 20:24] = math.nan
    angle = np.linspace(0.0, 2.0 * math.pi, 40)
    # some leave the picture, some meet the hole, one lies outside
    rays = np.stack([35.0 + 31.0 * np.cos(angle), 25.0 + 20.0 * np.sin(angle), np.cos(angle), np.sin(angle)], axis=1)
    rays[7, :2] = 500.0, -30.0
    profiles, ends = sample_rays(image, rays, 6.0, 0.5, lines, 25)
    one = np.empty(25)
    for k, ray in enumerate(rays):
        assert sample_ray(image, ray, 6.0, 0.5, lines, one) == tuple(ends[k])
        assert profiles[:, k] == pytest.approx(one, abs=1e-4, nan_ok=True)
    assert tuple(ends[7]) == (0, -1)
    assert 5 < sum(tuple(end) == (0, 24) for end in ends) < 35
