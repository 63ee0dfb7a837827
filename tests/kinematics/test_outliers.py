"""What of the stated uncertainties scatters from frame to frame."""

from __future__ import annotations

import numpy as np
import pytest
from entry_truths import PX_PER_M, fall

from wentry_cli.kinematics.outliers import first_suspects, scattering

TIMES = np.arange(120.0) / 2000.0


def test_what_scatters_little_in_one_part_and_much_in_another() -> None:
    """One uncertainty is stated for all frames, most of it common to them."""
    true = np.where(TIMES < 0.03, 1e-4, 2e-3)
    ring = 1.5 + 0.5 * np.cos(2.0 * np.pi * TIMES / 0.06)
    found = scattering(TIMES, ring + true * np.random.default_rng(3).normal(size=120), np.full(120, 5e-3))
    assert np.median(found[:40]) == pytest.approx(1e-4, rel=0.4)
    assert np.median(found[80:]) == pytest.approx(2e-3, rel=0.3)


def test_a_frame_that_says_that_it_is_poor_stays_poor() -> None:
    stated = np.full(120, 4e-3)
    stated[50] = 9e-3
    found = scattering(TIMES, 1e-4 * np.random.default_rng(4).normal(size=120), stated)
    assert found[50] == pytest.approx(np.sqrt(9e-3**2 - 4e-3**2), rel=0.02)
    assert found[51] < 3e-4


def test_no_more_than_stated_scatters() -> None:
    noise = 1e-2 * np.random.default_rng(5).normal(size=120)
    assert np.all(scattering(TIMES, noise, np.full(120, 1e-3)) <= 1e-3)
    assert np.all(scattering(TIMES[:8], noise[:8], np.full(8, 1e-3)) == 1e-3)


@pytest.mark.parametrize(
    ("size_px", "wrong"),
    [
        (20.0, [0]),
        (20.0, [1]),
        (20.0, [338]),
        (20.0, [339]),
        (20.0, [39]),
        (20.0, [41]),
        (2.0, [63, 64, 66]),
        (20.0, [120, 121, 122, 123]),
        (20.0, [200, 202, 205]),
    ],
)
@pytest.mark.parametrize("kind", ["soft", "rigid"])
def test_gross_outliers_are_named_and_no_others(kind: str, size_px: float, wrong: list[int]) -> None:
    """At both ends of a record, beside the impact (frame 40.3) and close to each other."""
    truth = fall(kind)
    for seed in range(4):
        seen = truth.y + 2.5e-5 * np.random.default_rng(seed).normal(size=truth.t.size)
        seen[wrong] += size_px / PX_PER_M
        found = first_suspects(truth.t, seen, np.full(truth.t.size, 2.5e-5**2), np.zeros(1))
        assert np.flatnonzero(found).tolist() == wrong
