"""The one shape: the silhouette of a sphere stretched at constant volume, and the result of fitting it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

PARAMETERS = ("x", "y", "R", "stretch", "tilt")


class EllipseShape(NamedTuple):
    """An ellipse of revolution in full-frame pixels.

    The semi-axes are ``stretch * radius`` across and ``radius / stretch**2`` along the axis. ``x``, ``y`` is
    the centre (x right, y down); a positive ``tilt_deg`` moves the lower pole to the right.
    """

    x: float
    y: float
    radius: float
    stretch: float = 1.0
    tilt_deg: float = 0.0

    @property
    def semi_across(self) -> float:
        """Semi-axis across the axis of revolution, px."""
        return self.radius * self.stretch

    @property
    def semi_along(self) -> float:
        """Semi-axis along the axis of revolution, px."""
        return self.radius / self.stretch**2

    @property
    def bottom_y(self) -> float:
        """Row of the lowest point, px."""
        if not self.tilt_deg:
            return self.y + self.semi_along
        tilt = math.radians(self.tilt_deg)
        across, along = self.radius * self.stretch, self.radius / self.stretch**2
        return self.y + math.hypot(across * math.sin(tilt), along * math.cos(tilt))

    def vector(self, x0: float = 0.0, y0: float = 0.0, departure: tuple[float, ...] = ()) -> NDArray[np.float64]:
        """The parameters in the order of ``PARAMETERS``, tilt in radians, and a known ``departure`` behind them.

        ``x0``, ``y0`` is the corner of the patch that the centre is counted from.
        """
        tilt = math.radians(self.tilt_deg)
        return np.array([self.x - x0, self.y - y0, self.radius, self.stretch, tilt, *departure])


class SilhouetteFit(NamedTuple):
    """A fitted ellipse of revolution with its standard uncertainties (NaN where a parameter was held).

    ``covariance`` is 5 x 5 in the order of ``PARAMETERS`` (px, px, px, 1, rad) with zero rows where a parameter
    was held; a tilt that was held at a value with an uncertainty has that one. ``seen_tilt_deg`` is the tilt that the
    outline itself asks for, fitted or one linearised step from the one that was held, NaN where it does not tell.
    ``arc_fraction`` is the part of the whole perimeter that was looked at, ``gated_fraction`` the part
    of that arc which was left out because it disagreed. Where ``status`` is not ``ok`` the values are NaN or
    not to be trusted.
    """

    center_x_px: float
    center_y_px: float
    radius_px: float
    stretch: float
    tilt_deg: float
    center_x_unc_px: float
    center_y_unc_px: float
    radius_unc_px: float
    stretch_unc: float
    tilt_unc_deg: float
    bottom_y_px: float
    bottom_y_unc_px: float
    covariance: NDArray[np.float64]
    blur_px: float
    arc_fraction: float
    gated_fraction: float
    residual_rms_px: float
    status: str
    seen_tilt_deg: float = math.nan
    seen_tilt_unc_deg: float = math.nan

    @property
    def shape(self) -> EllipseShape:
        """The fitted ellipse."""
        return EllipseShape(self.center_x_px, self.center_y_px, self.radius_px, self.stretch, self.tilt_deg)
