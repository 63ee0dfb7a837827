"""Rendered patches with known truth for the tests of the estimators (the renderer shares no formula with them)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wentry_cli.contours.bounds import visible_top
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.patch import Patch
from wentry_cli.synthetic.camera_noise import Sensor
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still


@dataclass(frozen=True)
class Scene:
    patch: Patch
    shape: EllipseShape
    top_y: float
    bottom_y: float


def draw(
    seed: int,
    *,
    radius: float = 60.0,
    stretch: float = 1.2,
    visible: float = 0.5,
    noise: float = 0.01,
    origin: tuple[int, int] = (40, 300),
    margin: int = 18,
    crop: float = 0.0,
    body: dict | None = None,
    light: dict | None = None,
) -> Scene:
    """A deformed sphere at a random sub-pixel place in a patch whose corner lies at ``origin`` of the full frame."""
    rng = np.random.default_rng(seed)
    across, along = radius * stretch + margin, radius / stretch**2 + margin
    x, y = across + rng.uniform(), along + rng.uniform()
    still_light = StillLight(**{"sensor": Sensor(12, 0.75, noise), **(light or {})})
    still_body = StillBody(x, y, radius, stretch, **(body or {}))
    size = (int(2 * along + 1), int(2 * across * (1.0 - crop) + 1))
    still = draw_still(still_body, still_light, size, rng)
    shape = EllipseShape(x + origin[0], y + origin[1], radius, stretch, still_body.tilt_deg)
    return Scene(
        Patch(np.ascontiguousarray(still.flat), *origin),
        shape,
        visible_top(shape, visible),
        still.bottom_y_px + origin[1],
    )


def nudged(shape: EllipseShape, off: float = 1.0, seed: int = 0) -> EllipseShape:
    """A guess: the truth, off by ``off`` pixels in a random direction and ``off`` percent of stretch."""
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    return EllipseShape(
        shape.x + off * np.cos(angle),
        shape.y + off * np.sin(angle),
        shape.radius,
        shape.stretch + 0.01 * off,
        shape.tilt_deg,
    )
