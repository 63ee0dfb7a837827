"""What is said of a sphere that leaves the picture before the clip ends."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)


def warn_where_out_of_view(drop: Drop, view: str, columns: Mapping[str, Any]) -> None:
    """Warn once of the frames of a view after the last measured one in which the sphere is ``out_of_frame``.

    ``columns`` are those of the view's table. Nothing is said of a free flight, which ends so.
    """
    status = np.asarray(columns["status"])
    measured = np.flatnonzero(status == "ok")
    if drop.experiment.kind == "free_flight" or not measured.size:
        return
    left = np.flatnonzero((status == "out_of_frame") & (np.arange(status.size) > measured[-1]))
    if left.size:
        time_s = float(columns["t_s"][left[0]])
        when = f", {1e3 * time_s:.1f} ms after impact" if math.isfinite(time_s) else ""
        frames = "a frame" if left.size == 1 else f"{left.size} frames"
        logger.warning(
            f"{drop.name}: the sphere is out of the {view} view in {frames}, from frame {left[0]} on{when}: its motion "
            "is not known after that"
        )
