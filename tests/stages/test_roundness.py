"""A picture that is drawn out in one direction, and spheres that are not."""

from __future__ import annotations

import numpy as np
import pytest
from drop_fixtures import make_drop

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.stages.track.roundness import oblateness, with_doubted_pixels
from wentry_cli.stages.track.scales import Scales
from wentry_cli.tracking.sighting import Sighting

NOISE = 2e-4
QUALITY = {"blur": 1.0, "arc": 1.0, "gated": 0.0, "residual": 0.01}


def sightings(stretch: np.ndarray) -> list[Sighting]:
    seen = stretch + NOISE * np.random.default_rng(1).normal(size=stretch.size)
    fits = [assemble_fit(EllipseShape(0.0, 0.0, 50.0, one), np.eye(5) * NOISE**2, QUALITY, "ok") for one in seen]
    return [Sighting(frame, "ok", fit) for frame, fit in enumerate(fits)]


@pytest.mark.parametrize("wider", [0.02, -0.02, 0.1])
def test_pixels_that_are_not_square_are_told_and_doubted(wider: float, caplog: pytest.LogCaptureFixture) -> None:
    off = oblateness(sightings(np.full(12, (1.0 + wider) ** (1.0 / 3.0))))
    assert (1.0 + off) ** 3 - 1.0 == pytest.approx(wider, abs=1e-3)
    scales = with_doubted_pixels(make_drop(), Scales(1800.0, 1.0, 1850.0, 2.0, "diameter"), off)
    # the height of a picture that is drawn out across is right, and all of the error is in the radius
    assert scales.air_unc / 1800.0 == pytest.approx(2.0 / 3.0 * abs(wider), rel=0.1)
    assert f"{abs(wider):.1%} {'wider than high' if wider > 0 else 'higher than wide'}" in caplog.text


def test_a_round_sphere_and_one_that_rings_are_not(caplog: pytest.LogCaptureFixture) -> None:
    assert oblateness(sightings(np.ones(12))) == 0.0
    assert oblateness(sightings(np.full(12, 1.004))) == 0.0  # moulded no better than that
    assert oblateness(sightings(1.0 + 0.02 * np.cos(np.arange(12) / 4.0))) == 0.0
    assert oblateness(sightings(np.full(3, 1.02))) == 0.0
    scales = Scales(1800.0, 1.0, 1850.0, 2.0, "diameter")
    assert with_doubted_pixels(make_drop(), scales, 0.0) == scales
    assert not caplog.text
