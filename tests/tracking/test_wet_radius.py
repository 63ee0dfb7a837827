"""The radius below the surface, pooled from frames that tell it."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.wet_radius import pool_sightings

RADIUS = 35.7


def free(radius: list[float], gated: float) -> list[Sighting]:
    quality = {"blur": 1.0, "arc": 0.55, "gated": gated, "residual": 0.01}
    fits = [assemble_fit(EllipseShape(80.0, 60.0, value), 4e-4 * np.eye(5), quality, "ok") for value in radius]
    return [Sighting(k, "ok", fit, free_fit=fit, wet=True) for k, fit in enumerate(fits)]


def noisy(count: int, spread: float) -> list[float]:
    return (RADIUS + spread * np.random.default_rng(3).normal(size=count)).tolist()


def test_frames_that_are_mostly_hidden_tell_the_radius_where_many_agree() -> None:
    led_astray = [37.0] * 12
    pooled = pool_sightings(free([*noisy(40, 0.02), *led_astray], 0.7), wet=True)
    assert pooled.value == pytest.approx(RADIUS, abs=0.02)
    assert 0.003 < pooled.unc < 0.03


def test_a_few_of_them_or_many_at_odds_tell_nothing() -> None:
    assert not pool_sightings(free(noisy(8, 0.02), 0.7), wet=True).known
    assert not pool_sightings(free(noisy(40, 0.5), 0.7), wet=True).known


def test_few_that_show_half_of_it_are_not_drowned_by_many_at_odds() -> None:
    both = [*free(noisy(3, 0.02), 0.4), *free(noisy(40, 0.5), 0.7)]
    assert pool_sightings(both, wet=True).count == 3
