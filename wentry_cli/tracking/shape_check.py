"""How much a sphere departs from its ellipse, told by the frames in air in which it is known to be undeformed.

Below the surface only part of the outline is seen, and a shape that is no ellipse by half a per cent moves the size
that this part suggests by two. In air the same part of the same sphere can be fitted in the same way, and the whole
outline says what should have come out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import margin_of
from wentry_cli.tracking.prediction import box_around
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames

MOST_FRAMES = 8
FEWEST_FRAMES = 3
SIGNIFICANT = 4.0
LEFT_OVER = 0.35


@dataclass(frozen=True)
class ShapeCheck:
    """What a partial outline gets wrong in air.

    ``radius_ratio``: its free radius over that of the whole outline; ``stretch_offset``: its stretch with the right
    radius, minus one; ``bottom_offset_px``: the lowest point of its ellipse minus that of the outline itself. Each is
    its neutral value where it does not differ by four standard errors: the sphere is an ellipse as far as one can see.
    """

    radius_ratio: float = 1.0
    radius_ratio_unc: float = 0.0
    stretch_offset: float = 0.0
    bottom_offset_px: float = 0.0


NO_CHECK = ShapeCheck()


def check_shape(
    frames: Frames, ground: Background, dry: Sequence[Sighting], wet: Sequence[Sighting], level: str
) -> ShapeCheck:
    """Fit spheres in air over the part of the outline that the wet fits saw, and compare with the whole."""
    lines = [item.line for item in wet if item.ok and item.free_fit is not None and math.isfinite(item.line)]
    whole = [item for item in dry if item.ok and item.fit is not None and item.fit.arc_fraction > 0.98]
    if not lines or len(whole) < FEWEST_FRAMES:
        return NO_CHECK
    chosen = [whole[round(index)] for index in np.linspace(0, len(whole) - 1, min(len(whole), MOST_FRAMES))]
    line = float(np.median(lines))
    rows = [_compare(frames, ground, item, line, level) for item in chosen]
    values = np.array([row for row in rows if row is not None])
    if len(values) < FEWEST_FRAMES:
        return NO_CHECK
    middle = np.median(values, axis=0)
    error = 1.4826 * np.median(np.abs(values - middle), axis=0) * 1.25 / math.sqrt(len(values)) + 1e-6
    seen = np.where(np.abs(middle) > SIGNIFICANT * error, middle, 0.0)
    doubt = math.hypot(float(error[0]), LEFT_OVER * float(seen[0]))
    return ShapeCheck(1.0 + float(seen[0]), doubt if seen[0] else 0.0, float(seen[1]), float(seen[2]))


def _compare(
    frames: Frames, ground: Background, item: Sighting, line: float, level: str
) -> tuple[float, float, float] | None:
    assert item.fit is not None
    shape = EllipseShape(item.fit.center_x_px, item.fit.center_y_px, item.fit.radius_px)
    look = Look(box_around(shape, margin_of(shape.radius)), top_y_px=shape.y + line * shape.radius, level=level)
    free = sight(frames, item.frame, ground, shape, replace(look, free="x y R stretch", bottom=False))
    held = sight(frames, item.frame, ground, shape, look)
    if free.fit is None or held.fit is None or not (free.ok and held.ok):
        return None
    local = held.bottom
    bottom = held.fit.bottom_y_px - local.y_px if local is not None and local.status == "ok" else 0.0
    return free.fit.radius_px / shape.radius - 1.0, held.fit.stretch - 1.0, bottom


def corrected_radius(water: PooledRadius, check: ShapeCheck) -> PooledRadius:
    """The pooled wet radius without what the shape of the sphere adds to it; a third of the correction is doubt."""
    if not water.known:
        return water
    value = water.value / check.radius_ratio
    return replace(water, value=value, unc=math.hypot(water.unc, value * check.radius_ratio_unc))
