"""What of the edge of a ball is the same in all frames, and what changes."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.bench.ball import FULL_SCALE, _changing_share
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch


def frame(number: int, texture_px: float) -> np.ndarray:
    """A dark ball with waves on its edge that move with it, read noise, 12 bit."""
    y, x = np.mgrid[:200, :200].astype(float)
    dx, dy = x - 100.3, y - 92.0 - 2.65 * number
    edge = 62.0 + texture_px * np.cos(17.0 * np.arctan2(dy, dx)) - np.hypot(dx, dy)
    light = 3000.0 - 2700.0 * np.clip(0.5 + 0.5 * edge, 0.0, 1.0)
    noise = np.random.default_rng(number).normal(0.0, 30.0, light.shape)
    return np.clip(light + noise, 0, FULL_SCALE - 1).astype(np.uint16)


@pytest.mark.parametrize(("texture_px", "least", "most"), [(0.0, 0.85, 1.1), (0.3, 0.05, 0.35)])
def test_texture_that_moves_with_the_ball_does_not_change(texture_px: float, least: float, most: float) -> None:
    frames = [frame(number, texture_px) for number in range(8)]
    fits = []
    for number, levels in enumerate(frames):
        patch = Patch((levels / FULL_SCALE).astype(np.float32))
        fits.append(fit_silhouette(patch, EllipseShape(100.0, 92.0 + 2.65 * number, 62.0), free="x y R stretch"))
        assert fits[-1].status == "ok"
    assert least < _changing_share(frames, fits) < most
