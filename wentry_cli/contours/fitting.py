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
    Told,
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

    ``followed`` says that the guess comes from frames just before, of which a scan makes use; ``blur_px`` is the blur
    in these where the guess is so good that the likelihood needs no scan, NaN where it may not be. ``also`` are the
    parameters of a second fit to the same pixels.
    """

    free: tuple[str, ...]
    top_y_px: float = -math.inf
    motion_px: tuple[float, float] = (0.0, 0.0)
    level: str = "accurate"
    one_sided: bool = False
    departure: tuple[float, ...] = ()
    tilt_unc_deg: float = 0.0
    followed: bool = False
    blur_px: float = math.nan
    also: tuple[str, ...] = ()


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
    return np.array([PARAMETERS.index(name) for name in free], dtype=np.int64)


class OutlineFit(NamedTuple):
    """A fit, what the same pixels say of its lowest point, and the second fit, None where they do not tell it."""

    fit: SilhouetteFit
    bottom: BottomFit | None = None
    other: SilhouetteFit | None = None


def fit_shape(patch: Patch, guess: EllipseShape, request: FitRequest) -> SilhouetteFit:
    """Fit the free parameters of the ellipse of revolution; raises ValueError on an unknown level."""
    return _fit(patch, guess, request, bottom=False).fit


def fit_with_bottom(patch: Patch, guess: EllipseShape, request: FitRequest, *, bottom: bool = True) -> OutlineFit:
    """As `fit_shape`, with the lowest point of the cap alone and the second fit that were asked for."""
    found = _fit(patch, guess, request, bottom=bottom)
    if bottom and found.bottom is None:
        locate = fit_local_bottom if request.level == "accurate" else fit_scan_bottom
        found = found._replace(bottom=locate(patch, found.fit, motion_px=request.motion_px))
    if request.also and found.other is None and found.fit.status == "ok":
        shape = found.fit.shape
        return found._replace(other=fit_shape(patch, shape, request._replace(free=request.also, also=())))
    return found


def _fit(patch: Patch, guess: EllipseShape, request: FitRequest, *, bottom: bool) -> OutlineFit:
    if request.level not in LEVELS:
        raise ValueError(f"level is one of {', '.join(LEVELS)}, not {request.level!r}")
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    vector = guess.vector(patch.x0, patch.y0, request.departure)
    free = indices_of(request.free)
    outline = fit_outline(values, vector, free, _wanted(patch, request, bottom=bottom))
    found = outline.fit.numbers.tolist()
    quality = found[QUALITY:KNOWN]
    if status := VERDICTS[int(found[VERDICT])]:
        lost = status == "no_edge" and np.mean(~(values < patch.ceiling)) > MOST_CLIPPED
        return OutlineFit(unmeasured(quality[1], quality[2], "saturated" if lost else status))
    fit = _told(patch, outline.fit, request)
    if fit.status != "ok":
        return OutlineFit(fit)
    told = bottom_found(patch, outline.cap) if outline.cap[HOW] != ELSEWHERE else None
    second = _told(patch, outline.second, request._replace(free=request.also)) if outline.second.numbers.size else None
    return OutlineFit(fit, told, second)


def _wanted(patch: Patch, request: FitRequest, *, bottom: bool) -> OutlineRequest:
    """The request in the pixels of the patch, as compiled code reads it."""
    settings = np.array(
        [request.top_y_px - patch.y0, *request.motion_px, patch.ceiling, request.one_sided], dtype=np.float64
    )
    refines = request.level == "accurate"
    return OutlineRequest(
        settings,
        refines,
        float(patch.noise_floor),
        _least_arc(request.free),
        math.radians(request.tilt_unc_deg),
        bottom and refines,
        request.followed,
        request.blur_px,
        indices_of(request.also),
        _least_arc(request.also),
    )


def _least_arc(free: tuple[str, ...]) -> float:
    return LEAST_ARC_FREE_SIZE if "R" in free else LEAST_ARC


def _told(patch: Patch, told: Told, request: FitRequest) -> SilhouetteFit:
    """The fit that compiled code tells, in full-frame pixels."""
    vector, numbers, covariance = told.vector, told.numbers.tolist(), told.covariance
    quality, known = numbers[QUALITY:KNOWN], numbers[KNOWN:]
    x, y, radius, stretch, tilt = vector[:5].tolist()
    if is_clipped(patch):
        free = indices_of(request.free)
        covariance[np.ix_(free, free)] += shift_covariance(vector, free, request.top_y_px - patch.y0)
        known[2:] = spreads(radius, stretch, tilt, covariance).tolist()
    if "tilt" in request.free:
        known[:2] = 0.0, known[6]
    _, _, gated, residual = quality
    shape = EllipseShape(x + patch.x0, y + patch.y0, radius, stretch, math.degrees(tilt))
    return _gathered(shape, covariance, quality, fit_status(gated, residual, request), known)


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
