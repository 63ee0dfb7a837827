"""The empty scene: what each pixel shows without the sphere, built from frames in which the sphere moves about."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.clean_mean import BLOCK_PX, clean_mean
from wentry_cli.imaging.order_statistics import rank_and_next

# The mean of this share of the smallest absolute values of a normal distribution, over its standard deviation.
LOWER_SHARE, LOWER_MEAN = 0.8, 0.5586
LEAST_SHADE = 0.004
OVERLAP = 3  # blocks each way of which the means are: every third of them tells all there is
LEAST_FLICKER, MOST_FLICKER = 0.003, 0.3  # of the usual light
ALIKE, MOST_ALIKE = 0.01, 0.4
# Blocks across a hole, in which light that bends more than a quadratic surface is followed, and how stiffly.
ACROSS_HOLE, STIFFNESS, FEWEST_BENT = 16, 10.0, 12


def sample_indices(count: int, limit: int = 28) -> list[int]:
    """Choose at most ``limit`` of ``count`` frames, densest at the start where the sphere still flies."""
    if count <= limit:
        return list(range(count))
    spread = (count - 1) * np.linspace(0.0, 1.0, limit) ** 2
    chosen: list[int] = []
    for index in np.round(spread):
        chosen.append(max(int(index), chosen[-1] + 1) if chosen else 0)
    return chosen


def relative_noise(samples: NDArray[Any]) -> float:
    """Standard deviation of bright pixels from frame to frame over their level, from a coarse grid; 0 where clipped.

    The mean of the lower part of the absolute differences of consecutive samples ignores the few pixels over which
    something moved; a median would count in whole grey levels. 0 too where nothing is bright.
    """
    grid = np.asarray(samples[:, ::9, ::9], dtype=np.float32)
    if len(grid) < 2:
        return 0.0
    level = np.max(grid, axis=0)
    bright = (level > 0.0) & (level >= 0.7 * np.percentile(level, 80))
    steps = (np.abs(np.diff(grid, axis=0))[:, bright] / level[bright]).ravel()
    number = int(LOWER_SHARE * steps.size)
    if number == 0:
        return 0.0
    lower = np.partition(steps, number)[:number]
    return float(np.mean(lower) / (LOWER_MEAN * np.sqrt(2.0)))


def block_means(image: NDArray[Any]) -> NDArray[np.float32]:
    """Means over blocks of ``BLOCK_PX`` each way, of grey levels whole ones; those at the end may reach beyond."""
    rows, columns = image.shape
    means = np.empty((-(-rows // BLOCK_PX), -(-columns // BLOCK_PX)), np.float32)
    beyond = means.shape[0] * BLOCK_PX - rows, means.shape[1] * BLOCK_PX - columns
    whole = cv2.copyMakeBorder(image, 0, beyond[0], 0, beyond[1], cv2.BORDER_REPLICATE) if any(beyond) else image
    _block_means(np.ascontiguousarray(whole), means)
    return np.rint(means, out=means) if image.dtype.kind == "u" else means


@compiled
def _block_means(image: NDArray[Any], means: NDArray[np.float32]) -> None:
    for row in range(means.shape[0]):
        target = means[row, :]
        target[:] = 0.0
        for line in range(BLOCK_PX * row, BLOCK_PX * row + BLOCK_PX):
            source = image[line, :]
            for column in range(target.size):
                block = np.float32(0.0)
                for near in range(BLOCK_PX):
                    block += np.float32(source[BLOCK_PX * column + near])
                target[column] += block
        for column in range(target.size):
            target[column] *= np.float32(1.0 / BLOCK_PX**2)


def flicker(coarse: NDArray[np.float32]) -> NDArray[np.float32]:
    """How bright the light is in each sample, 1 on the average: what the brighter blocks say of each of them.

    Shade and spray darken the others. All are 1 where the light is steady, and one is where it is off by more than a
    lamp flickers: something else fills the picture.
    """
    usual = np.empty(coarse.shape[1:], np.float32)
    _middle(coarse, usual)
    bright = usual > 0.7 * np.percentile(usual, 80)
    if not bright.any():
        return np.ones(len(coarse), np.float32)
    light, alike = _brightness(coarse, usual, bright)
    light = np.where((alike > MOST_ALIKE) & (np.abs(light - 1.0) < MOST_FLICKER), light, 1.0)
    steady = float(np.std(light)) < LEAST_FLICKER
    return np.asarray(np.ones(len(coarse)) if steady else light / np.mean(light), np.float32)


@compiled
def _largest_last(values: NDArray[np.float32], number: int) -> None:
    """Put the ``number`` largest of every column in order at its end: all columns at once, by vector instructions."""
    for last in range(values.shape[0] - 1, values.shape[0] - 1 - number, -1):
        for index in range(last):
            low, high = values[index, :], values[index + 1, :]
            for column in range(values.shape[1]):
                one, other = low[column], high[column]
                low[column], high[column] = min(one, other), max(one, other)


@compiled
def _middle(coarse: NDArray[np.float32], usual: NDArray[np.float32]) -> None:
    """Median over the samples of every block."""
    count, half = coarse.shape[0], coarse.shape[0] // 2
    for row in range(usual.shape[0]):
        ordered = coarse[:, row, :].copy()
        _largest_last(ordered, min(count, count - half + 1))
        for column in range(usual.shape[1]):
            upper = ordered[half, column]
            usual[row, column] = upper if count % 2 else (ordered[half - 1, column] + upper) / np.float32(2.0)


@compiled
def _brightness(
    coarse: NDArray[np.float32], usual: NDArray[np.float32], bright: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Upper quartile of how bright the bright blocks of each sample are, and the share of them that are like it."""
    light, alike = np.empty(coarse.shape[0], np.float32), np.empty(coarse.shape[0])
    ratio = np.empty(usual.size, np.float32)
    for index in range(coarse.shape[0]):
        number = 0
        for row in range(usual.shape[0]):
            for column in range(usual.shape[1]):
                if bright[row, column]:
                    ratio[number] = coarse[index, row, column] / usual[row, column]
                    number += 1
        place = 0.75 * (number - 1)
        share = np.float32(place - int(place))
        lower, upper = rank_and_next(ratio, number, int(place))
        apart = np.float32(upper) - np.float32(lower)
        if share < 0.5:
            light[index] = np.float32(lower) + apart * share
        else:  # as numpy does it
            light[index] = np.float32(upper) - apart * (np.float32(1.0) - share)
        near = 0
        for n in range(number):
            near += 1 if abs(ratio[n] - light[index]) < np.float32(ALIKE) else 0
        alike[index] = near / number
    return light, alike


