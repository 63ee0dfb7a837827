"""Cavities drawn by supersampling, apart from the renderer and from the estimators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.profile import SphereOutline
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]
FINE = 5


@dataclass(frozen=True)
class Drawing:
    """A cavity of half-width ``half_width`` (row) above a sphere, with a bright core over ``core`` of its width."""

    half_width: Callable[[Floats], Floats]
    axis: float = 150.3
    surface: float = 30.0
    sphere: tuple[float, float, float] = (240.4, 50.0, 48.0)  # centre row, semi-axes across and along
    core: float = 0.6
    core_level: float = 0.85
    noise: float = 0.02
    blur: float = 0.95  # of the lens, px
    lamps: tuple[tuple[float, float, float, float], ...] = ()  # column, row, radius, level: inside the core
    bubbles: tuple[tuple[float, float, float], ...] = ()  # column, row, radius: outside
    shape: tuple[int, int] = (300, 300)

    def outline(self) -> SphereOutline:
        row, across, along = self.sphere
        return SphereOutline(self.axis, row, across, along)

    def patch(self, seed: int = 0) -> Patch:
        rows, columns = self.shape
        y = (np.arange(rows * FINE) + 0.5) / FINE - 0.5
        x = (np.arange(columns * FINE) + 0.5) / FINE - 0.5
        row, across, along = self.sphere
        off = np.abs(x - self.axis)[None, :]
        ball = ((x - self.axis) / across)[None, :] ** 2 + ((y - row) / along)[:, None] ** 2 < 1.0
        wide = np.where((y > self.surface - 20) & (y < row), self.half_width(y), 0.0)[:, None]
        image = np.ones((y.size, x.size), np.float32)
        image[off < wide] = 0.06
        image[(off < self.core * wide) & ~ball] = self.core_level
        for column, at, radius, level in self.lamps:
            blob = (x - column)[None, :] ** 2 + (y - at)[:, None] ** 2 < radius**2
            image[blob & (off < wide) & ~ball] = level
        for column, at, radius in self.bubbles:
            image[(x - column)[None, :] ** 2 + (y - at)[:, None] ** 2 < radius**2] = 0.2
        image[ball] = 0.05
        image[np.abs(y - self.surface) < 2.0] = 0.3
        coarse = image.reshape(rows, FINE, columns, FINE).mean(axis=(1, 3))
        blurred = cv2.GaussianBlur(coarse.astype(np.float32), (0, 0), self.blur)
        noise = np.random.default_rng(seed).normal(0.0, self.noise, blurred.shape)
        return Patch((blurred + noise).astype(np.float32))


@pytest.fixture
def drawing() -> type[Drawing]:
    return Drawing
