"""Error bars inside hold as often as they say, whether the truth is smooth or as rough as the smoother expects."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.kinematics import state_space
from wentry_cli.kinematics.roughness import bar_factors
from wentry_cli.kinematics.smoother import smooth_track

FRAMES, NOISE, STEP = 500, 1e-5, 5e-4
INNER = slice(60, FRAMES - 60)


def rough(random: np.random.Generator, bandwidth: float) -> np.ndarray:
    """Derivatives 0 to 2 per frame of a path whose third changes at random, in units of the noise."""
    step, unit = np.eye(4), np.zeros((4, 4))
    for i in range(4):
        for j in range(i + 1, 4):
            step[i, j] = step[i, j - 1] / (j - i)
    state_space.add_noise(unit, 1.0, bandwidth**-8)
    root, state, path = np.linalg.cholesky(unit), np.zeros(4), []
    for _ in range(FRAMES):
        state = step @ state + root @ random.normal(size=4)
        path.append(state[:3])
    return np.array(path)


def smooth(random: np.random.Generator) -> np.ndarray:
    """The same of two slow oscillations: nothing of them is beyond the bandwidth."""
    t, path = np.arange(FRAMES), np.zeros((FRAMES, 3))
    for rate in (2.0 * np.pi / 60.0, 2.0 * np.pi / 97.0):
        phase = rate * t + random.uniform(0.0, 2.0 * np.pi)
        path += 800.0 * np.stack([np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)], axis=1)
    return path


@pytest.mark.parametrize("kind", ["smooth", "rough"])
def test_bars_hold_as_often_as_they_say(kind: str) -> None:
    held, pulls, shares = [], [], []
    for seed in range(24):
        random = np.random.default_rng(seed)
        path = smooth(random) if kind == "smooth" else rough(random, 8.0)
        t, y = STEP * np.arange(FRAMES), NOISE * (path[:, 0] + random.normal(size=FRAMES))
        track = smooth_track(t, y, NOISE)
        frames, units = track.frames, NOISE / STEP ** np.arange(1, 3)
        error = np.stack([frames.velocity, frames.acceleration], axis=1) - units * path[:, 1:]
        pull = (error / np.stack([frames.velocity_unc, frames.acceleration_unc], axis=1))[INNER]
        held.append(np.mean(np.abs(pull) < 1.96, axis=0))
        pulls.append(np.sqrt(np.mean(pull**2, axis=0)))
        shares.append(track.rough)
    assert np.all(np.abs(np.mean(held, axis=0) - 0.95) < 0.02)
    assert np.all(np.abs(np.sqrt(np.mean(np.square(pulls), axis=0)) - 1.0) < 0.08)
    assert np.mean(shares) < 0.3 if kind == "smooth" else np.mean(shares) > 0.7


def test_what_is_known_before_and_at_an_event_stays_as_wide() -> None:
    random = np.random.default_rng(0)
    t, y = STEP * np.arange(FRAMES), NOISE * (smooth(random)[:, 0] + random.normal(size=FRAMES))
    event, reach = 100.3, 4.0
    track = smooth_track(t, y, NOISE, events_s=(event * STEP,))
    factors = bar_factors(track.mixture[0][1], t, track.events_s, reach, 0.0)
    assert np.all(factors[t <= (event + reach) * STEP] == 1.0)
    assert np.allclose(factors[200], np.sqrt([7 / 8, 5 / 8, 3 / 8]))
    assert factors[-1] == pytest.approx(1.0)
    assert np.all(bar_factors(track.mixture[0][1], t, track.events_s, reach, 1.0) == 1.0)
