"""The ground under a sphere that never leaves its place, from what is seen around it."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.imaging.background import build_background
from wentry_cli.imaging.ground import fill_holes

SIZE, RADIUS = 120, 34.0
Y, X = np.mgrid[:SIZE, :SIZE]
AWAY = np.hypot(X - 59.5, Y - 59.5)


def light(bend: float) -> np.ndarray:
    """A lamp that falls off towards a corner, with a bend of a few periods across the picture."""
    x, y = X / SIZE - 0.5, Y / SIZE - 0.5
    even = 1.0 + 0.08 * x - 0.05 * y - 0.2 * (x * x + y * y)
    return np.asarray(190.0 * (even + bend * np.cos(7.0 * x + 1.0) * np.cos(5.0 * y - 0.5)), np.float32)


@pytest.mark.parametrize(("bend", "most"), [(0.0, 2e-5), (0.01, 1e-3)])
def test_what_bends_goes_on_into_a_hole(bend: float, most: float) -> None:
    """Six pixels within its rim, where the outline of the sphere that hides the ground is."""
    level = light(bend)
    filled = fill_holes(np.where(AWAY < RADIUS, np.float32(np.nan), level))
    seen = AWAY >= RADIUS
    assert np.array_equal(filled[seen], level[seen])
    rim = (AWAY < RADIUS) & (AWAY > RADIUS - 6.0)
    assert np.sqrt(np.mean((filled[rim] / level[rim] - 1.0) ** 2)) < most
    assert np.abs(filled / level - 1.0).max() < 10.0 * most


def test_noise_around_a_hole_is_not_followed_into_it() -> None:
    noisy = light(0.0) * (1.0 + 0.01 * np.random.default_rng(4).normal(size=(SIZE, SIZE))).astype(np.float32)
    filled = fill_holes(np.where(AWAY < RADIUS, np.float32(np.nan), noisy))
    within = AWAY < RADIUS - 1.0
    assert np.sqrt(np.mean((filled[within] / light(0.0)[within] - 1.0) ** 2)) < 0.003


def test_ground_is_seen_up_to_the_disc_that_hides_it() -> None:
    """A splash that closes over the sphere is dark where the disc was before; dust beside that disc stays."""
    rng = np.random.default_rng(6)
    dusty = light(0.0) * (1.0 - 0.05 * np.exp(-0.5 * ((X - 95.0) ** 2 + (Y - 59.0) ** 2)))
    samples = []
    for radius in [26.0] * 12 + [50.0] * 3:
        covered = 1.0 / (1.0 + np.exp((AWAY - radius) / 0.5))
        dark = 0.05 if radius < 30.0 else 0.3
        samples.append(dusty * (1.0 - (1.0 - dark) * covered) + 0.3 * rng.normal(size=AWAY.shape))
    ground = build_background(np.clip(np.rint(np.stack(samples)), 0, 255).astype(np.uint8), 255.0)
    assert ground.level[59, 95] / light(0.0)[59, 95] == pytest.approx(0.95, abs=0.005)
    assert np.abs(ground.level / dusty - 1.0)[AWAY < 31.0].max() < 0.01
