"""How much a sphere departs from its ellipse, told by the frames in air in which it is known to be undeformed.

Below the surface only part of the outline is seen, and a shape that is no ellipse by half a per cent moves the size
that this part suggests by two. In air the same part of the same sphere can be fitted in the same way, and the whole
outline says what should have come out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.departure import NONE, Departure, Shape, extremes, measure_departure, pool_departures
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.imaging.patch import Patch
from wentry_cli.tracking.flight import margin_of
from wentry_cli.tracking.prediction import box_around
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.sighting import Look, Sighting, examine, read_steadied
from wentry_cli.tracking.source import Frames, read_patch

Row = tuple[float, float, float, float, float, float]  # three differences and their standard uncertainties
MOST_FRAMES = 8
FEWEST_FRAMES = 3
SIGNIFICANT, FORMAL = 4.0, 0.5
LEFT_OVER = 0.35
SHORT_LINE = 0.6
# Where no frame in air shows a whole outline nobody knows the shape: so much of the radius do moulded spheres depart.
UNSEEN = 0.002
RADIUS_PER_WAVE = 4.0  # relative change of the radius that half an outline tells
MOST_LEARNT = 24
# What the stretch of an outline that is no ellipse means, its half-width or that of the ellipse: doubted by this share
# of their difference.
MEANING = 1.0
# How well what was learnt in air holds below the surface is told by the residuals, but never known better than this.
LEAST_DOUBT = 0.05


@dataclass(frozen=True)
class ShapeCheck:
    """What a partial outline gets wrong in air.

    ``radius_ratio``: its free radius over that of the whole outline; ``stretch_offset``: its stretch with the right
    radius, minus one, at the row ``line`` (from the centre down in semi-axes) and ``short_offset`` at ``SHORT_LINE``;
    ``bottom_offset_px``: the lowest point of its ellipse minus that of the outline itself. Each is
    its neutral value where it does not differ by four standard errors: the sphere is an ellipse as far as one can see.
    """

    radius_ratio: float = 1.0
    radius_ratio_unc: float = 0.0
    stretch_offset: float = 0.0
    bottom_offset_px: float = 0.0
    line: float = 0.0
    short_offset: float = 0.0

    def stretch_doubt(self, line: float) -> float:
        """How far off the stretch of an outline that is seen below ``line`` may be."""
        known = (self.line, max(SHORT_LINE, self.line + 0.01))
        return float(np.interp(line, known, (abs(self.stretch_offset), abs(self.short_offset))))


UNKNOWN = Shape()
NO_CHECK = ShapeCheck()


def doubted_radius(air: PooledRadius, dry: Sequence[Sighting]) -> PooledRadius:
    """The pooled radius in air, doubted by what it would change by were the stretch not free but one, as it is there.

    A whole outline tells radius and stretch apart. Of a part of it that the surface band or the frame leaves, a ground
    that is not quite known bends both. Nothing changes where the stretch is one within four standard errors.
    """
    free = [item.free_fit for item in dry if item.ok and item.free_fit is not None]
    seen = [fit for fit in free if fit.covariance[3, 3] > 0.0 and fit.covariance[2, 2] > 0.0]
    if not air.known or len(seen) < FEWEST_FRAMES:
        return air
    change = np.array([fit.covariance[2, 3] / fit.covariance[3, 3] * (fit.stretch - 1.0) for fit in seen])
    middle, error = float(np.mean(change)), float(np.std(change, ddof=1)) / math.sqrt(len(change))
    return replace(air, unc=math.hypot(air.unc, middle)) if abs(middle) > SIGNIFICANT * error else air


def learn_departure(frames: Frames, ground: Background, dry: Sequence[Sighting]) -> Shape:
    """How the sphere departs from an ellipse, from the frames in air that show its whole outline."""
    whole = [item for item in dry if item.ok and item.whole]
    if not whole:
        return Shape()
    found = []
    for index in np.unique(np.linspace(0, len(whole) - 1, MOST_LEARNT).astype(int)):
        fit = whole[index].fit
        assert fit is not None
        patch = read_patch(frames, whole[index].frame, ground, _box(fit.shape))
        if not isinstance(patch, str):
            found.append(measure_departure(patch, fit))
    assert whole[0].fit is not None
    return pool_departures(found, whole[0].fit.radius_px)


def check_shape(
    frames: Frames,
    ground: Background,
    dry: Sequence[Sighting],
    wet: Sequence[Sighting],
    level: str,
    *,
    shape: Shape = UNKNOWN,
) -> ShapeCheck:
    """Fit spheres in air over the part of the outline that the wet fits saw, and compare with the whole.

    With a departure in the ``shape`` what it leaves unexplained is compared, and what it explains is doubted by a
    share; what of the shape is not clear is doubted whole.
    """
    departure, line = shape.waves, _usual_line(wet)
    whole = [item for item in dry if item.ok and item.whole]
    if math.isnan(line):
        return NO_CHECK
    if len(whole) < FEWEST_FRAMES:
        radius_px = next((item.fit.radius_px for item in dry if item.ok and item.fit is not None), 0.0)
        return _by_the_waves(shape if whole else Shape(doubt=math.hypot(shape.doubt, UNSEEN)), radius_px)
    spheres = _read_spheres(frames, ground, whole, level)
    seen, error = _significant([sphere.compare(line, departure) for sphere in spheres])
    short, _ = _significant([sphere.held_stretch(SHORT_LINE, departure) for sphere in spheres])
    doubt = math.hypot(float(error[0]), LEFT_OVER * float(seen[0])) if seen[0] else 0.0
    assert whole[0].fit is not None
    left = ShapeCheck(
        radius_ratio=1.0 + float(seen[0]),
        radius_ratio_unc=doubt,
        stretch_offset=math.hypot(float(seen[1]), shape.doubt),
        bottom_offset_px=math.hypot(float(seen[2]), shape.doubt * whole[0].fit.radius_px),
        line=line,
        short_offset=math.hypot(float(short[1]), shape.doubt),
    )
    if not departure:
        return left
    explained, _ = _significant([sphere.compare(line, NONE) for sphere in spheres])
    short, _ = _significant([sphere.held_stretch(SHORT_LINE, NONE) for sphere in spheres])
    carried = _carried(wet, [sphere.held_residual(line) for sphere in spheres])
    meaning = MEANING * (extremes(EllipseShape(0.0, 0.0, 1.0), departure)[0] - 1.0)
    return replace(
        left,
        radius_ratio_unc=math.hypot(left.radius_ratio_unc, carried * float(explained[0])),
        stretch_offset=math.hypot(left.stretch_offset, carried * float(explained[1]), meaning),
        bottom_offset_px=math.hypot(left.bottom_offset_px, carried * float(explained[2])),
        short_offset=math.hypot(left.short_offset, carried * float(short[1]), meaning),
    )


def radius_ratio(
    frames: Frames,
    ground: Background,
    dry: Sequence[Sighting],
    wet: Sequence[Sighting],
    level: str,
    *,
    departure: Departure = NONE,
) -> float:
    """The ``radius_ratio`` of ``check_shape`` alone, for which a sphere is fitted once and not thrice."""
    line = _usual_line(wet)
    whole = [item for item in dry if item.ok and item.whole]
    if math.isnan(line) or len(whole) < FEWEST_FRAMES:
        return 1.0
    spheres = _read_spheres(frames, ground, whole, level)
    return 1.0 + float(_significant([sphere.free_radius(line, departure) for sphere in spheres])[0][0])


def _usual_line(wet: Sequence[Sighting]) -> float:
    """The row, from the centre down in semi-axes, from which on the fits with free radius saw the outline; or NaN."""
    lines = [item.line for item in wet if item.ok and item.free_fit is not None and math.isfinite(item.line)]
    return float(np.median(lines)) if lines else math.nan


def _by_the_waves(shape: Shape, radius_px: float) -> ShapeCheck:
    """What is doubted where too few whole outlines are there to be compared: what the waves themselves leave open."""
    doubt = math.hypot(shape.doubt, LEFT_OVER * float(np.linalg.norm(shape.waves)) if shape.waves else 0.0)
    return ShapeCheck(
        radius_ratio_unc=RADIUS_PER_WAVE * doubt,
        stretch_offset=doubt,
        bottom_offset_px=doubt * radius_px,
        short_offset=doubt,
    )


def _carried(wet: Sequence[Sighting], plain_px: Sequence[float]) -> float:
    """What the departure leaves of the residual below the surface, as a share of the residual in air without it."""
    left = [item.fit.residual_rms_px for item in wet if item.ok and item.fit is not None]
    plain = [value for value in plain_px if math.isfinite(value)]
    if not left or not plain:
        return 1.0
    share = float(np.median(left)) / max(float(np.median(plain)), 1e-6)
    return min(1.0, max(LEAST_DOUBT, share))


def _significant(rows: Sequence[Row | None]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Medians over frames, zero where they are not significant, and their standard errors.

    A few frames may agree by chance: the errors are no less than half of what the uncertainties of the fits make them
    (half, since the residual of a shape that is no ellipse widens these).
    """
    values, uncs = np.split(np.array([row for row in rows if row is not None]).reshape(-1, 6), 2, axis=1)
    if len(values) < FEWEST_FRAMES:
        return np.zeros(3), np.zeros(3)
    middle = np.median(values, axis=0)
    scatter = np.maximum(1.4826 * np.median(np.abs(values - middle), axis=0), FORMAL * np.median(uncs, axis=0))
    error = scatter * 1.25 / math.sqrt(len(values)) + 1e-6
    return np.where(np.abs(middle) > SIGNIFICANT * error, middle, 0.0), error


