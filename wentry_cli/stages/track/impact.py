"""The moment of impact of one drop, from the frames in air or, in a clip that starts later, from the first wet ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.tracking.held import since
from wentry_cli.tracking.impact import Impact, back_to_surface, find_impact
from wentry_cli.tracking.scale import levelled
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

NO_IMPACT = Impact(math.nan, math.nan, math.nan, math.nan, math.nan, "too_few")


def entry_impact(
    drop: Drop,
    clip: Clip,
    sightings: Sequence[Sighting],
    surface: tuple[SurfaceRow, float],
    released_s: float = -math.inf,
) -> Impact:
    """The moment of impact from the frames in air, or, in a clip that starts later, from the first wet ones.

    Frames in air up to ``released_s`` on the camera clock, in which the sphere is still held, do not count. Status
    ``clip_ended`` where it comes soon after the last frame: no longer than the fall was seen. Its time is given
    where the next frame would have shown it.
    """
    row, scale = surface
    good = [item for item in sightings if item.ok and item.fit is not None]
    dry = since([item for item in good if not item.wet], clip.time_s, released_s)
    bottoms = np.array([_level_bottom(item, row) for item in dry]).reshape(-1, 3)
    times = clip.time_s[[item.frame for item in dry]] if dry else np.empty(0)
    limits = (row.y_px, row.unc_px)
    impact = find_impact(times, bottoms[:, 0], bottoms[:, 1], limits, drop.experiment.gravity_m_s2 * scale)
    late = impact.time_s - float(clip.time_s[-1])
    if late > 0.0:
        impact = replace(impact, beyond_s=late, status="clip_ended" if late <= float(np.ptp(times)) else "no_object")
        if late > float(np.median(np.diff(clip.time_s))):
            unknown = replace(impact, time_s=math.nan, time_unc_s=math.nan, time_random_s=math.nan)
            return replace(unknown, speed_unc_px_s=math.nan)
    if impact.status != "too_few":
        blunt = shape_offset_px(dry) / impact.speed_px_s
        return replace(impact, time_unc_s=math.hypot(impact.time_unc_s, blunt))
    wet = [item for item in good if item.wet]
    if not wet:
        return impact
    rows = np.array([_level_row(item.fit, row) + item.fit.radius_px for item in wet if item.fit is not None])
    time, unc = back_to_surface(clip.time_s[[item.frame for item in wet]], rows, limits)
    return Impact(time, unc, math.nan, math.nan, math.nan, "ok" if math.isfinite(time) else "too_few")


def _level_row(fit: SilhouetteFit, surface: SurfaceRow) -> float:
    """Row of the centre as a level camera would have it."""
    about = surface.x_px, surface.y_px
    return float(levelled(fit.center_x_px, fit.center_y_px, about, surface.roll_rad)[1])


def _level_bottom(item: Sighting, surface: SurfaceRow) -> tuple[float, float, float]:
    """``best_bottom`` as a level camera would have it, of a sphere that is round in air."""
    row, unc, local = best_bottom(item)
    if item.fit is None or not surface.roll_rad:
        return row, unc, local
    return row + _level_row(item.fit, surface) - item.fit.center_y_px, unc, local


def shape_offset_px(dry: Sequence[Sighting]) -> float:
    """Lowest point of the outline below that of the ellipse, where it is significant: which of them touches first?"""
    offsets = np.array(
        [
            item.bottom.y_px - item.fit.bottom_y_px
            for item in dry
            if item.fit is not None and item.whole and best_bottom(item)[2] and item.bottom is not None
        ]
    )
    if len(offsets) < 3:
        return 0.0
    error = 1.86 * float(np.median(np.abs(offsets - np.median(offsets)))) / math.sqrt(len(offsets))
    offset = float(np.median(offsets))
    return offset if abs(offset) > 4.0 * error + 0.02 else 0.0


def best_bottom(item: Sighting) -> tuple[float, float, float]:
    """Row of the lowest point and its uncertainty in px: from the bottom alone (1 in the third place), else ellipse."""
    if item.bottom is not None and item.bottom.status == "ok" and math.isfinite(item.bottom.y_px):
        return item.bottom.y_px, item.bottom.y_unc_px, 1.0
    if item.fit is None:
        return math.nan, math.nan, 0.0
    return item.fit.bottom_y_px, item.fit.bottom_y_unc_px, 0.0
