from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.imaging.background import build_background, cut_patch, steadied
from wentry_cli.imaging.ground import clean_level, fill_holes, relative_noise, sample_indices
from wentry_cli.imaging.samples import Samples

SHAPE = (120, 160)


def lamp() -> np.ndarray:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return 150.0 + 0.15 * x - 0.1 * y


def frame(x: float, y: float, radius: float, rng: np.random.Generator, noise: float = 0.01) -> np.ndarray:
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    cover = np.clip(radius - np.hypot(columns - x, rows - y) + 0.5, 0.0, 1.0)
    light = lamp() * (1.0 - 0.93 * cover)
    return np.clip(light + noise * lamp() * rng.normal(size=SHAPE), 0, 255).round().astype(np.uint8)


def level_of(samples: np.ndarray, noise: float) -> np.ndarray:
    return clean_level(samples, Samples.of(samples).blocks, noise)


@pytest.mark.parametrize("count", [1, 5, 28, 29, 400, 2000])
def test_samples_are_few_distinct_and_include_both_ends(count: int) -> None:
    chosen = sample_indices(count)
    assert chosen == sorted(set(chosen))
    assert len(chosen) <= 28
    assert (chosen[0], chosen[-1]) == (0, count - 1)


def test_a_moving_sphere_leaves_no_ghost() -> None:
    rng = np.random.default_rng(1)
    samples = np.stack([frame(80, 20 + 4 * k, 15, rng) for k in range(20)])
    ground = build_background(samples, 255.0)
    wrong = np.abs(ground.level / lamp() - 1)
    assert np.quantile(wrong, 0.99) < 0.015  # the noise of a few samples
    assert wrong.max() < 0.08
    assert ground.noise == pytest.approx(0.01, rel=0.4)  # grey levels are whole numbers


def test_a_sphere_that_hardly_moves_leaves_no_ghost() -> None:
    rng = np.random.default_rng(2)
    samples = np.stack([frame(80, 58 + 0.5 * k, 22, rng) for k in range(8)])
    ground = build_background(samples, 255.0)
    assert np.abs(ground.level[50:70, 70:90] / lamp()[50:70, 70:90] - 1).max() < 0.02


def test_one_clean_sample_is_enough() -> None:
    samples = np.full((12, 4, 5), 40, np.uint8)
    samples[3] = 200
    assert np.all(level_of(samples, 0.01) == 200)


def test_a_faint_shade_in_most_samples_does_not_darken_the_ground() -> None:
    rng = np.random.default_rng(8)
    samples = np.stack([frame(80, 20 + 4 * k, 15, rng, noise=0.03) for k in range(20)]).astype(float)
    samples[6:, 30:60, 20:60] *= 0.97
    level = level_of(samples.astype(np.uint8), 0.03)
    assert np.median(level[32:58, 22:58] / lamp()[32:58, 22:58]) == pytest.approx(1.0, abs=0.006)


@pytest.mark.parametrize("share", [0.03, 0.2])
def test_flicker_leaves_no_trace_where_samples_are_missing(share: float) -> None:
    rng = np.random.default_rng(9)
    light = 1.0 + share * np.cos(np.arange(20.0))
    samples = np.stack([frame(80, 20 + 4 * k, 15, rng) * light[k] for k in range(20)])
    level = level_of(samples.astype(np.uint8), 0.01) / lamp()
    assert float(np.median(level[:, :30])) == pytest.approx(float(np.median(level[30:90, 70:90])), abs=0.002)


def test_noise_is_that_of_plain_ground() -> None:
    rng = np.random.default_rng(3)
    samples = (1000.0 * (1 + 0.02 * rng.normal(size=(16, 90, 90)))).astype(np.uint16)
    assert relative_noise(samples) == pytest.approx(0.02, rel=0.15)


def test_holes_are_filled_from_their_surroundings() -> None:
    level = lamp().astype(np.float32)
    holed = level.copy()
    holed[40:60, 50:80] = np.nan
    assert np.abs(fill_holes(holed) / level - 1).max() < 1e-3


