"""What the tables of a drop tell of its fall through air."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from wentry_cli.kinematics.fall_check import Fall, check_fall
from wentry_cli.stages.inputs.columns import column, number

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop


def released(geometry: dict[str, Any]) -> float:
    """When a sphere that was held is let go, s after impact, from the row of a view; −inf where none was held."""
    time = number(geometry, "release_time_s") - number(geometry, "impact_time_s")
    return time if math.isfinite(time) else -math.inf


def fall_in_air(drop: Drop, heights: pd.DataFrame, geometry: dict[str, Any]) -> Fall | None:
    """The fall before impact held against gravity (``check_fall``), from a table with ``y_b_m``."""
    bottom = column(heights, "y_b_m"), column(heights, "y_b_m_unc")
    pixel_m = 1.0 / number(geometry, "scale_px_per_m", math.inf)
    gravity = drop.experiment.gravity_m_s2
    return check_fall(column(heights, "t_s"), bottom, gravity, pixel_m, released_s=released(geometry))
