"""Flat field: the empty scene, its noise and clipping, and the cut-out of a frame in units of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.clean_mean import BLOCK_PX
from wentry_cli.imaging.detection import HALF_LEVEL, Candidate, find_spheres, shrink
from wentry_cli.imaging.ground import block_means, clean_level, fill_holes, relative_noise
from wentry_cli.imaging.late_ground import false_ground
from wentry_cli.imaging.order_statistics import linear_quantile
from wentry_cli.imaging.patch import Patch
from wentry_cli.imaging.samples import Samples

DARKEST_GROUND = 0.12
HOT_PIXEL = 0.25
GHOST = 0.7
GHOST_EDGE_PX = 5
SHARP_EDGE = 0.99  # of how bright it is beyond: so bright the pixels next to a ghost are where no edge is blurred
STEADY = 0.003
# The splash and shadows are darker than a sphere lit from the front; its highlights are smaller than what this leaves.
BRIGHTEST = 90.0


@dataclass(frozen=True)
class Background:
    """The empty scene of one view.

    ``level`` is its grey level (rows, columns) and ``gain`` turns a grey level into transmission (NaN where a pixel
    is hot or the scene too dark to divide by); a bright sphere on a dark ground is mapped to dark on 1.0 with
    ``contrast`` as the grey-level step of the sphere. ``noise`` is the standard deviation of the transmission of
    plain ground; ``ceiling`` the transmission at which the sensor clips.
    """

    level: NDArray[np.float32]
    gain: NDArray[np.float32]
    noise: float
    ceiling: float
    full_scale: float
    contrast: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.level.shape[0], self.level.shape[1]

    @cached_property
    def coarse_level(self) -> NDArray[np.float32]:
        """``level``, shrunk for a coarse look."""
        return shrink(self.level)[0]


def build_background(
    samples: NDArray[Any] | Samples, full_scale: float, *, polarity: str = "dark", empty: bool = False
) -> Background:
    """Build the flat field from sampled frames (frames, rows, columns) of grey levels up to ``full_scale``.

    Spheres found in the samples are left out of them, so that one that hardly moves leaves no ghost; with ``empty``
    the samples are known to show no sphere and are averaged. For ``bright`` the darkest third counts. A grey level of
    0 in ``samples`` becomes 1: they are too large to be copied.
    """
    raw = samples.frames if isinstance(samples, Samples) else samples
    turned: NDArray[Any] = raw if polarity == "dark" else raw.dtype.type(full_scale) - raw
    noise = relative_noise(turned)
    if empty:
        level = np.asarray(np.mean(turned, axis=0, dtype=np.float64), np.float32)
    else:
        kept = samples if isinstance(samples, Samples) and turned is raw else Samples.of(turned)
        level = _level_without_spheres(kept, noise)
    if polarity == "bright":
        return _bright_background(raw, np.asarray(full_scale - level, np.float32), full_scale)
    clipped = level >= 0.995 * full_scale
    ceiling = 0.995 if np.count_nonzero(clipped) > 0.01 * clipped.size else float("inf")
    return Background(level, _gain(level), noise, ceiling, full_scale, 0.0)


def _level_without_spheres(samples: Samples, noise: float) -> NDArray[np.float32]:
    """Level of the empty scene from samples whose spheres are covered for as long as it is computed."""
    samples.lift_black()
    discs = np.zeros(samples.frames.shape[1:], np.uint8)
    covered: list[tuple[NDArray[Any], NDArray[Any]]] = []
    for frame, coarse, blocks in zip(samples.frames, samples.coarse, samples.blocks, strict=True):
        for found in spheres_in_raw(*coarse):
            reach = int(np.ceil(1.12 * found.radius + 3))
            x, y = round(found.x), round(found.y)
            rows = slice(max(y - reach, 0) // BLOCK_PX, (y + reach) // BLOCK_PX + 1)
            part = frame[BLOCK_PX * rows.start : BLOCK_PX * rows.stop]
            covered += [(part, part.copy()), (blocks[rows], blocks[rows].copy())]
            cv2.circle(frame, (x, y), reach, 0.0, -1)
            cv2.circle(discs, (x, y), reach, 1.0, -1)
            blocks[rows] = block_means(part)
    level = clean_level(samples.frames, samples.blocks, noise)
    for part, before in reversed(covered):
        part[:] = before
    unseen = _ghosts(level, discs > 0) | false_ground(level, samples.blocks[0])
    if unseen.any():
        level[unseen] = np.nan
    return fill_holes(level)


def _ghosts(level: NDArray[np.float32], discs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where spheres have left a ghost in the level, with the blurred edge of the ghost if it has one.

    It has none where it ends with the disc that covers it: beyond, the ground was seen.
    """
    some = level[::4, ::4]
    known = some[np.isfinite(some)]
    dark = discs & ~(level > np.float32(GHOST * linear_quantile(known, known.size, 0.8)))
    if not dark.any():
        return dark
    close, near, wide = (_widened(dark, reach) for reach in (1, GHOST_EDGE_PX - 1, GHOST_EDGE_PX))
    rim, beyond = level[close & ~dark], level[wide & ~near]
    if rim.size and beyond.size and np.mean(rim) > SHARP_EDGE * np.mean(beyond):
        return dark
    return wide & discs


def _widened(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """A mask grown by ``reach`` pixels each way."""
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach + 1,) * 2, np.uint8)) > 0)


