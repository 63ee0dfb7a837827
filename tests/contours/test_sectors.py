"""The noise of the pixels about each sector's own level, and which sectors do not look like an edge."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.contours.likelihood import GO, OO, STATE, SUMS, accumulate
from wentry_cli.contours.nuisances import noise_levels
from wentry_cli.contours.sectors import (
    GRADIENT,
    INSIDE,
    INV_S,
    LEAST_PIXELS,
    OUTSIDE,
    VERDICT,
    WEIGHT,
    hear_sectors,
    level_spread,
    weigh_sectors,
)

SECTORS, PIXELS, NOISE = 60, 24, 0.01
DARK, BRIGHT = 0.1, 1.0


def sums_of(
    rng: np.random.Generator,
    *,
    off: np.ndarray,
    extra: np.ndarray,
    noise: float = NOISE,
    shift: np.ndarray | None = None,
) -> np.ndarray:
    """Sums over an error-function edge whose inner level is wrong by ``off`` and noise larger by ``extra``.

    It lies ``shift`` (px) farther outside than expected.
    """
    from scipy.special import ndtr

    distance = np.tile(np.linspace(-5.0, 5.0, PIXELS), SECTORS)
    sector = np.repeat(np.arange(SECTORS), PIXELS)
    step = ndtr((distance - (0.0 if shift is None else shift[sector])) / 1.1)
    levels = DARK + (BRIGHT - DARK) * step + off[sector] * (1.0 - step)
    levels += noise * extra[sector] * rng.normal(size=levels.size)
    state = np.zeros((SECTORS, STATE))
    state[:, INV_S], state[:, INSIDE], state[:, OUTSIDE], state[:, GRADIENT] = 1.0 / 1.1, DARK, BRIGHT, 0.0
    sums = np.zeros((SECTORS, SUMS))
    starts = np.arange(0, SECTORS * PIXELS + 1, PIXELS)
    accumulate(np.stack([distance, levels]), starts, state, np.full(2, noise**2), np.inf, sums)
    return sums


def test_noise_is_that_of_the_pixels_not_of_a_level_that_is_not_right_yet() -> None:
    rng = np.random.default_rng(3)
    verdict, noise = np.zeros((SECTORS, VERDICT)), np.full(2, 1.0)
    verdict[:, WEIGHT] = 1.0
    noise_levels(sums_of(rng, off=np.full(SECTORS, 0.05), extra=np.ones(SECTORS)), verdict, noise)
    assert np.sqrt(noise) == pytest.approx([NOISE, NOISE], rel=0.2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_sector_is_left_out_by_how_unlikely_its_pixels_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    extra = np.ones(SECTORS)
    extra[[10, 40]] = 2.2  # chi square nearly five times the usual, sixteen standard deviations off
    verdict = np.zeros((SECTORS, VERDICT))
    spread = np.full(2, 1e-6)
    hear_sectors(sums_of(rng, off=np.zeros(SECTORS), extra=extra), spread, verdict, LEAST_PIXELS)
    weigh_sectors(verdict, 60.0, False, True, np.zeros(SECTORS))
    assert (verdict[[10, 40], WEIGHT] == 0.0).all()
    honest = np.delete(verdict[:, WEIGHT], [9, 10, 11, 39, 40, 41])
    assert np.mean(honest > 0.9) > 0.95
    assert (verdict[[9, 11, 39, 41], WEIGHT] <= 0.5).all()


def test_more_noise_everywhere_leaves_no_sector_out() -> None:
    rng = np.random.default_rng(4)
    verdict = np.zeros((SECTORS, VERDICT))
    hear_sectors(
        sums_of(rng, off=np.zeros(SECTORS), extra=np.full(SECTORS, 2.2)), np.full(2, 1e-6), verdict, LEAST_PIXELS
    )
    weigh_sectors(verdict, 60.0, False, True, np.zeros(SECTORS))
    assert np.mean(verdict[:, WEIGHT] > 0.9) > 0.95


def test_what_lies_farther_outside_is_doubted_more_where_much_is_hidden() -> None:
    shift = np.zeros(SECTORS)
    shift[20], shift[30] = 0.06, -0.06
    kept = {}
    for hidden in (0, 15):
        extra = np.ones(SECTORS)
        extra[40 : 40 + hidden] = 4.0
        weights = []
        for seed in range(20):
            verdict = np.zeros((SECTORS, VERDICT))
            sums = sums_of(np.random.default_rng(seed), off=np.zeros(SECTORS), extra=extra, shift=shift)
            hear_sectors(sums, np.full(2, 1e-6), verdict, LEAST_PIXELS)
            weigh_sectors(verdict, 60.0, False, False, np.zeros(SECTORS))
            weights.append(verdict[[20, 30], WEIGHT])
        kept[hidden] = np.mean(weights, axis=0)
    assert kept[0].min() > 0.3
    assert kept[15][0] < 0.6 * kept[0][0]
    assert kept[15][1] == pytest.approx(kept[0][1], abs=0.1)


def test_where_the_outline_is_not_known_a_sector_off_it_is_kept() -> None:
    shift = np.zeros(SECTORS)
    shift[[20, 40]] = 0.2
    verdict, loose = np.zeros((SECTORS, VERDICT)), np.zeros(SECTORS)
    hear_sectors(
        sums_of(np.random.default_rng(5), off=np.zeros(SECTORS), extra=np.ones(SECTORS), shift=shift),
        np.full(2, 1e-6),
        verdict,
        LEAST_PIXELS,
    )
    loose[20] = 0.1**2
    weigh_sectors(verdict, 60.0, False, False, loose)
    assert verdict[20, WEIGHT] == 1.0
    assert verdict[40, WEIGHT] == 0.0


def test_what_stands_before_the_ground_does_not_make_it_uneven() -> None:
    sums = sums_of(np.random.default_rng(6), off=np.zeros(SECTORS), extra=np.ones(SECTORS))
    spread = np.zeros(2)
    level_spread(sums, spread, 1e-3, LEAST_PIXELS)
    assert spread == pytest.approx([1e-6, 1e-6])  # the least
    hidden = np.arange(0, SECTORS, 2)
    for _ in range(2):
        sums[hidden, GO] -= 0.5 * sums[hidden, OO]
        hidden = np.arange(1, SECTORS, 6)
    level_spread(sums, spread, 1e9, LEAST_PIXELS)
    assert spread[1] > 0.1**2
    level_spread(sums, spread, 1e-3, LEAST_PIXELS)
    assert spread[1] == 1e-3
