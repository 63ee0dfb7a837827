"""How close the splash ring stands to the sphere in the top view, and what it does to the circle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wentry_cli.imaging.background import Background
from wentry_cli.tracking.sighting import Sighting, ring_share
from wentry_cli.tracking.source import Frames, read_patch

# A ring nearer than the first hides the edge, beyond the second it does nothing to it; between, its blur pulls.
TOUCHES_PX, CLEAR_PX = 3.0, 6.0
MOST_TOUCHED = 0.55
MOST_PULLED = 0.7
# A ring that touches more of the outline than was left out of the fit has been taken for the sphere.
MOST_UNNOTICED = 0.15
# Measured: a ring 3 to 6 px off moves the radius by 0.02 px times its share of the outline beyond a fifth.
FREE_SHARE, PULL_PX = 0.2, 0.02
SUSPICIOUS = 0.05
LEAST_STRAY, NEAR_STRAY = 4.0, 2.0


def judge_rings(frames: Frames, ground: Background, seen: Sequence[Sighting]) -> list[Sighting]:
    """Decide which circles beside a splash ring count: the ring is seen where it is, and its pull is allowed for.

    A circle counts while the ring touches at most 55 % of its outline, and the rest agrees with itself as well as in
    other frames; the uncertainty of its radius grows with the share of the outline at which the ring stands near.
    Circles whose residual is four times that of plain ones have the splash in them and are ``occluded``.
    """
    fits = [item.fit for item in seen if item.ok and item.fit is not None]
    plain = [fit for fit in fits if fit.gated_fraction < SUSPICIOUS]
    residuals = [fit.residual_rms_px for fit in plain or fits]
    usual = float(np.median(residuals)) if residuals else math.inf
    return [_judge(frames, ground, item, usual) for item in seen]


def _judge(frames: Frames, ground: Background, item: Sighting, usual: float) -> Sighting:
    fit = item.fit
    if fit is None or not item.traced:
        return item
    if fit.residual_rms_px > LEAST_STRAY * usual:
        return Sighting(item.frame, "occluded")
    if item.ok and fit.gated_fraction < SUSPICIOUS:
        return item
    reach = fit.radius_px + CLEAR_PX + 2.0
    x, y = fit.center_x_px, fit.center_y_px
    patch = read_patch(frames, item.frame, ground, (x - reach, y - reach, x + reach, y + reach))
    if isinstance(patch, str):
        return item
    touched = ring_share(patch, fit, TOUCHES_PX)
    pulled = max(0.0, ring_share(patch, fit, CLEAR_PX) - touched)
    crowded = not item.ok
    if touched > fit.gated_fraction + MOST_UNNOTICED:
        return Sighting(item.frame, "occluded")
    if touched > MOST_TOUCHED or pulled > MOST_PULLED or (crowded and fit.residual_rms_px > NEAR_STRAY * usual):
        return Sighting(item.frame, "occluded")
    pull = PULL_PX * max(0.0, pulled - FREE_SHARE)
    return item._replace(status="ok", fit=fit._replace(radius_unc_px=math.hypot(fit.radius_unc_px, pull)))
