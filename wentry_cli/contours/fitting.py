"""From a patch and a guess to a fit with a status: what the side view and the top view have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.bottom_cap import ELSEWHERE, HOW
from wentry_cli.contours.clipped import is_clipped, shift_covariance
from wentry_cli.contours.ellipse import PARAMETERS, EllipseShape, SilhouetteFit
from wentry_cli.contours.local_bottom import BottomFit, bottom_found, fit_local_bottom
from wentry_cli.contours.outline_fit import (
    KNOWN,
    QUALITY,
    VERDICT,
    VERDICTS,
    OutlineRequest,
    bottom_spread,
    fit_outline,
    spreads,
)
from wentry_cli.contours.scan_bottom import fit_scan_bottom
from wentry_cli.imaging.patch import Patch

LEVELS = ("fast", "accurate")
LEAST_ARC = 0.12
LEAST_ARC_FREE_SIZE = 0.2
MOST_GATED = 0.75
MOST_GATED_ONE_SIDED = 0.6
MOST_RESIDUAL_PX = 1.0
MOST_CLIPPED = 0.95
# With half of the outline hidden, the rest must agree with itself: else nobody knows which half is right. The less is
# left of it, the better; less than a quarter is enough where that quarter agrees as only the sphere does.
HALF_GATED, FEW_KEPT = 0.5, 0.85
MOST_RESIDUAL_GATED_PX, MOST_RESIDUAL_FEW_PX = 0.12, 0.03


class FitRequest(NamedTuple):
    """What to fit and from which part of the outline; ``tilt_unc_deg`` is how well a tilt that is held is known.

    ``followed`` says that the guess comes from frames just before, of which a scan makes use.
    """

    free: tuple[str, ...]
    top_y_px: float = -math.inf
    motion_px: tuple[float, float] = (0.0, 0.0)
    level: str = "accurate"
    one_sided: bool = False
    departure: tuple[float, ...] = ()
    tilt_unc_deg: float = 0.0
    followed: bool = False


@cache
def parse_free(free: str) -> tuple[str, ...]:
    """The free parameters in the order of PARAMETERS; ValueError where the set has no x, no y or a foreign name."""
    names = free.split()
    if unknown := set(names) - set(PARAMETERS):
        raise ValueError(f"free parameters are a subset of {' '.join(PARAMETERS)}, not {sorted(unknown)}")
    if not {"x", "y"} <= set(names):
        raise ValueError("the centre (x and y) is always fitted")
    return tuple(name for name in PARAMETERS if name in names)


def unmeasured(arc: float, gated: float, status: str) -> SilhouetteFit:
    """A fit without values: NaN and the word that says why."""
    nothing = EllipseShape(*[math.nan] * 5)
    quality = {"blur": math.nan, "arc": arc, "gated": gated, "residual": math.nan}
    return assemble_fit(nothing, np.full((5, 5), math.nan), quality, status)


def assemble_fit(
    shape: EllipseShape,
    covariance: NDArray[np.float64],
    quality: dict[str, float],
    status: str,
    turn: tuple[float, float] = (math.nan, math.nan),
) -> SilhouetteFit:
    """Gather a result; ``covariance`` is 5 x 5 with zero rows where a parameter was held.

    ``turn`` is the step to the tilt that the outline asks for, and its uncertainty, rad.
    """
    spread = spreads(shape.radius, shape.stretch, math.radians(shape.tilt_deg), covariance).tolist()
    return _gathered(shape, covariance, (quality["blur"], quality["arc"], quality["gated"], quality["residual"]),
                     status, (*turn, *spread))  # fmt: skip


def _gathered(
    shape: EllipseShape,
    covariance: NDArray[np.float64],
    quality: Sequence[float],
    status: str,
    known: Sequence[float],
) -> SilhouetteFit:
    """``quality`` is blur, arc, gated share and residual; ``known`` the turn and behind it the ``spreads``."""
    blur, arc, gated, residual = quality
    step, step_unc, x_unc, y_unc, radius_unc, stretch_unc, tilt_unc, bottom_unc = known
    return SilhouetteFit(
        center_x_px=shape.x,
        center_y_px=shape.y,
        radius_px=shape.radius,
        stretch=shape.stretch,
        tilt_deg=shape.tilt_deg,
        center_x_unc_px=x_unc,
        center_y_unc_px=y_unc,
        radius_unc_px=radius_unc,
        stretch_unc=stretch_unc,
        tilt_unc_deg=math.degrees(tilt_unc),
        bottom_y_px=shape.bottom_y,
        bottom_y_unc_px=bottom_unc,
        covariance=covariance,
        blur_px=blur,
        arc_fraction=arc,
        gated_fraction=gated,
        residual_rms_px=residual,
        status=status,
        seen_tilt_deg=shape.tilt_deg + math.degrees(step),
        seen_tilt_unc_deg=math.degrees(step_unc),
    )


def bottom_unc(shape: EllipseShape, covariance: NDArray[np.float64]) -> float:
    """Standard uncertainty of the lowest row, px, from the covariance of all parameters; NaN where it is not known."""
    return bottom_spread(shape.radius, shape.stretch, math.radians(shape.tilt_deg), covariance)


@cache
def indices_of(free: tuple[str, ...]) -> NDArray[np.int64]:
    """Where the free parameters stand in PARAMETERS; read only."""
    return np.array([PARAMETERS.index(name) for name in free])


def fit_shape(patch: Patch, guess: EllipseShape, request: FitRequest) -> SilhouetteFit:
    """Fit the free parameters of the ellipse of revolution; raises ValueError on an unknown level."""
    return _fit(patch, guess, request, bottom=False)[0]


def fit_with_bottom(patch: Patch, guess: EllipseShape, request: FitRequest) -> tuple[SilhouetteFit, BottomFit]:
    """As `fit_shape`, and the lowest point of the cap alone, from the same pixels where they tell it."""
    fit, found = _fit(patch, guess, request, bottom=True)
    if fit.status == "ok" and found[HOW] != ELSEWHERE:
        return fit, bottom_found(patch, found)
    locate = fit_local_bottom if request.level == "accurate" else fit_scan_bottom
    return fit, locate(patch, fit, motion_px=request.motion_px)


def _fit(
    patch: Patch, guess: EllipseShape, request: FitRequest, *, bottom: bool
) -> tuple[SilhouetteFit, NDArray[np.float64]]:
    if request.level not in LEVELS:
        raise ValueError(f"level is one of {', '.join(LEVELS)}, not {request.level!r}")
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    vector = guess.vector(patch.x0, patch.y0, request.departure)
    free = indices_of(request.free)
    top = request.top_y_px - patch.y0
    least = LEAST_ARC_FREE_SIZE if "R" in request.free else LEAST_ARC
    settings = np.array([top, *request.motion_px, patch.ceiling, request.one_sided], np.float64)
    tilt_unc = math.radians(request.tilt_unc_deg)
    refines = request.level == "accurate"
    followed, bottom = request.followed and not refines, bottom and refines
    noise = float(patch.noise_floor)
    wanted = OutlineRequest(settings, refines, noise, least, tilt_unc, bottom, followed)
    outline, covariance, cap = fit_outline(values, vector, free, wanted)
    found = outline.tolist()
    quality, known = found[QUALITY:KNOWN], found[KNOWN:]
    if status := VERDICTS[int(found[VERDICT])]:
        lost = status == "no_edge" and np.mean(~(values < patch.ceiling)) > MOST_CLIPPED
        return unmeasured(quality[1], quality[2], "saturated" if lost else status), cap
    x, y, radius, stretch, tilt = vector[:5].tolist()
    shape = EllipseShape(x + patch.x0, y + patch.y0, radius, stretch, math.degrees(tilt))
    if is_clipped(patch):
        covariance[np.ix_(free, free)] += shift_covariance(vector, free, top)
        known[2:] = spreads(radius, stretch, tilt, covariance).tolist()
    if "tilt" in request.free:
        known[:2] = 0.0, known[6]
    _, _, gated, residual = quality
    return _gathered(shape, covariance, quality, fit_status(gated, residual, request), known), cap


def fit_status(gated: float, residual: float, request: FitRequest) -> str:
    """``ok`` only where the outline agrees with itself."""
    if residual > MOST_RESIDUAL_PX:
        return "poor_fit"
    part = (gated - HALF_GATED) / (MOST_GATED - HALF_GATED)
    limit = MOST_RESIDUAL_GATED_PX + min(part, 1.0) * (MOST_RESIDUAL_FEW_PX - MOST_RESIDUAL_GATED_PX)
    if part > 0.0 and residual > limit:
        return "occluded"
    if gated <= (MOST_GATED_ONE_SIDED if request.one_sided else MOST_GATED):
        return "ok"
    return "ok" if not request.one_sided and gated < FEW_KEPT else "occluded"
