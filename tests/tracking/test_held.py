"""A sphere that hangs at first: which sightings are its fall."""

from __future__ import annotations

import math

import numpy as np

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.tracking.held import let_go, since
from wentry_cli.tracking.sighting import Sighting

RADIUS, NOISE = 50.0, 0.02
QUALITY = {"blur": 1.0, "arc": 1.0, "gated": 0.0, "residual": 0.01}


def sightings(rows: np.ndarray, *, wet_from: int = 1000) -> list[Sighting]:
    noisy = rows + NOISE * np.random.default_rng(5).normal(size=rows.size)
    fits = [assemble_fit(EllipseShape(0.0, y, RADIUS, 1.0), np.eye(5) * NOISE**2, QUALITY, "ok") for y in noisy]
    return [Sighting(frame, "ok", fit, wet=frame >= wet_from) for frame, fit in enumerate(fits)]


def test_the_release_by_the_clock_of_the_camera() -> None:
    """Frames that are not evenly spaced are no bend of the path."""
    time = np.cumsum(np.r_[0.3, np.where(np.arange(99) % 7, 1e-3, 2e-3)])
    since_release = np.maximum(time - 0.3602, 0.0)
    seen = sightings(100.0 + 0.5 * 20_000.0 * since_release**2)
    released = let_go(seen, time)
    assert abs(released - 0.3602) < 1.5e-3
    falling = since(seen, time, released)
    assert [item.frame for item in falling] == list(np.flatnonzero(time > released))


def test_a_fall_from_the_first_frame_on_and_what_is_below_the_surface() -> None:
    time = np.arange(60) / 1000.0
    fall = sightings(100.0 + 900.0 * time + 0.5 * 20_000.0 * time**2)
    assert let_go(fall, time) == -math.inf
    assert since(fall, time, -math.inf) == fall
    # a slow start in water is no release
    late = sightings(100.0 + 0.5 * 20_000.0 * np.maximum(time - 0.03, 0.0) ** 2, wet_from=5)
    assert let_go(late, time) == -math.inf
