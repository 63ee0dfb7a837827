"""How the frames of a view were exposed, and by which method their edges can be fitted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.stages.inputs.clip import Clip

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop


def exposure_frames(drop: Drop, name: str, clip: Clip) -> float:
    """Exposure over the time between frames; 0 where the exposure is not known."""
    exposure = drop.view(name).exposure_s or clip.exposure_s or 0.0
    step = float(np.median(np.diff(clip.time_s))) if clip.count > 1 else math.inf
    return exposure / step


def fitting_level(drop: Drop, ground: Background) -> str:
    """The level of method: as configured, but edges at half level where the sensor clips the light.

    The likelihood of a pixel needs to know how bright the ground is; at a clipped ground it would have to guess, and
    the radius with it (.6 % in the recordings tried), while the half level of what was recorded is what a reader of
    the picture means by its edge.
    """
    return "fast" if math.isfinite(ground.ceiling) else drop.experiment.analysis.tracking
