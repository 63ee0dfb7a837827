"""The lowest point of the silhouette from its bottom cap alone, free of the ellipse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.bottom_cap import COLUMN, FOUND, HOW, REST, ROW, UNC, refine_bottom
from wentry_cli.contours.clipped import CLIPPED_PX, is_clipped
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.nuisances import PRIOR_LN_S
from wentry_cli.contours.refine import reach_of
from wentry_cli.contours.scan import OCCLUDED_SHARE
from wentry_cli.imaging.patch import Patch

STATUS_WORDS = ("ok", "occluded", "poor_fit", "out_of_frame")


@dataclass(frozen=True)
class BottomFit:
    """The lowest point of the outline, full-frame px, NaN where it could not be measured."""

    x_px: float
    y_px: float
    y_unc_px: float
    residual_rms_px: float
    status: str


def fit_local_bottom(patch: Patch, fit: SilhouetteFit, *, motion_px: tuple[float, float] = (0.0, 0.0)) -> BottomFit:
    """Locate the lowest point from the edge within 30 degrees of the bottom.

    The angle is the eccentric one of the fitted ellipse, that is the cap of the undeformed sphere. The ellipse only
    says where to look (see `bottom_cap`).
    """
    if fit.status != "ok":
        return no_bottom(fit.status)
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    shape = fit.shape.vector(patch.x0, patch.y0)
    settings = np.array([-math.inf, *motion_px, patch.ceiling, 0.0, fit.gated_fraction > OCCLUDED_SHARE], np.float64)
    reach = reach_of(PRIOR_LN_S if math.isnan(fit.blur_px) else math.log(fit.blur_px))
    found = refine_bottom(values, shape, settings, reach, False)
    if found[HOW] != FOUND and np.isnan(values).any():
        again = refine_bottom(values, shape, settings, reach, True)
        found = again if again[HOW] == FOUND else found
    return bottom_found(patch, found)


def bottom_found(patch: Patch, found: NDArray[np.float64]) -> BottomFit:
    """Turn what `bottom_cap` found in a patch into full-frame pixels and a status."""
    if found[HOW] != FOUND:
        return no_bottom(STATUS_WORDS[int(found[HOW])])
    unc = math.hypot(float(found[UNC]), CLIPPED_PX if is_clipped(patch) else 0.0)
    return BottomFit(float(found[COLUMN]) + patch.x0, float(found[ROW]) + patch.y0, unc, float(found[REST]), "ok")


def no_bottom(status: str) -> BottomFit:
    """No lowest point, and the word that says why."""
    return BottomFit(math.nan, math.nan, math.nan, math.nan, status)
