"""Clips drawn in memory from single frames with known shape: no dynamics, no files."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wentry_cli.imaging.background import Background, build_background
from wentry_cli.imaging.ground import sample_indices
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still
from wentry_cli.tracking.source import FrameArray

SHAPE = (200, 160)


def clip(bodies: Callable[[int], StillBody], count: int, *, surface: float | None = None, seed: int = 1) -> FrameArray:
    rng = np.random.default_rng(seed)
    frames = np.stack([draw_still(bodies(k), StillLight(), SHAPE, rng).levels for k in range(count)])
    return FrameArray(frames)


def ground_of(frames: FrameArray) -> Background:
    samples = np.stack([frames.read(k) for k in sample_indices(frames.count)])
    return build_background(samples, frames.full_scale)
