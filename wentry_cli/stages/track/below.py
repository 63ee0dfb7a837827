"""What is said of a sphere that is well seen in air and hardly at all below the surface."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)
FEWEST_IN_AIR, FEWEST_BELOW = 3, 12
HARDLY = 0.1


def warn_where_lost_below(drop: Drop, clip: Clip, sightings: Sequence[Sighting], surface_px: float) -> None:
    """Warn where less than a tenth of the frames below the surface could be measured in which the sphere is in view.

    It is in view at least for as long as it would take to the lower edge of the picture at its speed in air: the water
    only holds it back. Nothing is said where that, or the rest of the clip, is a dozen frames or less.
    """
    dry = [
        (item.frame, item.fit.bottom_y_px) for item in sightings if item.ok and item.fit is not None and not item.wet
    ]
    first = next((item.frame for item in sightings if item.wet), clip.count)
    if len(dry) < FEWEST_IN_AIR or not (speed := (dry[-1][1] - dry[0][1]) / (dry[-1][0] - dry[0][0])) > 0.0:
        return
    in_view = min(clip.count - first, math.floor((clip.shape[0] - surface_px) / speed))
    seen = sum(item.ok for item in sightings if item.wet and item.frame < first + in_view)
    if in_view > FEWEST_BELOW and seen < HARDLY * in_view:
        logger.warning(
            f"{drop.name}: the sphere is measured in {len(dry)} frames in air, but below the surface in {seen} of the "
            f"{in_view} in which it must be in view: it may show too little contrast in water, as translucent silicone "
            "does, or splash and bubbles hide it; what happens below the surface is not known"
        )
