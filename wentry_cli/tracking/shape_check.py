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
from numpy.typing import NDArray

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import margin_of
from wentry_cli.tracking.prediction import box_around
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.sighting import Look, Sighting, sight
from wentry_cli.tracking.source import Frames

Row = tuple[float, float, float]
MOST_FRAMES = 8
FEWEST_FRAMES = 3
SIGNIFICANT = 4.0
LEFT_OVER = 0.35
SHORT_LINE = 0.6


@dataclass(frozen=True)
class ShapeCheck:
    """What a partial outline gets wrong in air.

    ``radius_ratio``: its free radius over that of the whole outline; ``stretch_offset``: its stretch with the right
    radius, minus one, at the row ``line`` (from the centre down in semi-axes) and ``short_offset`` at ``SHORT_LINE``;
    ``bottom_offset_px``: the lowest point of its ellipse minus that of the outline itself. Each is
    its neutral value where it does not differ by four standard errors: the sphere is an ellipse as far as one can see.
    """

    radius_ratio: float = 1.0
    radius_ratio_unc: float = 0.0
    stretch_offset: float = 0.0
    bottom_offset_px: float = 0.0
    line: float = 0.0
    short_offset: float = 0.0

    def stretch_doubt(self, line: float) -> float:
        """How far off the stretch of an outline that is seen below ``line`` may be."""
        known = (self.line, max(SHORT_LINE, self.line + 0.01))
        return float(np.interp(line, known, (abs(self.stretch_offset), abs(self.short_offset))))


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
    seen, error = _significant([_compare(frames, ground, item, line, level) for item in chosen])
    short, _ = _significant([_held_stretch(frames, ground, item, SHORT_LINE, level) for item in chosen])
    doubt = math.hypot(float(error[0]), LEFT_OVER * float(seen[0])) if seen[0] else 0.0
    return ShapeCheck(1.0 + float(seen[0]), doubt, float(seen[1]), float(seen[2]), line, float(short[1]))


def _significant(rows: Sequence[Row | None]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Medians over frames, zero where they are not significant, and their standard errors."""
    values = np.array([row for row in rows if row is not None]).reshape(-1, 3)
    if len(values) < FEWEST_FRAMES:
        return np.zeros(3), np.zeros(3)
    middle = np.median(values, axis=0)
    error = 1.4826 * np.median(np.abs(values - middle), axis=0) * 1.25 / math.sqrt(len(values)) + 1e-6
    return np.where(np.abs(middle) > SIGNIFICANT * error, middle, 0.0), error


def _look(shape: EllipseShape, line: float, level: str) -> Look:
    return Look(box_around(shape, margin_of(shape.radius)), top_y_px=shape.y + line * shape.radius, level=level)


def _held_stretch(frames: Frames, ground: Background, item: Sighting, line: float, level: str) -> Row | None:
    assert item.fit is not None
    shape = EllipseShape(item.fit.center_x_px, item.fit.center_y_px, item.fit.radius_px)
    held = sight(frames, item.frame, ground, shape, _look(shape, line, level))
    return (0.0, held.fit.stretch - 1.0, 0.0) if held.ok and held.fit is not None else None


def _compare(frames: Frames, ground: Background, item: Sighting, line: float, level: str) -> Row | None:
    assert item.fit is not None
    shape = EllipseShape(item.fit.center_x_px, item.fit.center_y_px, item.fit.radius_px)
    look = _look(shape, line, level)
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