@compiled
def _unshaded(coarse: NDArray[np.float32], light: NDArray[np.float32], share: np.float32) -> None:
    """Turn ``coarse`` (samples, blocks down and across) into 1, and 0 where darker than ``share`` of the brightest.

    There a sample shows spray or the rim of a shadow, which no single pixel tells from noise. The third brightest
    counts, or the brightest of fewer than three.
    """
    count, columns = coarse.shape[0], coarse.shape[2]
    even = np.empty((count, columns), np.float32)
    chosen = count - 3 if count >= 3 else count - 1
    for row in range(coarse.shape[1]):
        for index in range(count):
            source, target = coarse[index, row, :], even[index, :]
            for column in range(columns):
                target[column] = source[column] / light[index]
        ordered = even.copy()
        _largest_last(ordered, count - chosen)
        for index in range(count):
            level, bright, target = even[index, :], ordered[chosen, :], coarse[index, row, :]
            for column in range(columns):
                target[column] = np.float32(0.0) if level[column] < share * bright[column] else np.float32(1.0)


def clean_level(samples: NDArray[Any], blocks: NDArray[np.float32], noise: float) -> NDArray[np.float32]:
    """Level of the empty scene: per pixel the mean of the samples that are as bright as the third brightest.

    ``samples`` is (frames, rows, columns) of grey levels, 0 where a sample is known to be covered, ``blocks`` holds
    their ``block_means``; ``noise`` is relative. Samples darker than those by more than 4.5 standard deviations show
    something else (sphere, cavity, droplets) and are left out, of the pixel or of a dozen pixels each way, so that one
    clean sample is enough and many give an unbiased mean. The light may flicker from sample to sample. NaN where every
    sample is covered.
    """
    coarse = np.empty_like(blocks)  # means over a dozen pixels each way
    for means, target in zip(blocks, coarse, strict=True):
        cv2.blur(means, (OVERLAP, OVERLAP), dst=target)
    light = flicker(np.ascontiguousarray(coarse[:, ::OVERLAP, ::OVERLAP]))
    shade = max(4.5 * noise / (OVERLAP * BLOCK_PX), LEAST_SHADE)
    _unshaded(coarse, light, np.float32(1.0 - shade))
    return clean_mean(samples, light, coarse, max(4.5 * noise, 0.02))