@dataclass(frozen=True)
class Partial:
    """A sphere in air, to be fitted over a part of its outline; ``shape`` is the circle that its whole outline told.

    ``blur_px`` is the blur of that.
    """

    frame: int
    patch: Patch
    shape: EllipseShape
    level: str
    blur_px: float

    def held_stretch(self, line: float, departure: Departure) -> Row | None:
        """The stretch, less one, with the radius held to that of the whole outline, as the middle of a row."""
        held = self._fit(line, departure)
        if not held.ok or held.fit is None:
            return None
        return 0.0, held.fit.stretch - 1.0, 0.0, 0.0, held.fit.stretch_unc, 0.0

    def held_residual(self, line: float) -> float:
        """Residual, px, with the radius held, about an ellipse."""
        held = self._fit(line, NONE)
        return held.fit.residual_rms_px if held.ok and held.fit is not None else math.nan

    def free_radius(self, line: float, departure: Departure) -> Row | None:
        """Error of the radius (relative) where it is free, as the start of a row."""
        free = self._fit(line, departure, free="x y R stretch")
        if not free.ok or free.fit is None:
            return None
        radius = self.shape.radius
        return free.fit.radius_px / radius - 1.0, 0.0, 0.0, free.fit.radius_unc_px / radius, 0.0, 0.0

    def compare(self, line: float, departure: Departure) -> Row | None:
        """Errors of radius (relative, free), of stretch and of the lowest row (px; radius held)."""
        held = self._fit(line, departure, bottom=True, also_free=True)
        if held.free_fit is None or held.fit is None or not held.ok:
            return None
        free, radius = held.free_fit, self.shape.radius
        local = held.bottom
        seen = local is not None and local.status == "ok"
        bottom = held.outline[1] - local.y_px if seen and local is not None else 0.0
        bottom_unc = math.hypot(held.fit.bottom_y_unc_px, local.y_unc_px) if seen and local is not None else 0.0
        wider, unc = free.radius_px / radius - 1.0, free.radius_unc_px / radius
        return wider, held.fit.stretch - 1.0, bottom, unc, held.fit.stretch_unc, bottom_unc

    def _fit(
        self,
        line: float,
        departure: Departure,
        *,
        free: str = "x y stretch",
        bottom: bool = False,
        also_free: bool = False,
    ) -> Sighting:
        top = self.shape.y + line * self.shape.radius
        look = Look(_box(self.shape), free, top, level=self.level, bottom=bottom, departure=departure)
        look = look._replace(also_free=also_free, blur_px=self.blur_px)
        return examine(self.patch, self.frame, self.shape, look)


