"""What the tables of a drop tell of its fall through air."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wentry_cli.kinematics.fall_check import Fall, check_fall
from wentry_cli.stages.inputs.columns import column, number

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop


def released(geometry: dict[str, Any]) -> float:
    """When a sphere that was held is let go, s after impact, from the row of a view; −inf where none was held."""
    time = number(geometry, "release_time_s") - number(geometry, "impact_time_s")
    return time if math.isfinite(time) else -math.inf


def fall_in_air(drop: Drop, side: pd.DataFrame, geometry: dict[str, Any]) -> Fall | None:
    """The fall before impact held against gravity (``check_fall``), by the centre of the outline in side.csv.

    A lowest point may be that of a sphere that still rings or of what sticks to it, and its edge may err by itself; an
    edge that errs all round moves no centre.
    """
    pixel_m = 1.0 / number(geometry, "scale_px_per_m", math.inf)
    seen = (side["status"] == "ok").to_numpy(dtype=bool)
    height = np.where(seen, -pixel_m * column(side, "center_y_px"), np.nan)
    unc = pixel_m * column(side, "bottom_y_px_unc")
    gravity = drop.experiment.gravity_m_s2
    return check_fall(column(side, "t_s"), (height, unc), gravity, pixel_m, released_s=released(geometry))