def fill_holes(level: NDArray[np.float32], *, bent: bool = True) -> NDArray[np.float32]:
    """Fill the pixels that were never seen (NaN) with a surface that goes on smoothly from their surroundings.

    It is a quadratic one and, with ``bent``, what bends otherwise: under a sphere that stays where it is, as seen from
    above, a surface that is off by half a percent at the rim of the hole would make its outline a thousandth of a pixel
    too small.
    """
    unknown = np.isnan(level)
    if not unknown.any() or unknown.all():
        return level
    filled = level.copy()
    count, labels, stats, _ = cv2.connectedComponentsWithStats(unknown.astype(np.uint8))
    for label in range(1, count):
        left, top, width, height = (int(value) for value in stats[label][:4])
        margin = max(6, width // 4, height // 4)
        rows = slice(max(0, top - margin), top + height + margin)
        columns = slice(max(0, left - margin), left + width + margin)
        block = level[rows, columns]
        surface = _continued(block, max(width, height) // ACROSS_HOLE if bent else 0)
        filled[rows, columns] = np.where(labels[rows, columns] == label, surface, filled[rows, columns])
    return filled


def _continued(block: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """A smooth surface through the bright pixels of a block, NaN left out.

    ``step`` is the size of what bends otherwise than a quadratic surface, px; 0 where the hole is too small for it.
    """
    known = ~np.isnan(block)
    bright = known & (block > 0.7 * np.nanpercentile(block, 80)) if known.any() else known
    if np.count_nonzero(bright) < 30:
        return np.full(block.shape, np.nanmean(block) if known.any() else 1.0, np.float32)
    quadratic = _quadratic(block, bright)
    if step == 0:
        return quadratic
    size = max(1, block.shape[1] // step), max(1, block.shape[0] // step)
    left = np.where(bright, block - quadratic, np.float32(0.0))
    share, mean = (cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in (bright.astype(np.float32), left))
    seen = share > 0.5
    if np.count_nonzero(seen) < FEWEST_BENT:
        return quadratic
    from scipy.interpolate import RBFInterpolator

    places = np.argwhere(np.ones(seen.shape, bool)).astype(np.float64)
    beside = (mean[seen] / share[seen]).astype(np.float64)
    plate = RBFInterpolator(places[seen.ravel()], beside, smoothing=STIFFNESS, kernel="thin_plate_spline")(places)
    bent = plate.reshape(seen.shape).astype(np.float32)
    across = cv2.resize(bent, (block.shape[1], block.shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(quadratic + across, np.float32)


def _quadratic(block: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    """The quadratic surface through the ``known`` pixels of a block."""
    y, x = np.mgrid[-1 : 1 : block.shape[0] * 1j, -1 : 1 : block.shape[1] * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    coefficients = np.linalg.lstsq(terms[known], block[known].astype(np.float64), rcond=None)[0]
    return np.asarray(terms @ coefficients, np.float32)
