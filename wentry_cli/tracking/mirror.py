"""The mirror image of the falling sphere in the water: where it is seen it tells the row of the free surface.

Sphere and image are as far from the free surface, one above and one below, so that the surface lies midway between
their centres, whatever its dark band looks like. Until the middle of the sphere is below the surface its image stands
out below it, and what looks like the bottom of the sphere is that of the image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import margin_of
from wentry_cli.tracking.prediction import box_around
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames

LAST_FRAMES, LEAST_FRAMES = 8, 3
LARGEST_SCATTER_PX, LEAST_UNC_PX = 1.0, 0.05
SAME_SIZE = 0.01  # an image that is seen through the water has another scale: then it tells no row
STANDS_OUT_PX = 3.0
RISES_PX = 0.5


@dataclass(frozen=True)
class Mirror:
    """Row about which the image is mirrored, its standard uncertainty, and whether it is that of the surface.

    ``y_px`` is NaN where there is no image. An image that is seen through the water is mirrored about the row at which
    the surface would be seen through the water.
    """

    y_px: float = math.nan
    unc_px: float = math.nan
    is_surface: bool = False

    @property
    def known(self) -> bool:
        """Whether the sphere has an image."""
        return math.isfinite(self.y_px)


NO_MIRROR = Mirror()


def find_mirror(
    frames: Frames, ground: Background, dry: Sequence[Sighting], surface_px: float, band_px: float, level: str
) -> Mirror:
    """Look for an image of the sphere in the last frames in air, about ``surface_px``, below its ``band_px``."""
    used = [item for item in dry if item.ok and item.fit is not None][-LAST_FRAMES:]
    middle, size, places = [], [], []
    for item in used:
        assert item.fit is not None
        shape = item.fit.shape
        guess = shape._replace(y=2.0 * surface_px - shape.y, stretch=1.0)
        left, top, right, low = box_around(guess, margin_of(guess.radius) + band_px)
        ceiling = surface_px + band_px
        if low > frames.shape[0] or guess.y < ceiling:
            continue
        look = Look((left, max(top, ceiling), right, low), "x y R", ceiling, level=level, bottom=False)
        seen = sight(frames, item.frame, ground, guess, look)
        if seen.ok and seen.fit is not None and abs(seen.fit.center_x_px - shape.x) < 0.2 * shape.radius:
            middle.append(0.5 * (shape.y + seen.fit.center_y_px))
            size.append(seen.fit.radius_px / shape.radius)
            places.append((shape.y, seen.fit.center_y_px))
    if len(middle) < LEAST_FRAMES:
        return NO_MIRROR
    row, scatter = float(np.median(middle)), float(np.std(middle))
    if scatter > LARGEST_SCATTER_PX or abs(row - surface_px) > 2.0 * band_px + 1.0:
        return NO_MIRROR
    ratio = float(np.median(size))
    if abs(ratio - 1.0) < SAME_SIZE:
        return Mirror(row, max(LEAST_UNC_PX, scatter), True)
    through_water = float(np.median([image - ratio * (surface_px - sphere) for sphere, image in places]))
    return Mirror(through_water, max(LEAST_UNC_PX, scatter), False)


def stands_out(sighting: Sighting, mirror: Mirror) -> bool:
    """Whether the image, if it is there, may reach below the sphere, or be what was taken for it."""
    return mirror.known and sighting.fit is not None and sighting.fit.center_y_px < mirror.y_px + STANDS_OUT_PX


def without_rising(sightings: Sequence[Sighting], mirror: Mirror) -> list[Sighting]:
    """Leave out what rises towards the surface while the sphere sinks through it: that is the image.

    Looked at backwards in time from where the middle of the sphere is a radius below the surface.
    """
    kept = list(sightings)
    if not mirror.known:
        return kept
    lowest = math.inf
    for index in range(len(kept) - 1, -1, -1):
        fit = kept[index].fit
        if not kept[index].ok or fit is None:
            continue
        if fit.center_y_px > mirror.y_px + fit.radius_px:
            lowest = math.inf
        elif fit.bottom_y_px > lowest + RISES_PX:
            kept[index] = Sighting(kept[index].frame, "occluded", wet=kept[index].wet)
            continue
        lowest = min(lowest, fit.bottom_y_px)
    return kept
