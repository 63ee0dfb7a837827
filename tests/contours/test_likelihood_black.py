"""Levels that noise brings below black are expected as the sensor shows them."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.contours.likelihood import cut_at_black


def test_a_level_near_black_is_expected_as_the_mean_of_what_the_sensor_shows() -> None:
    rng = np.random.default_rng(1)
    inside, outside, share = 0.05, 0.9, np.array([0.0, 0.1, 0.5])
    noise = np.array([0.06**2, 0.1**2])
    levels = inside + (outside - inside) * share
    sd = np.sqrt(noise[0] + (noise[1] - noise[0]) * share)
    shown = np.maximum(levels[:, None] + sd[:, None] * rng.normal(size=(3, 400_000)), 0.0).mean(axis=1)
    cut = levels.copy()
    cut_at_black(cut, share, noise)
    assert cut == pytest.approx(shown, abs=5e-4)
    assert cut[0] - levels[0] > 5e-3
    assert cut[2] == pytest.approx(levels[2], abs=1e-4)
