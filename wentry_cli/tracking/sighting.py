"""One frame, one look: cut the patch, fit the shape, the bottom and the separation line."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.circle import Circle, fit_circle
from wentry_cli.contours.departure import NONE, Departure, extremes
from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.fitting import FitRequest, bottom_unc, fit_shape, fit_with_bottom, parse_free
from wentry_cli.contours.local_bottom import BottomFit
from wentry_cli.contours.separation import SeparationFit, find_separation
from wentry_cli.imaging.background import Background, steadied
from wentry_cli.imaging.order_statistics import median_of
from wentry_cli.imaging.patch import Patch
from wentry_cli.tracking.prediction import usable
from wentry_cli.tracking.round_levels import lightest_within
from wentry_cli.tracking.source import Frames, read_patch

# Beyond this, px and share of R, the bottom alone and the whole outline do not see the same sphere.
LARGEST_OFFSET_PX, LARGEST_MISFIT = 0.5, 0.015
CLEAR_GROUND_PX = 5.0
CLEAR_GROUND = 0.85  # of the plain ground nearby, which is looked for between these distances, before and behind
BESIDE_PX, DARKEST_GROUND = (2.0, 4.0), 0.5
MOST_CROWDED, WHOLE_ARC = 0.2, 0.98
LEAST_OBLATE = 0.05  # of the stretch from 1: a rounder sphere does not tell how it leans
WITHIN_PX, RAYS_WITHIN, FURTHER_PX = 4.0, 24, (1.5, 1.0)

Box = tuple[float, float, float, float]


class Look(NamedTuple):
    """How one frame is to be looked at.

    ``box`` is what is read (left, top, right, bottom), ``free`` the parameters to fit, ``top_y_px`` the row above
    which the outline is not the sphere's, ``motion_px`` the displacement during the exposure. ``outline`` is ellipse
    or circle (``one_sided``: what disagrees lies outside); ``bottom`` and ``separation`` say what else is measured,
    ``also_free`` that a second fit leaves radius and tilt free. ``tilt_deg`` is the tilt to start from or to hold,
    None keeps that of the prediction, and ``tilt_unc_deg`` how well it is known. ``departure`` is how the outline of
    this sphere is known to differ from an ellipse. ``beside_band``: the outline is looked at right up to the surface
    band, whose blur may bend its end. ``blur_px`` is the blur of the frames just before, NaN where they do not lead to
    this one.
    """

    box: Box
    free: str = "x y stretch"
    top_y_px: float = -math.inf
    motion_px: tuple[float, float] = (0.0, 0.0)
    level: str = "accurate"
    outline: str = "ellipse"
    bottom: bool = True
    separation: bool = False
    one_sided: bool = False
    also_free: bool = False
    tilt_deg: float | None = None
    tilt_unc_deg: float = 0.0
    departure: Departure = NONE
    beside_band: bool = False
    blur_px: float = math.nan


class Sighting(NamedTuple):
    """What one frame showed.

    ``fit`` is None where nothing could be fitted, ``status`` is that of the whole row; ``free_fit`` is
    the fit with free radius, where there was one; ``line`` is the row above which the outline was not looked at, from
    the centre down in semi-axes, ``departure`` what the ellipse of the fit leaves out of the outline. ``inside`` is the
    transmission just within the lower outline, ``lightest`` that of the lightest ring within a circle.
    """

    frame: int
    status: str
    fit: SilhouetteFit | None = None
    bottom: BottomFit | None = None
    separation: SeparationFit | None = None
    free_fit: SilhouetteFit | None = None
    wet: bool = False
    circle: bool = False
    line: float = -math.inf
    departure: Departure = NONE
    inside: float = math.nan
    lightest: float = math.nan

    @property
    def ok(self) -> bool:
        """Whether the fit may be used."""
        return self.status == "ok" and self.fit is not None

    @property
    def traced(self) -> bool:
        """Whether the fit tells where the sphere is, even where it is not good enough for a row of its own."""
        return self.fit is not None and (self.ok or (self.circle and self.fit.status == "ok"))

    @property
    def whole(self) -> bool:
        """Whether all of the outline was looked at."""
        return self.fit is not None and self.fit.arc_fraction > WHOLE_ARC

    @property
    def outline(self) -> tuple[float, float]:
        """Greatest half-width over the radius, and the lowest row, of the outline that was fitted."""
        assert self.fit is not None
        if not self.departure:
            return self.fit.stretch, self.fit.bottom_y_px
        return extremes(self.fit.shape, self.departure)


def sight(frames: Frames, index: int, ground: Background, guess: EllipseShape, look: Look) -> Sighting:
    """Measure one frame as ``look`` says, starting from ``guess``."""
    patch = read_steadied(frames, index, ground, guess, look.box)
    if isinstance(patch, str):
        return Sighting(index, patch)
    seen = examine(patch, index, guess, look)
    if seen.status == "out_of_frame" and guess.bottom_y < frames.shape[0] - 1:
        return seen._replace(status="short_arc")
    return seen


def read_steadied(frames: Frames, index: int, ground: Background, shape: EllipseShape, box: Box) -> Patch | str:
    """The part of a frame inside ``box`` without the flicker of the light; a status word where there is none."""
    patch = read_patch(frames, index, ground, box)
    if isinstance(patch, str):
        return patch
    return steadied(patch, (shape.x, shape.y, shape.semi_across, shape.semi_along))


def examine(patch: Patch, index: int, guess: EllipseShape, look: Look) -> Sighting:
    """Fit the shape in a patch and, where that went well, its bottom and separation line."""
    if look.outline == "circle":
        return _examine_circle(patch, index, Circle(guess.x, guess.y, guess.radius * guess.stretch), look)
    also = _with_size(look.free, guess.stretch) if look.also_free and " R" not in look.free else ""
    fit, bottom, free = fit_with_bottom(patch, guess, _request(look, also), bottom=look.bottom)
    if not usable(fit):
        return Sighting(index, fit.status if fit.status != "ok" else "poor_fit", fit)
    if look.beside_band:
        fit = _doubted_beside_band(patch, fit, look)
    shape = fit.shape
    lowest = extremes(shape, look.departure)[1] if look.departure else fit.bottom_y_px
    if bottom is not None and not abs(bottom.y_px - lowest) < LARGEST_OFFSET_PX + LARGEST_MISFIT * fit.radius_px:
        bottom = dataclasses.replace(bottom, status="poor_fit")
    separation = find_separation(patch, fit, departure=look.departure) if look.separation else None
    if " R" in look.free:
        free = fit
    elif also and (wanted := _with_size(look.free, shape.stretch)) != also:
        free = fit_shape(patch, shape, _request(look)._replace(free=parse_free(wanted), blur_px=math.nan))
    return Sighting(
        index,
        "ok",
        fit,
        bottom,
        separation,
        free_fit=free if free is not None and usable(free) else None,
        line=(look.top_y_px - shape.y) * shape.stretch**2 / shape.radius,
        departure=look.departure,
        inside=_inside(patch, shape, look.top_y_px),
    )


def _examine_circle(patch: Patch, index: int, guess: Circle, look: Look) -> Sighting:
    fit = fit_circle(patch, guess, one_sided=look.one_sided, motion_px=look.motion_px, level=look.level, followed=True)
    if not usable(fit):
        return Sighting(index, fit.status if fit.status != "ok" else "poor_fit", fit)
    crowded = ring_share(patch, fit, CLEAR_GROUND_PX) > MOST_CROWDED
    return Sighting(
        index,
        "occluded" if crowded else "ok",
        fit,
        free_fit=fit,
        circle=True,
        inside=_inside(patch, fit.shape, -math.inf),
        lightest=lightest_within(patch, fit),
    )


def _inside(patch: Patch, shape: EllipseShape, top_y_px: float) -> float:
    """The transmission just within the lower outline."""
    x, y, top = shape.x - patch.x0, shape.y - patch.y0, top_y_px - patch.y0
    return level_within(patch.values, x, y, shape.semi_across, shape.semi_along, top)


def _with_size(free: str, stretch: float) -> str:
    """The parameters with the radius, and with the tilt unless the sphere is so round that it has none to tell."""
    leans = "stretch" in free and "tilt" not in free and abs(stretch - 1.0) > LEAST_OBLATE
    return free.replace("x y", "x y R") + (" tilt" if leans else "")


def _request(look: Look, also: str = "") -> FitRequest:
    return FitRequest(
        parse_free(look.free),
        look.top_y_px,
        look.motion_px,
        look.level,
        False,
        look.departure,
        look.tilt_unc_deg,
        followed=True,
        blur_px=look.blur_px,
        also=parse_free(also) if also else (),
    )


def _doubted_beside_band(patch: Patch, fit: SilhouetteFit, look: Look) -> SilhouetteFit:
    """The fit, doubted by what it changes by when the outline is left out a little further from the surface band."""
    # scanned for anew: what bends the end of the outline may hold a fit that goes on from this one
    further = (
        fit_shape(patch, fit.shape, _request(look._replace(top_y_px=look.top_y_px + away, blur_px=math.nan)))
        for away in FURTHER_PX
    )
    change = next((other.shape.vector() - fit.shape.vector() for other in further if usable(other)), None)
    if change is None:
        return fit
    covariance = fit.covariance + np.outer(change, change)
    unc = bottom_unc(fit.shape, covariance)
    return fit._replace(covariance=covariance, stretch_unc=math.sqrt(covariance[3, 3]), bottom_y_unc_px=unc)


def ring_share(patch: Patch, fit: SilhouetteFit, distance_px: float) -> float:
    """Share of a circle's outline with no plain ground at a distance outside; 1 where nothing is in the patch.

    A splash ring stands close there. In a gap that is hardly wider than the blur the edge of the sphere and that of
    the ring pull at each other. Plain is what is about as bright as the brightest nearby: the floor of a cavity is
    darker than the ground, and the sphere stands out from it all the same.
    """
    angle = np.arange(0.0, 2.0 * math.pi, 2.0 * math.pi / 180)
    away = np.append(np.arange(BESIDE_PX[0], distance_px + BESIDE_PX[1]), distance_px)
    reach = fit.radius_px + away[:, None]
    column = np.rint(fit.center_x_px - patch.x0 + reach * np.cos(angle)).astype(np.intp)
    row = np.rint(fit.center_y_px - patch.y0 + reach * np.sin(angle)).astype(np.intp)
    inside = (row >= 0) & (column >= 0) & (row < patch.values.shape[0]) & (column < patch.values.shape[1])
    if not inside[-1].any():
        return 1.0
    rows, columns = patch.values.shape
    levels = np.nan_to_num(patch.values[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)])
    plain = np.clip(np.where(inside, levels, 0.0).max(axis=0), DARKEST_GROUND, 1.0)
    return float(np.mean((levels[-1] < CLEAR_GROUND * plain)[inside[-1]]))


@compiled
def level_within(values: NDArray[np.float32], x: float, y: float, across: float, along: float, top_y: float) -> float:
    """Median level a few pixels within the lower half of an upright outline, below the row ``top_y``; NaN if unseen."""
    found = np.empty(RAYS_WITHIN)
    number = 0
    for k in range(RAYS_WITHIN):
        angle = math.pi * (k + 0.5) / RAYS_WITHIN
        row = round(y + (along - WITHIN_PX) * math.sin(angle))
        column = round(x + (across - WITHIN_PX) * math.cos(angle))
        if row > top_y and 0 <= row < values.shape[0] and 0 <= column < values.shape[1]:
            level = values[row, column]
            if not math.isnan(level):
                found[number] = level
                number += 1
    return median_of(found, number) if number else math.nan
