from __future__ import annotations

import math

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.tilt import Tilt, identified_tilt


def seen(frame: int, tilt: float, unc: float = 0.05, stretch: float = 1.2, held: float = 0.0) -> Sighting:
    quality = {"blur": 1.0, "arc": 0.5, "gated": 0.0, "residual": 0.01}
    fit = assemble_fit(EllipseShape(0.0, 0.0, 50.0, stretch, held), np.eye(5) * 1e-4, quality, "ok")
    return Sighting(frame, "ok", fit._replace(seen_tilt_deg=tilt, seen_tilt_unc_deg=unc))


def test_frames_that_agree_make_a_tilt_that_does_harm() -> None:
    tilt = Tilt()
    assert (tilt.value, tilt.harmful_before) == (0.0, -1)
    for frame in range(3, 20):
        tilt.hear(seen(frame, 5.0 + 0.05 * (-1) ** frame))
    assert tilt.value == pytest.approx(5.0, abs=0.05)
    assert tilt.unc < 0.1
    assert tilt.harmful_before == 3


def test_a_frame_that_stands_out_hardly_counts() -> None:
    tilt = Tilt()
    for frame in range(20):
        tilt.hear(seen(frame, 0.02))
    tilt.hear(seen(20, 6.0))
    assert abs(tilt.value) < 0.2
    assert tilt.harmful_before == -1


def test_a_slow_turn_is_followed() -> None:
    tilt = Tilt()
    for frame in range(100):
        tilt.hear(seen(frame, 0.03 * frame))
    assert tilt.value == pytest.approx(0.03 * 99, abs=0.1)


def test_a_round_outline_tells_no_tilt() -> None:
    for stretch in (1.0, 1.005):
        fit = seen(0, 1.0, stretch=stretch).fit
        assert fit is not None
        assert all(math.isnan(value) for value in identified_tilt(fit))
    tilt = Tilt()
    tilt.hear(Sighting(0, "no_edge"))
    tilt.hear(seen(1, 1.0, unc=2.0))
    assert (tilt.value, tilt.frame) == (0.0, None)
