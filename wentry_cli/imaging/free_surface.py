"""The row of the undisturbed free surface in the empty scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.lit_part import lit_part, within_blur

BLOCKS = 24
WIDEST_BAND, SMOOTHED_PX = 61, 9
THINNED, FEWEST_THINNED = 3, 480  # columns of which one is looked at, of so many: what lies between is smoothed anyway
LINE_PX = 3.0  # what the finest meniscus looks like
FAINTEST_DIP = 0.012
# Of several rows: how many are told, how far apart, how deep against the first, in how many of the strips.
MOST_SURFACES, APART_ROWS, FAINTEST_SECOND, LEAST_ACROSS = 4, 6, 0.04, 0.8
# A camera that is not level: how far strips lie off one line, how many lie on it, how far and how steeply it falls.
ON_LINE_PX, MOST_STRIPS, LEVEL_PX, STEEPEST = 3.0, 0.6, 4.0, 0.12
# A slant, in rows per column, that is none: a quarter of a degree, or not clear of its uncertainty.
LEVEL_SLANT, LEVEL_SIGMA = 0.004, 4.0
RISEN = 2.0  # times the lowest level between two dips: they are two


@dataclass(frozen=True)
class SurfaceRow:
    """Row of a surface at a column: centre of its dark band, standard uncertainty, thickness of the band, depth of it.

    ``status`` is ok or ``no_edge`` (nothing like one; NaN), ``slant`` the rows per column by which it falls rightwards,
    ``x_px`` the column (NaN: of a row that was given, in all of them).
    """

    y_px: float
    unc_px: float
    thickness_px: float
    contrast: float
    status: str
    slant: float = 0.0
    slant_unc: float = 0.0
    x_px: float = math.nan

    @property
    def roll_rad(self) -> float:
        """By how much the camera is rolled: the angle by which the surface falls to the right, 0 where it is level."""
        rolled = abs(self.slant) > max(LEVEL_SLANT, LEVEL_SIGMA * self.slant_unc) and math.isfinite(self.x_px)
        return math.atan(self.slant) if rolled else 0.0

    def at(self, x_px: float) -> SurfaceRow:
        """The same surface, its row at another column."""
        return replace(self, y_px=self.y_px + self.slant * (x_px - self.x_px), x_px=x_px) if self.roll_rad else self


LEAST_ROWS, EDGE_ROWS = 12, 4
BESIDE_ROWS = 3, 9  # beyond a line: where its blur has faded
NO_SURFACE = SurfaceRow(math.nan, math.nan, math.nan, math.nan, "no_edge")


def find_free_surface(
    level: NDArray[np.float32], *, x_px: float | None = None, rows: tuple[float, float] | None = None
) -> SurfaceRow:
    """Find the free surface in the empty scene: the darkest line or band across the whole picture.

    The first of ``find_surfaces``; status ``no_edge`` where there is none.
    """
    return next(iter(find_surfaces(level, x_px=x_px, rows=rows)), NO_SURFACE)


def find_surfaces(
    level: NDArray[np.float32], *, x_px: float | None = None, rows: tuple[float, float] | None = None
) -> list[SurfaceRow]:
    """Find what may be the free surface in the empty scene, the darkest first: lines or bands across the picture.

    ``level`` is (rows, columns) of grey levels without the sphere, ``x_px`` the column at which the row is wanted
    (default: the middle), ``rows`` the range in which to look. The zero of height is the centre of the band: the
    front and the back meniscus both look dark, the flat surface lies between them. Each of 24 strips gives a centre of
    gravity of its dip; a line through them without outliers gives the row. Its uncertainty is their scatter, where in
    a band the surface may lie (``_unevenness``), and what water that is darker than the air does to the centre. A seam
    or the rim of a tank looks the same: which of the rows is the surface, only the sphere can tell. Black rows and
    columns at the edge of the picture are not looked at.
    """
    lit, across = (within_blur(part, size) for part, size in zip(lit_part(level), level.shape, strict=True))
    x_px = (x_px if x_px is not None else level.shape[1] / 2) - across.start
    top, bottom = (value - lit.start for value in _limits(rows, level.shape[0]))
    level = level[lit, across]
    top, bottom = max(top, EDGE_ROWS), min(bottom, level.shape[0] - EDGE_ROWS)
    if bottom - top < LEAST_ROWS or level.shape[1] < BLOCKS:
        return []
    thinned = THINNED if level.shape[1] >= FEWEST_THINNED else 1
    found = _deepest_first(depth_of_dips(level, thinned), thinned, (top, bottom), x_px)
    return [
        replace(
            row,
            y_px=row.y_px + lit.start,
            unc_px=math.hypot(row.unc_px, _pulled_by_step(level, row)),
            x_px=row.x_px + across.start,
        )
        for row in found
        if row.status == "ok"
    ]


def _deepest_first(dip: NDArray[np.float32], thinned: int, limits: tuple[int, int], x_px: float) -> list[SurfaceRow]:
    """The dips between two rows, one after the other; what is no line across the picture has no edge."""
    top, bottom = limits
    strips = np.array_split(np.arange(dip.shape[1]), BLOCKS)
    across = cv2.transpose(dip)  # so that a strip is a block of memory
    profiles = np.array([np.mean(across[strip[0] : strip[-1] + 1], axis=0) for strip in strips])
    middle = thinned * (np.array([float(strip.mean()) for strip in strips]) + 0.5) - 0.5
    slant = np.rint(_slant(profiles[:, top:bottom], middle) * (middle - x_px))
    profiles = _levelled(profiles, slant.astype(np.intp))
    common = np.median(profiles, axis=0)
    common[:top] = 0.0
    common[bottom:] = 0.0
    noise = 1.4826 * float(np.median(np.abs(common[top:bottom] - np.median(common[top:bottom]))))
    least = max(FAINTEST_DIP, 6.0 * noise)
    found: list[SurfaceRow] = []
    left = common.copy()
    while len(found) < MOST_SURFACES:
        peak = int(np.argmax(cv2.blur(left[:, None], (1, 3))[:, 0]))
        contrast = float(left[peak])
        if contrast < max(least, FAINTEST_SECOND * found[0].contrast if found else 0.0):
            break
        first, last = _extent(common, peak, 0.3 * contrast)
        thickness = float(np.sum(common[first : last + 1]) / contrast)
        centres = slant + np.array([_centre(profile, first, last) for profile in profiles], np.float64)
        row = line_across(middle, centres, x_px, thickness, contrast)
        if found and not _across(profiles[:, peak], contrast):
            row = replace(row, status="no_edge")
        found.append(replace(row, contrast=contrast))
        first, last = _foot(common, peak, 0.5 * least)
        left[max(0, first - APART_ROWS) : last + APART_ROWS + 1] = 0.0
    return found


def _slant(profiles: NDArray[np.float32], columns: NDArray[np.float64]) -> float:
    """Rows per column by which the darkest line falls to the right of a camera that is not level; 0 where none is seen.

    Strips may each see another line, but most see the same.
    """
    peaks = np.argmax(profiles, axis=1).astype(np.float64)
    slope, offset = _median_line(columns, peaks)
    near = np.abs(peaks - offset - slope * columns) < ON_LINE_PX
    told = np.mean(near) > MOST_STRIPS and abs(slope) * np.ptp(columns) > LEVEL_PX and abs(slope) < STEEPEST
    return slope if told else 0.0


def _levelled(profiles: NDArray[np.float32], slant: NDArray[np.intp]) -> NDArray[np.float32]:
    """Every profile moved up by the rows of ``slant``; beyond the ends of the picture there is nothing."""
    if not slant.any():
        return profiles
    rows = np.arange(profiles.shape[1]) + slant[:, None]
    seen = (rows >= 0) & (rows < profiles.shape[1])
    moved = np.take_along_axis(profiles, np.clip(rows, 0, profiles.shape[1] - 1), axis=1)
    return np.where(seen, moved, np.float32(0.0))


def _across(depths: NDArray[np.float32], contrast: float) -> bool:
    """Whether a dip is seen in nearly all strips, and not only in those that a cavity or a ruler darkens."""
    return bool(np.mean(depths > 0.3 * contrast) > LEAST_ACROSS)


def _foot(profile: NDArray[np.float32], peak: int, bound: float) -> tuple[int, int]:
    """First and last row of all that belongs to a dip: down its flanks to where it ends or rises to another one."""
    ends = []
    for step in (-1, 1):
        at = lowest = peak
        while 0 < at < profile.size - 1 and profile[at] > bound:
            at += step
            lowest = at if profile[at] < profile[lowest] else lowest
            if profile[at] > RISEN * profile[lowest] + bound:
                break
        ends.append(lowest)
    return ends[0], ends[1]


def _limits(rows: tuple[float, float] | None, height: int) -> tuple[int, int]:
    if rows is None:
        return EDGE_ROWS, height - EDGE_ROWS
    return max(EDGE_ROWS, int(rows[0])), max(min(height - EDGE_ROWS, int(rows[1]) + 1), EDGE_ROWS + 1)


def depth_of_dips(level: NDArray[np.float32], thinned: int = 1) -> NDArray[np.float32]:
    """How much darker each pixel is than what lies above and below it within ``WIDEST_BAND``, as a share of that.

    ``level`` is (rows, columns), looked at through a window of ``SMOOTHED_PX`` each way; the result has one of every
    ``thinned`` columns.
    """
    rows, columns = level.shape[0], level.shape[1] // thinned
    if thinned > 1:
        means = cv2.resize(level[:, : thinned * columns], (columns, rows), interpolation=cv2.INTER_AREA)
        level = np.asarray(means, np.float32)
    across = SMOOTHED_PX // thinned
    smooth = cv2.blur(level, (across, 1))
    kernel = np.ones((WIDEST_BAND, 1), np.uint8)
    closed = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, kernel)
    closed = cv2.blur(closed, (across, SMOOTHED_PX))
    ratio = np.divide(smooth, np.maximum(closed, 1e-3, out=closed), out=closed)
    return np.asarray(np.subtract(1.0, ratio, out=ratio), np.float32)


def _extent(profile: NDArray[np.float32], peak: int, bound: float) -> tuple[int, int]:
    first = last = peak
    while first > 0 and profile[first - 1] > bound:
        first -= 1
    while last < profile.size - 1 and profile[last + 1] > bound:
        last += 1
    return first, last


@compiled
def _centre(profile: NDArray[np.float32], first: int, last: int) -> float:
    """Centre of gravity of a dip, over a window placed symmetrically about it; base line through the rows beside."""
    centre, half = 0.5 * (first + last), 0.5 * (last - first) + 3.0
    for _ in range(3):
        if not 0.0 <= centre < profile.size:
            return math.nan
        start, stop = max(0, math.ceil(centre - half)), min(profile.size, math.floor(centre + half) + 1)
        if start < 1 or stop > profile.size - 1 or stop - start < 3:
            return math.nan
        above, below = np.mean(profile[max(0, start - 4) : start]), np.mean(profile[stop : stop + 4])
        total = moment = 0.0
        for row in range(start, stop):
            weight = profile[row] - (above + (below - above) * (row - start) / (stop - 1 - start))
            total += weight
            moment += weight * row
        if total <= 0.0:
            return math.nan
        centre = moment / total
    return centre


def line_across(
    columns: NDArray[np.float64], centres: NDArray[np.float64], x_px: float, thickness: float, contrast: float
) -> SurfaceRow:
    """The row at ``x_px`` of the line through most of the ``centres`` (n,) at ``columns``; NaN is not looked at."""
    known = np.isfinite(centres)
    if np.count_nonzero(known) < 4:
        return NO_SURFACE
    # Where the cavity is in the way of the ground, a run of strips shows something else: least squares would follow.
    slope, offset = _median_line(columns[known] - x_px, centres[known])
    for _ in range(3):
        left = centres - (offset + slope * (columns - x_px))
        spread = 1.4826 * float(np.median(np.abs(left[known]))) + 0.02
        good = known & (np.abs(left) < 3.0 * spread)
        if np.count_nonzero(good) < 4:
            return NO_SURFACE
        slope, offset = np.polyfit(columns[good] - x_px, centres[good], 1)
    left = centres - (offset + slope * (columns - x_px))
    scatter = float(np.std(left[good])) / math.sqrt(np.count_nonzero(good) / 2.0)
    slope_unc = scatter / float(np.std(columns[good]))
    unc = math.hypot(scatter, _unevenness(thickness))
    return SurfaceRow(float(offset), unc, thickness, contrast, "ok", float(slope), slope_unc, float(x_px))


def _median_line(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Slope and offset by repeated medians (Siegel 1982), which nearly half of the points cannot move."""
    across, up = x[None, :] - x[:, None], y[None, :] - y[:, None]
    np.fill_diagonal(across, np.nan)
    slope = float(np.median(np.nanmedian(up / across, axis=1)))
    return slope, float(np.median(y - slope * x))


def _unevenness(thickness: float) -> float:
    """Standard deviation of where in its dark band the undisturbed surface lies: anywhere, less a line's own width.

    Water that climbs the wall puts it at the lower rim of the band, a camera that looks down or up at either.
    """
    return max(0.02, math.sqrt(max(thickness**2 - LINE_PX**2, 0.0) / 12.0))


def _pulled_by_step(level: NDArray[np.float32], row: SurfaceRow) -> float:
    """Standard deviation of what unequal light above and below a line does to its centre, px.

    The centre of gravity leans to the darker side, by at most half of the line in the share of the step in its depth.
    """
    half = 0.5 * row.thickness_px
    rows = np.arange(BESIDE_ROWS[0], BESIDE_ROWS[1])
    sides = [np.round(row.y_px + way * (half + rows)).astype(int) for way in (-1, 1)]
    sides = [side[(side >= 0) & (side < level.shape[0])] for side in sides]
    if not all(side.size for side in sides):
        return 0.0
    above, below = (float(np.median(level[side])) for side in sides)
    return min(abs(above - below) / (max(above, below) * row.contrast), 1.0) * (half + 1.0) / math.sqrt(3.0)
