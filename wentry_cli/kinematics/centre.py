"""The centre of mass of an ellipsoid of revolution from its lowest point and its stretch, as the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def centre_height(
    bottom_m: Array,
    bottom_unc_m: Array,
    stretch: Array,
    stretch_unc: Array,
    radius_m: float,
    tilt_deg: Array | float = 0.0,
) -> tuple[Array, Array]:
    """Return y_c = y_b + R/λ² and its standard uncertainty, m; NaN where y_b or λ is NaN.

    Where the axis leans by ``tilt_deg`` (NaN: not known, and then small) the lowest point lies
    √((R/λ²)² cos² + (Rλ)² sin²) below the centre: at λ = .8 and 2° the paper's R/λ² is 20 µm too much for 51 mm.

    The errors of y_b and λ are taken as independent: y_b comes from the bottom of the outline alone, λ from its width
    or from another camera. δy_c = 2R/λ³ δλ is half a millimetre for 0.01 on a 51 mm sphere, so λ matters most.
    """
    height = bottom_m + radius_m * ellipsoid_depth(stretch, tilt_deg)
    slope = 2.0 * radius_m / stretch**3
    return height, np.hypot(bottom_unc_m, slope * stretch_unc)


def ellipsoid_depth(stretch: Array, tilt_deg: Array | float) -> Array:
    """How far the lowest point of the ellipsoid lies below its centre, over R."""
    lean = np.radians(np.nan_to_num(tilt_deg))
    return np.hypot(np.cos(lean) / stretch**2, stretch * np.sin(lean))


def below_ellipsoid(depth_px: Array, radius_px: Array, stretch: Array, tilt_deg: Array, radius_m: float) -> Array:
    """Return how much lower than an ellipsoid an outline reaches, m; 0 where it was not seen.

    ``depth_px`` is the lowest row of the fitted outline less the row of its centre. A sphere whose outline is known to
    depart from an ellipse, by .3 % say, has its lowest point .3 % of R away from where its stretch would put it: y_c
    must not follow.
    """
    return np.nan_to_num(radius_m * (depth_px / radius_px - ellipsoid_depth(stretch, tilt_deg)))


def early_shape_time(radius_m: float, stiffness_pa: float, density_kg_m3: float) -> float:
    """Return R/√(G∞/ρ_s), s: until then the shape is a wave running up the sphere, not yet an ellipsoid."""
    return float(radius_m / np.sqrt(stiffness_pa / density_kg_m3))


def early_shape_time_from_period(period_s: float) -> float:
    """Return the same time where G∞ is unknown, from the free period T = 1.4 D/√(G∞/ρ_s) of the paper's Fig. 4b."""
    return period_s / (2.0 * 1.4)
