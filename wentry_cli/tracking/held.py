"""Sightings of a sphere that hangs, as from a magnet, before it is let go within the clip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.release import release_time
from wentry_cli.tracking.sighting import Sighting


def let_go(sightings: Sequence[Sighting], time_s: NDArray[np.float64]) -> float:
    """When the sphere is let go by its sightings in air, in the unit of ``time_s``, the times of all frames.

    −inf where it falls from its first sighting on (see ``release_time``).
    """
    seen = [(time_s[item.frame], item.fit) for item in sightings if item.ok and not item.wet and item.fit is not None]
    rows = np.array([(time, fit.bottom_y_px, fit.bottom_y_unc_px) for time, fit in seen]).reshape(-1, 3)
    return release_time(*rows.T)


def since(sightings: Sequence[Sighting], time_s: NDArray[np.float64], released: float) -> list[Sighting]:
    """The sightings after the release: only these tell how the sphere falls."""
    return [item for item in sightings if time_s[item.frame] > released]