def test_clipped_light_gives_a_ceiling_and_open_light_none() -> None:
    bright = np.full((6, *SHAPE), 255, np.uint8)
    assert build_background(bright, 255.0).ceiling < 1.0
    assert build_background(bright // 2, 255.0).ceiling == float("inf")


def test_dark_and_hot_pixels_are_masked() -> None:
    samples = np.full((6, *SHAPE), 150, np.uint8)
    samples[:, 100:] = 3
    samples[:, 20, 30] = 250
    patch = cut_patch(samples[0], 0, 0, build_background(samples, 255.0))
    assert np.isnan(patch.values[110, 50])
    assert np.isnan(patch.values[20, 30])
    assert patch.values[50, 50] == pytest.approx(1.0)


def test_a_bright_sphere_becomes_dark_on_one() -> None:
    rng = np.random.default_rng(4)
    dark = [255 - frame(80, 20 + 4 * k, 15, rng).astype(int) for k in range(20)]
    samples = np.stack(dark).astype(np.uint8)
    ground = build_background(samples, 255.0, polarity="bright")
    patch = cut_patch(samples[10], 0, 0, ground)
    assert abs(float(np.median(patch.values[55:65, 75:85]))) < 0.1
    assert float(np.median(patch.values[:20])) == pytest.approx(1.0, abs=0.02)


def test_empty_frames_are_averaged() -> None:
    samples = np.stack([np.full(SHAPE, value, np.uint8) for value in (100, 110)])
    assert build_background(samples, 255.0, empty=True).level[5, 5] == pytest.approx(105.0)


def test_flicker_is_divided_out_and_steady_light_is_left_alone() -> None:
    rng = np.random.default_rng(5)
    samples = np.stack([frame(80, 20 + 4 * k, 15, rng) for k in range(20)])
    ground = build_background(samples, 255.0)
    one = cut_patch(samples[10], 0, 0, ground)
    shape = (80.0, 60.0, 15.0, 15.0)
    assert steadied(one, shape) is one
    dim = cut_patch((samples[10] * 0.9).astype(np.uint8), 0, 0, ground)
    assert float(np.median(steadied(dim, shape).values[:, :40])) == pytest.approx(1.0, abs=0.005)


def test_the_bright_core_of_a_cavity_is_not_taken_for_ground() -> None:
    """A place is dark in all frames until the cavity is there, which lets four fifths of the light through for good."""
    rng = np.random.default_rng(4)
    samples = np.stack([frame(20, 20, 6, rng) for _ in range(16)]).astype(float)
    samples[:4, 50:90, 60:100] *= 0.4  # a mirror image that hardly moves
    samples[4:, 50:90, 60:100] *= 0.8
    samples[:, 30:34] *= 0.5  # the surface, there all the time,
    samples[:, 90:110, 120:130] *= 0.8  # and something that stands in the picture
    ground = build_background(samples.round().astype(np.uint8), 255.0).level / lamp()
    assert np.abs(ground[50:90, 60:100] - 1.0).max() < 0.03
    assert ground[92:108, 122:128] == pytest.approx(0.8, abs=0.03)


def test_what_is_uncovered_late_is_ground_all_the_same() -> None:
    rng = np.random.default_rng(5)
    samples = np.stack([frame(80, 58, 22, rng) if k < 5 else frame(30, 90, 15, rng) for k in range(16)])
    spots = np.ones(SHAPE)
    spots[50:64:4, 70:90:4] = 0.9  # dust on the glass
    ground = build_background((samples * spots).round().astype(np.uint8), 255.0).level / lamp()
    assert ground[50:64:4, 70:90:4] == pytest.approx(0.9, abs=0.03)


def test_a_dark_plate_is_no_ground_that_was_seen_late() -> None:
    """Noise makes single places of it half as dark in the first frame as later."""
    rng = np.random.default_rng(6)
    samples = np.stack([frame(80, 20 + 2 * k, 12, rng) for k in range(16)]).astype(float)
    samples[:, 80:] = np.abs(samples[:, 80:] * 0.03 + 3.0 * rng.normal(size=samples[:, 80:].shape))
    ground = build_background(samples.round().astype(np.uint8), 255.0).level / lamp()
    assert ground[84:].max() < 0.2
