"""The mean of the clean samples of every pixel: what the empty scene shows, less those in which something hides it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

BLOCK_PX = 4
APART = 8 * BLOCK_PX  # px between shaded blocks across which it is quicker to go on than to begin anew
BAND_ROWS = 64  # of the picture, turned into the same light at a time

Singles = NDArray[np.float32]


def clean_mean(samples: NDArray[Any], light: Singles, lit: Singles, tolerance: float) -> Singles:
    """The mean over ``samples`` (frames, rows, columns) of grey levels, of every pixel: NaN where each is 0, covered.

    ``light`` is how bright each sample is, ``lit`` (samples, blocks down and across) 1 or, where something shades it,
    0: of shaded samples only what else there is not is taken. Samples of a pixel that are darker by more than the share
    ``tolerance`` than its third brightest are left out; where few are so bright, than the second or the brightest.
    """
    level = np.empty(samples.shape[1:], np.float32)
    shaded = lit.min(axis=0) == 0.0
    keep = np.float32(1.0 - tolerance)
    if np.all(light == 1.0):
        _clean_rows(samples, lit, shaded, keep, level)
        return level
    scale = (np.float32(1.0) / light)[:, None, None]
    for first in range(0, len(level), BAND_ROWS):
        rows, blocks = slice(first, first + BAND_ROWS), slice(first // BLOCK_PX, (first + BAND_ROWS) // BLOCK_PX)
        even = np.multiply(samples[:, rows], scale, dtype=np.float32)
        _clean_rows(even, np.ascontiguousarray(lit[:, blocks]), shaded[blocks], keep, level[rows])
    return level


@compiled
def _clean_rows(
    samples: NDArray[Any], lit: Singles, shaded: NDArray[np.bool_], keep: np.float32, level: Singles
) -> None:
    """Fill ``level`` row by row: a plain mean, then anew where blocks are ``shaded`` or a sample is dark."""
    count, rows, columns = samples.shape
    ordered = np.empty((4, columns), samples.dtype)
    bound, total = np.empty(columns, np.float32), np.empty((2, columns), np.float32)
    share = np.empty((count, columns), np.float32)
    runs = np.empty((2, shaded.shape[1]), np.intp)
    flags = np.zeros(8 * (columns // 8 + 1), np.uint8)
    words = flags.view(np.uint64)
    number = 0
    for row in range(rows):
        if row % BLOCK_PX == 0:
            number = _shaded_runs(shaded[row // BLOCK_PX, :], columns, runs)
            _spread(lit, row // BLOCK_PX, runs[:, :number], share)
        _put_in_order(samples, row, ordered)
        _bounds(ordered, keep, bound, flags[:columns])
        _plain_mean(samples, row, total[0, :], level[row, :])
        for run in range(number):
            first, last = runs[0, run], runs[1, run]
            flags[first:last] = 0
            _mean_of_clear(samples, row, share, bound, total, (first, last), level[row, :])
        for word in range(words.size):
            if words[word]:
                for column in range(8 * word, 8 * word + 8):
                    if flags[column]:
                        level[row, column] = _mean_of_bright(samples, row, column, bound[column])


@compiled
def _shaded_runs(shaded: NDArray[np.bool_], columns: int, runs: NDArray[np.intp]) -> int:
    """Fill ``runs`` with the first and behind the last column of blocks that are shaded; how many runs there are."""
    number = 0
    for block in range(shaded.size):
        if shaded[block]:
            first = BLOCK_PX * block
            if number == 0 or first > runs[1, number - 1] + APART:
                runs[0, number] = first
                number += 1
            runs[1, number - 1] = min(columns, first + BLOCK_PX)
    return number


@compiled
def _spread(lit: Singles, block: int, runs: NDArray[np.intp], share: Singles) -> None:
    """Spread a row of blocks over the columns of ``runs``."""
    last = share.shape[1] - BLOCK_PX
    for run in range(runs.shape[1]):
        for index in range(lit.shape[0]):
            source, target = lit[index, block, :], share[index, :]
            for first in range(runs[0, run], runs[1, run], BLOCK_PX):
                value = source[first // BLOCK_PX]
                for near in range(BLOCK_PX if first <= last else share.shape[1] - first):
                    target[first + near] = value


@compiled
def _put_in_order(samples: NDArray[Any], row: int, ordered: NDArray[Any]) -> None:
    """The three brightest samples of every pixel of a row, in order, and the darkest.

    Two samples at a time and without a branch, for vector instructions.
    """
    count = samples.shape[0]
    begin = 1 if count % 2 else 2
    one, other = samples[0, row, :], samples[begin - 1, row, :]
    first, second, third, least = ordered[0, :], ordered[1, :], ordered[2, :], ordered[3, :]
    third[:] = 0
    for column in range(one.size):
        first[column] = max(one[column], other[column])
        second[column] = least[column] = min(one[column], other[column])
    if begin == 1:
        second[:] = 0
    for index in range(begin, count, 2):
        one, other = samples[index, row, :], samples[index + 1, row, :]
        for column in range(one.size):
            more, less = max(one[column], other[column]), min(one[column], other[column])
            least[column] = min(least[column], less)
            top, next_one = first[column], second[column]
            first[column] = max(top, more)
            inner, outer = min(top, more), max(next_one, less)
            second[column] = max(inner, outer)
            inner, outer = min(inner, outer), min(next_one, less)
            outer = max(inner, outer)
            third[column] = max(third[column], outer)


@compiled
def _bounds(ordered: NDArray[Any], keep: np.float32, bound: Singles, flags: NDArray[np.uint8]) -> None:
    """Least level of a clean sample of each pixel, and whether the darkest one is below that."""
    top, next_one, last_one, least = ordered[0, :], ordered[1, :], ordered[2, :], ordered[3, :]
    for column in range(bound.size):
        first, second, third = np.float32(top[column]), np.float32(next_one[column]), np.float32(last_one[column])
        lowest = first * keep
        bright = third if third >= lowest else (second if second >= lowest else first)
        bound[column] = max(bright * keep, np.float32(1e-6))
    for column in range(bound.size):
        flags[column] = np.float32(least[column]) < bound[column]


@compiled
def _plain_mean(samples: NDArray[Any], row: int, total: Singles, level: Singles) -> None:
    count = samples.shape[0]
    total[:] = 0.0
    for index in range(0, count - 3, 4):  # four at once, in order
        one, two = samples[index, row, :], samples[index + 1, row, :]
        three, four = samples[index + 2, row, :], samples[index + 3, row, :]
        for column in range(total.size):
            half = total[column] + np.float32(one[column]) + np.float32(two[column])
            total[column] = half + np.float32(three[column]) + np.float32(four[column])
    for index in range(count - count % 4, count):
        one = samples[index, row, :]
        for column in range(total.size):
            total[column] += np.float32(one[column])
    for column in range(total.size):
        level[column] = total[column] / np.float32(count)


@compiled
def _mean_of_clear(
    samples: NDArray[Any],
    row: int,
    share: Singles,
    bound: Singles,
    totals: Singles,
    run: tuple[int, int],
    level: Singles,
) -> None:
    """The mean of the samples of a ``run`` of columns that are neither dark nor shaded, or where all are, not dark."""
    first, last = run
    least, out = bound[first:last], level[first:last]
    total, used = totals[0, first:last], totals[1, first:last]
    totals[:, first:last] = 0.0
    for index in range(samples.shape[0]):
        source, clear = samples[index, row, first:last], share[index, first:last]
        for column in range(out.size):
            value = np.float32(source[column])
            good = clear[column] if value >= least[column] else np.float32(0.0)
            total[column] += value * good
            used[column] += good
    for column in range(out.size):
        if used[column] > 0:
            out[column] = total[column] / used[column]
        else:
            out[column] = _mean_of_bright(samples, row, first + column, least[column])


@compiled
def _mean_of_bright(samples: NDArray[Any], row: int, column: int, bound: np.float32) -> np.float32:
    """The mean of the samples of a pixel that are not dark; NaN where all are."""
    total, used = np.float32(0.0), np.float32(0.0)
    for index in range(samples.shape[0]):
        value = np.float32(samples[index, row, column])
        if value >= bound:
            total += value
            used += np.float32(1.0)
    return np.float32(total / used if used > 0 else np.nan)
