"""The row of y = 0 of a side view: given by the user, or found in the empty scene."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import SurfaceRow, clear_of_band, find_free_surface, find_plate
from wentry_cli.tracking.prediction import Path

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

ABOUT = 1.5  # radii to either side in which the outline of the sphere may cross the surface
logger = logging.getLogger(__name__)


def surface_row(drop: Drop, ground: Background, seed: Path | None) -> SurfaceRow:
    """The row of y = 0: given, or found below the sphere in the empty scene."""
    view = drop.view("side")
    found = _found_surface(drop, ground, seed)
    if view.surface_y_px == "auto":
        return found
    given = SurfaceRow(float(view.surface_y_px), view.surface_y_px_unc or 0.3, 3.0, math.nan, "ok")
    if found.status == "ok" and abs(given.y_px - found.y_px) > 4.0 * given.unc_px + found.thickness_px:
        logger.warning(
            f"{drop.name}: views.side.surface_y_px is {given.y_px:g}, but the picture shows a surface at row "
            f"{found.y_px:.1f}; heights, impact and speeds go by the one that was given"
        )
    return given


def _found_surface(drop: Drop, ground: Background, seed: Path | None) -> SurfaceRow:
    middle = seed.shapes[-1].x if seed is not None else None
    if drop.experiment.kind == "surface_impact":
        return find_plate(ground.level, x_px=middle)
    highest = min(shape.y for shape in seed.shapes) if seed is not None else 0.0
    return find_free_surface(_bright(ground), x_px=middle, rows=(highest, float(ground.shape[0])))


def band_reach(ground: Background, surface: SurfaceRow, seed: Path) -> tuple[float, float]:
    """How far the dark band of the surface reaches above and below its row about the sphere, px."""
    shape = seed.shapes[-1]
    return clear_of_band(_bright(ground), surface, (shape.x - ABOUT * shape.radius, shape.x + ABOUT * shape.radius))


def _bright(ground: Background) -> NDArray[np.float32]:
    """The empty scene with bright ground."""
    return ground.level if ground.contrast == 0 else np.asarray(np.float32(ground.full_scale) - ground.level)
