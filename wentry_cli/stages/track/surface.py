"""The row of y = 0 of a side view: given by the user, or found in the empty scene."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.imaging.background import Background
from wentry_cli.imaging.free_surface import NO_SURFACE, SurfaceRow, find_surfaces
from wentry_cli.imaging.plate import find_plate
from wentry_cli.imaging.surface_band import clear_of_band
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.exposure import exposure_frames
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.waterline import choose_surface, follow_to_change

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

RIVAL = 0.2  # of the depth of the dark line that is chosen: one that may be it as well
ABOUT = 1.5  # radii to either side in which the outline of the sphere may cross the surface
SLANTED = math.radians(1.0)
logger = logging.getLogger(__name__)


def surface_row(drop: Drop, clip: Clip, ground: Background, seed: Path | None) -> SurfaceRow:
    """The row of y = 0: given, or found below the sphere in the empty scene, where the sphere tells that it is there.

    Status ``no_edge`` where nothing is found, or only lines far below where the sphere is not round any more.
    """
    view = drop.view("side")
    found = _found_surfaces(drop, ground, seed)
    if view.surface_y_px == "auto":
        chosen = _the_surface(drop, clip, ground, (seed, found))
        _warn_of_slant(drop, chosen)
        return chosen
    given = SurfaceRow(float(view.surface_y_px), view.surface_y_px_unc or 0.3, 3.0, math.nan, "ok")
    away = min((abs(given.y_px - row.y_px) - row.thickness_px for row in found), default=0.0)
    if away > 4.0 * given.unc_px:
        logger.warning(
            f"{drop.name}: views.side.surface_y_px is {given.y_px:g}, but the picture shows a surface at row "
            f"{found[0].y_px:.1f}; heights, impact and speeds go by the one that was given",
            extra=puts_in_doubt("row of the surface"),
        )
    return given


def _warn_of_slant(drop: Drop, surface: SurfaceRow) -> None:
    slant = math.atan(surface.slant)
    if abs(slant) > SLANTED:
        heights = "are corrected for it" if surface.roll_rad else "are counted along the columns of the picture"
        logger.warning(
            f"{drop.name}: the surface falls by {abs(math.degrees(slant)):.1f} degrees to the "
            f"{'right' if slant > 0 else 'left'} of the side view: level the camera; heights {heights}"
        )


def _found_surfaces(drop: Drop, ground: Background, seed: Path | None) -> list[SurfaceRow]:
    middle = seed.shapes[-1].x if seed is not None else None
    if drop.experiment.kind == "surface_impact":
        plate = find_plate(ground.level, x_px=middle)
        plate = replace(plate, x_px=math.nan)  # one that slopes tells nothing of the camera
        return [plate] if plate.status == "ok" else []
    highest = min(shape.y for shape in seed.shapes) if seed is not None else 0.0
    return find_surfaces(_bright(ground), x_px=middle, rows=(highest, float(ground.shape[0])))


def _the_surface(drop: Drop, clip: Clip, ground: Background, seen: tuple[Path | None, list[SurfaceRow]]) -> SurfaceRow:
    """That of several rows at which the fall of the sphere changes; the darkest where no change is seen."""
    seed, rows = seen
    if len(rows) < 2 or seed is None:
        return rows[0] if rows else NO_SURFACE
    lowest = max(row.y_px for row in rows)
    change = follow_to_change(clip, ground, seed, lowest, exposure_frames(drop, "side", clip))
    able = choose_surface(rows, change, seed.radius)
    if not able and not change.by_shape:
        able = rows  # what hides the sphere may be something else
    if len(able) > 1 and able[1].contrast > RIVAL * able[0].contrast:
        others = ", ".join(f"{row.y_px:.1f}" for row in able[1:])
        logger.warning(
            f"{drop.name}: the free surface is taken at row {able[0].y_px:.1f}, but may be the dark line at {others}: "
            "set views.side.surface_y_px to its row",
            extra=puts_in_doubt("row of the surface"),
        )
    return able[0] if able else NO_SURFACE


def band_reach(ground: Background, surface: SurfaceRow, seed: Path) -> tuple[float, float]:
    """How far the dark band of the surface reaches above and below its row about the sphere, px."""
    shape = seed.shapes[-1]
    return clear_of_band(_bright(ground), surface, (shape.x - ABOUT * shape.radius, shape.x + ABOUT * shape.radius))


def _bright(ground: Background) -> NDArray[np.float32]:
    """The empty scene with bright ground."""
    return ground.level if ground.contrast == 0 else np.asarray(np.float32(ground.full_scale) - ground.level)
