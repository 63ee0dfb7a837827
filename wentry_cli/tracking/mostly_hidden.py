"""Outlines that are mostly hidden: what is left was chosen for its agreement, which then says less of its error."""

from __future__ import annotations

import math

from wentry_cli.contours.fitting import HALF_GATED
from wentry_cli.tracking.sighting import Sighting

# Beyond half hidden the variance grows by the square of what is beyond it, in these parts.
PART = 0.15


def doubted_where_hidden(item: Sighting) -> Sighting:
    """The sighting with uncertainties that grow where most of the outline is hidden."""
    fit = item.fit
    if fit is None or not fit.gated_fraction > HALF_GATED:
        return item
    factor = 1.0 + ((fit.gated_fraction - HALF_GATED) / PART) ** 2
    root = math.sqrt(factor)
    return item._replace(
        fit=fit._replace(
            covariance=factor * fit.covariance,
            center_x_unc_px=root * fit.center_x_unc_px,
            center_y_unc_px=root * fit.center_y_unc_px,
            radius_unc_px=root * fit.radius_unc_px,
            stretch_unc=root * fit.stretch_unc,
            tilt_unc_deg=root * fit.tilt_unc_deg,
            bottom_y_unc_px=root * fit.bottom_y_unc_px,
            seen_tilt_unc_deg=root * fit.seen_tilt_unc_deg,
        )
    )