def _box(shape: EllipseShape) -> tuple[float, float, float, float]:
    return box_around(shape, margin_of(shape.radius))


def _read_spheres(frames: Frames, ground: Background, whole: Sequence[Sighting], level: str) -> list[Partial]:
    """The spheres of some of the sightings in air."""
    chosen = [whole[round(index)] for index in np.linspace(0, len(whole) - 1, min(len(whole), MOST_FRAMES))]
    return [sphere for item in chosen if (sphere := _read_sphere(frames, ground, item, level)) is not None]


def _read_sphere(frames: Frames, ground: Background, item: Sighting, level: str) -> Partial | None:
    """The sphere of a sighting in air, read once for all its fits; None where that fails."""
    assert item.fit is not None
    shape = EllipseShape(item.fit.center_x_px, item.fit.center_y_px, item.fit.radius_px)
    patch = read_steadied(frames, item.frame, ground, shape, _box(shape))
    return None if isinstance(patch, str) else Partial(item.frame, patch, shape, level, item.fit.blur_px)


def corrected_radius(water: PooledRadius, check: ShapeCheck) -> PooledRadius:
    """The pooled wet radius without what the shape of the sphere adds to it; a third of the correction is doubt."""
    if not water.known:
        return water
    value = water.value / check.radius_ratio
    return replace(water, value=value, unc=math.hypot(water.unc, value * check.radius_ratio_unc))
