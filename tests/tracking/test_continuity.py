"""Sightings are judged by those before and after them: what no sphere can do is not called ok."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.tracking.continuity import without_unexplained
from wentry_cli.tracking.sighting import Sighting

RADIUS = 40.0
UNC = np.array([0.01, 0.015, 0.0, 3e-4, 0.0])
Motion = Callable[[int], tuple[float, float, float]]
GAP = [*range(30), *range(44, 70)]


def soft(frame: int) -> tuple[float, float, float]:
    """Axis, centre and stretch of a sphere that slows down, drifts and oscillates 24 frames long."""
    stretch = 1.0 + 0.2 * math.exp(-frame / 40.0) * math.sin(2.0 * math.pi * frame / 24.0)
    return 80.0 + 0.02 * frame, 50.0 + 160.0 * (1.0 - math.exp(-frame / 80.0)), stretch


def rigid(frame: int) -> tuple[float, float, float]:
    x, y, _ = soft(frame)
    return x, y, 1.0


def a_frame_is_lost(frame: int) -> tuple[float, float, float]:
    return soft(frame + (frame > 34))


def a_kink(frame: int) -> tuple[float, float, float]:
    """The seal of a cavity strikes the sphere: its speed halves within a frame."""
    x, y, stretch = soft(frame)
    return x, y - 0.6 * max(frame - 34, 0), stretch


def ringing(period: float) -> Motion:
    """A sphere that the impact makes ring for a few periods of so many frames."""

    def motion(frame: int) -> tuple[float, float, float]:
        x, y, _ = soft(frame)
        return x, y, 1.0 + 0.1 * math.exp(-frame / 6.0) * math.sin(2.0 * math.pi * frame / period)

    return motion


def seen(
    motion: Motion, frames: list[int], seed: int, wrong: dict[int, tuple[float, ...]] | None = None, *, noise: float = 1
) -> list[Sighting]:
    """Good sightings of a motion with noise; ``wrong`` is added to axis, centre and stretch of single frames."""
    rng = np.random.default_rng(seed)
    unc = noise * UNC * (1.0, 1.0, 0.0, float(motion is not rigid), 0.0)
    found = []
    for frame in frames:
        x, y, stretch = np.array(motion(frame)) + (wrong or {}).get(frame, (0.0, 0.0, 0.0))
        x, y, _, stretch, _ = np.array([x, y, RADIUS, stretch, 0.0]) + unc * rng.normal(size=5)
        quality = {"blur": 1.0, "arc": 0.5, "gated": 0.7, "residual": 0.01}
        fit = assemble_fit(EllipseShape(x, y, RADIUS, stretch), np.diag(unc**2), quality, "ok")
        found.append(Sighting(frame, "ok", fit, wet=True))
    return found


def refused(sightings: list[Sighting]) -> list[int]:
    return [item.frame for item in without_unexplained(sightings) if not item.ok]


@pytest.mark.parametrize("frames", [list(range(70)), GAP, list(range(0, 70, 3)), [3], [3, 4], [3, 4, 40, 41]])
@pytest.mark.parametrize("motion", [soft, rigid, a_frame_is_lost, a_kink])
def test_what_a_sphere_does_is_explained(motion: Motion, frames: list[int]) -> None:
    for seed in range(5):
        assert refused(seen(motion, frames, seed)) == []


@pytest.mark.parametrize("count", [30, 60, 300])
@pytest.mark.parametrize("period", [7.0, 8.0, 9.0, 10.0])
def test_a_sphere_that_oscillates_within_a_few_frames_is_explained(period: float, count: int) -> None:
    """However long the rest of the clip, in which nothing oscillates any more."""
    for seed in range(5):
        assert refused(seen(ringing(period), list(range(1, count)), seed, noise=0.3)) == []


@pytest.mark.parametrize(("first", "count"), [(3, 1), (3, 2), (6, 2), (12, 4), (40, 4)])
def test_what_lies_elsewhere_is_no_fast_oscillation(first: int, count: int) -> None:
    wrong = dict.fromkeys(range(first, first + count), (3.0, -4.0, 0.07))
    for seed in range(5):
        assert refused(seen(ringing(8.0), list(range(1, 60)), seed, wrong, noise=0.3)) == sorted(wrong)


@pytest.mark.parametrize(
    "wrong",
    [
        {20: (0.0, 0.0, 0.07)},
        {20: (0.0, 0.5, 0.0)},
        {20: (0.8, 0.0, 0.0)},
        {30: (3.0, -4.0, 0.07)},  # beside a gap
        {20: (3.0, -4.0, 0.07), 24: (3.0, -4.0, 0.07)},
        {20: (3.0, -4.0, 0.07), 21: (3.0, -4.0, 0.07), 22: (3.0, -4.0, 0.07)},
        {36: (3.0, -4.0, 0.07), 37: (3.1, -4.0, 0.07)},  # alone in the gap
        {0: (3.0, -4.0, 0.07)},
        {69: (3.0, -4.0, 0.07)},
    ],
)
def test_what_none_does_is_not(wrong: dict[int, tuple[float, ...]]) -> None:
    for seed in range(5):
        for motion in (soft, rigid) if all(stretch == 0.0 for *_, stretch in wrong.values()) else (soft,):
            frames = sorted({*GAP, *wrong})
            assert refused(seen(motion, frames, seed, wrong)) == sorted(wrong)


@pytest.mark.parametrize("count", [5, 6, 8, 12])
def test_of_few_frames_no_good_one_goes(count: int) -> None:
    for seed in range(5):
        assert set(refused(seen(soft, list(range(count)), seed, {2: (6.0, 0.0, 0.2)}))) <= {2}


def test_what_is_refused_is_a_poor_fit_and_the_rest_is_as_it_was() -> None:
    before = seen(soft, list(range(40)), 1, {20: (0.0, 0.0, 0.07)})
    after = without_unexplained(before)
    assert after[20] == Sighting(20, "poor_fit", wet=True)
    assert all(one is other for one, other in zip(before, after, strict=True) if one.frame != 20)


def test_the_larger_its_uncertainty_the_more_a_frame_may_be_off() -> None:
    doubtful = seen(soft, list(range(40)), 1, {20: (0.0, 0.0, 0.03)})
    fit = doubtful[20].fit
    assert fit is not None
    doubtful[20] = doubtful[20]._replace(fit=fit._replace(covariance=fit.covariance * 100.0**2))
    assert refused(doubtful) == []