def spheres_in_raw(coarse: NDArray[np.float32], factor: float) -> list[Candidate]:
    """Spheres in a frame without flat field, shrunk by ``factor``: dark against the level of its bright half."""
    light = coarse[::4, ::4].ravel()
    ground = linear_quantile(light, light.size, 0.8)
    return find_spheres(coarse, factor, level=HALF_LEVEL * max(ground, 1.0))


def coarse_transmission(coarse: NDArray[np.float32], background: Background) -> NDArray[np.float32]:
    """A whole raw frame, shrunk for a coarse look, in units of the empty scene."""
    level = background.coarse_level
    if background.contrast > 0:
        return 1.0 - (coarse - level) / np.float32(background.contrast)
    return np.asarray(coarse / np.maximum(level, 1.0), np.float32)


def _gain(level: NDArray[np.float32]) -> NDArray[np.float32]:
    """What turns a grey level into transmission, NaN where a pixel is hot or the scene too dark to divide by."""
    some = level[::4, ::4].ravel()
    dark = np.float32(DARKEST_GROUND * linear_quantile(some, some.size, 0.9))
    gain = np.asarray(cv2.medianBlur(level, 3), np.float32)
    _invert(level, dark, gain)
    return gain


@compiled
def _invert(level: NDArray[np.float32], dark: np.float32, gain: NDArray[np.float32]) -> None:
    """Fill in the gain, which holds the level usual around each pixel."""
    for row in range(level.shape[0]):
        source, target = level[row, :], gain[row, :]
        for column in range(source.size):
            value, usual = source[column], target[column]
            usable = value > dark and not abs(value - usual) > np.float32(HOT_PIXEL) * usual
            target[column] = np.float32(1.0) / value if usable else np.float32(np.nan)


def _bright_background(samples: NDArray[Any], level: NDArray[np.float32], full_scale: float) -> Background:
    excess = np.asarray(samples[:, ::4, ::4], np.float32) - level[::4, ::4]
    strong = excess[excess > 0.25 * np.percentile(excess, 99.9)]
    contrast = float(np.percentile(strong, BRIGHTEST)) if strong.size else full_scale
    steps = np.abs(np.diff(excess, axis=0)) if len(excess) > 1 else np.zeros(1)
    noise = float(1.4826 * np.median(steps) / np.sqrt(2.0)) / max(contrast, 1.0)
    gain = np.full(level.shape, -1.0 / max(contrast, 1.0), np.float32)
    return Background(level, gain, noise, float("inf"), full_scale, contrast)


@compiled
def _scaled(raw: NDArray[Any], x0: int, y0: int, gain: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    columns = raw.shape[1]
    for row in range(raw.shape[0]):
        # whole rows of contiguous arrays, which the compiler turns into vector instructions
        source, target = raw[row, :], out[row, :]
        factor = gain[y0 + row, x0 : x0 + columns]
        for column in range(columns):
            target[column] = np.float32(source[column]) * factor[column]


@compiled
def _of_bright(
    raw: NDArray[Any], x0: int, y0: int, level: NDArray[np.float32], contrast: float, out: NDArray[np.float32]
) -> None:
    columns, factor = raw.shape[1], np.float32(-1.0 / max(contrast, 1.0))
    for row in range(raw.shape[0]):
        source, target = raw[row, :], out[row, :]
        ground = level[y0 + row, x0 : x0 + columns]
        for column in range(columns):
            step = np.float32(1.0) + (np.float32(source[column]) - ground[column]) * factor
            target[column] = max(step, np.float32(-0.25))


def cut_patch(raw: NDArray[Any], x0: int, y0: int, background: Background) -> Patch:
    """Turn the raw grey levels of a region whose first pixel is column ``x0``, row ``y0`` into a patch."""
    values = np.empty(raw.shape, np.float32)
    if background.contrast > 0:
        _of_bright(np.ascontiguousarray(raw), x0, y0, background.level, background.contrast, values)
    else:
        _scaled(np.ascontiguousarray(raw), x0, y0, background.gain, values)
    return Patch(values, x0, y0, background.noise, background.ceiling)


@compiled
def _ground_level(values: NDArray[np.float32], x: float, y: float, across: float, along: float) -> tuple[float, int]:
    total = 0.0
    count = 0
    aside = np.empty(values.shape[1])
    for column in range(0, values.shape[1], 3):
        aside[column] = ((column - x) / across) ** 2
    for row in range(max(0, int(y)), values.shape[0], 3):
        height = ((row - y) / along) ** 2
        for column in range(0, values.shape[1], 3):
            value = values[row, column]
            if 0.7 < value < 1.4 and aside[column] + height > 1.1:
                total += value
                count += 1
    return total, count


def steadied(patch: Patch, shape: tuple[float, float, float, float]) -> Patch:
    """Divide out the flicker of the light: the plain ground beside and below a shape becomes 1.

    ``shape`` is the ellipse (x, y, semi-axis across, semi-axis along) in full-frame pixels; the ground above it may be
    splash or cavity and is not looked at. The patch is returned as it is where the light is steady to 0.3 %, or too
    little ground is seen.
    """
    x, y, across, along = shape
    total, count = _ground_level(patch.values, x - patch.x0, y - patch.y0, across + 4.0, along + 4.0)
    if count < 60 or abs(total / count - 1.0) < STEADY:
        return patch
    gain = total / count
    return Patch(patch.values / np.float32(gain), patch.x0, patch.y0, patch.noise_floor, patch.ceiling / gain)
