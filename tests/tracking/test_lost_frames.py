"""Frames lost without a gap in their numbers: found where the step is a whole number of steps, and not elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.tracking.lost_frames import LostFrames, lost_in_fall, lost_in_water

FALL = 0.005  # px per frame squared


def _fall(count: int, speed: float = 3.6, noise: float = 0.005) -> np.ndarray:
    n = np.arange(count)
    return 60.0 + speed * n + 0.5 * FALL * n**2 + noise * np.random.default_rng(1).normal(size=count)


def _renumbered(row: np.ndarray, lost: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    kept = np.delete(row, lost)
    return np.arange(kept.size), kept, np.full(kept.size, 0.005)


@pytest.mark.parametrize("find", [lambda *path: lost_in_fall(*path, FALL), lost_in_water])
def test_a_step_of_several_frames_is_found(find) -> None:
    assert find(*_renumbered(_fall(20), [])) == []
    assert find(*_renumbered(_fall(20), [10])) == [LostFrames(9, 10, 2)]
    assert find(*_renumbered(_fall(20), [1, 2, 3])) == [LostFrames(0, 1, 4)]


def test_two_losses_of_one_fall_are_found() -> None:
    found = lost_in_fall(*_renumbered(_fall(20), [5, 12, 13]), FALL)
    assert found == [LostFrames(4, 5, 2), LostFrames(10, 11, 3)]


@pytest.mark.parametrize("find", [lambda *path: lost_in_fall(*path, FALL), lost_in_water])
def test_what_is_no_loss_is_not_told(find) -> None:
    frames, row, unc = _renumbered(_fall(20), [])
    told_gap = np.delete(frames, [8, 9]), np.delete(row, [8, 9]), unc[2:]
    assert find(*told_gap) == []
    off = row + np.where(frames == 9, 3.6, 0.0)  # one frame in which something else was measured
    assert find(frames, off, unc) == []
    leap = row + np.where(frames > 9, 1.7, 0.0)  # no whole number of steps
    assert find(frames, leap, unc) == []
    noisy = row + np.random.default_rng(2).normal(size=20)
    assert find(frames, noisy, np.full(20, 1.0)) == []


def test_a_sphere_that_slows_down_is_no_loss() -> None:
    t = np.arange(60.0)
    row = 100.0 + 40.0 * np.log1p(t / 12.0) + 0.3 * np.sin(t / 4.0)
    assert lost_in_water(t, row, np.full(60, 0.005)) == []
