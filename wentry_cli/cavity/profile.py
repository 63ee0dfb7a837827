"""The cavity's silhouette, row by row: sub-pixel left and right edges between the surface and the sphere's equator."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.body import SURFACE_ROWS, find_body, find_closed_rows, longest_gap
from wentry_cli.cavity.edge_blur import TYPICAL_PX, measure_blur
from wentry_cli.cavity.ledge import find_ledges, mend_beside
from wentry_cli.cavity.levels import DARKEST_USEFUL, faint_level, find_levels
from wentry_cli.cavity.outline import Ints, Spans
from wentry_cli.cavity.region import Region, region_of_patch
from wentry_cli.cavity.row_edges import MEASURED_PX, REFERENCE_WALL, THICK_PX, find_edges, mend_thin_walls
from wentry_cli.cavity.wall_smoothing import smooth_wall
from wentry_cli.compiled import compiled
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

RIM_PX = 3  # a row that is dark up to the rim of the patch belongs to the surface band
FEWEST_ROWS = 8
CUT_OFF = 0.1  # of the rows: so many walls reach the rim of a region that is too narrow
CLEAR_ROWS = 26  # beyond the body: so far the blur of a ledge is looked at
NOT_SEEN, NOT_READ = -1, -2  # instead of the first row of the body


@dataclass(frozen=True)
class SphereOutline:
    """Where the sphere is: centre and semi-axes across and along, pixels of the full frame."""

    x_px: float
    y_px: float
    across_px: float
    along_px: float

    @property
    def top_y_px(self) -> float:
        """Row of its highest point."""
        return self.y_px - self.along_px


@dataclass(frozen=True)
class CavityProfile:
    """Outer silhouette of cavity and sphere in one frame, pixels of the full frame.

    ``y_px`` (n,) are rows from the surface down to the sphere's equator; ``left_px`` and ``right_px`` the smoothed
    edges, NaN where not seen and equal (on the axis) in rows where the cavity has closed. ``top_y_px`` is the highest
    row in which any of it is dark, ``edge_unc_px`` the standard uncertainty of one smoothed edge, ``blur_px`` the
    standard deviation of the blur of lens and pixel, ``ledges_y_px`` (m,) the rows of ledges of the wall. ``cut_off``
    tells that a wall reaches the rim of the patch well below the surface, ``empty_px`` are the rows (first, behind the
    last) of the longest stretch of the patch that shows nothing of it. ``status`` is ``ok``, ``no_edge`` (no
    cavity in sight) or ``out_of_frame`` (nothing between surface and sphere lies in the patch).
    """

    y_px: Floats
    left_px: Floats
    right_px: Floats
    top_y_px: float
    edge_unc_px: float
    dark_level: float
    cut_off: bool
    status: str
    blur_px: float = TYPICAL_PX
    ledges_y_px: Floats = field(default_factory=lambda: np.empty(0))
    empty_px: tuple[int, int] = (0, 0)

    @property
    def width_px(self) -> Floats:
        """Width of the silhouette per row."""
        return self.right_px - self.left_px

    def rows_above(self, lowest_y_px: float, step: int) -> tuple[Floats, Floats, Floats]:
        """Row, left and right edge where it is open, no lower than that, in every ``step``-th row of the frame."""
        return _open_rows(self.y_px, self.left_px, self.right_px, lowest_y_px, step)


@compiled
def _open_rows(y: Floats, left: Floats, right: Floats, lowest: float, step: int) -> tuple[Floats, Floats, Floats]:
    found, count = np.empty((3, y.size // step + 1)), 0
    for row in range(int(-y[0] % step), y.size, step):
        if y[row] <= lowest and right[row] > left[row]:
            found[0, count], found[1, count], found[2, count] = y[row], left[row], right[row]
            count += 1
    return found[0, :count], found[1, :count], found[2, :count]


def measure_profile(patch: Patch, sphere: SphereOutline, *, surface_y_px: float) -> CavityProfile:
    """Measure the silhouette of the cavity between the surface and the equator of the sphere (``measure_region``)."""
    first, bottom = rows_of(sphere, surface_y_px, (patch.y0, patch.y0 + patch.values.shape[0]))
    part = patch.values[max(first - patch.y0, 0) : max(bottom - patch.y0, 0)]
    region = region_of_patch(replace(patch, values=part))
    profile = measure_region(region, sphere, corner=(patch.x0, first), noise=patch.noise_floor)
    assert profile is not None
    return profile


def rows_of(sphere: SphereOutline, surface_y_px: float, seen: tuple[int, int]) -> tuple[int, int]:
    """The rows (first, behind the last) that tell of the cavity, of those that are ``seen``: into the lower half."""
    return max(math.ceil(surface_y_px) + 1, seen[0]), min(int(sphere.y_px + 0.5 * sphere.along_px), seen[1])


def measure_region(
    region: Region, sphere: SphereOutline, *, corner: tuple[int, int], noise: float
) -> CavityProfile | None:
    """Measure the silhouette of the cavity in the rows of ``region`` down to the equator of the sphere.

    ``corner`` is column and row of the first pixel of the region in the frame, ``noise`` the standard deviation of its
    plain ground. The dark component that holds the sphere, and every other one that reaches from the surface over the
    axis, are filled from their outermost left to their outermost right pixel: a bright core, a lamp mirrored in it and
    bubbles inside do not count. Edges are half-level crossings along the row, smoothed over ± 3 rows by a
    local parabola, never across a jump of the wall; outward bumps are left out. None where that takes rows of the
    region that were not read.
    """
    x0, first = corner
    rows = min(math.floor(sphere.y_px) - first + 1, region.levels.shape[0])
    if rows < FEWEST_ROWS + 1:
        return empty_profile("out_of_frame")
    axis = min(max(round(sphere.x_px) - x0, 0), region.columns - 1)
    equator = min(max(round(sphere.y_px) - first, 0), region.levels.shape[0] - 1)
    places = (axis, max(int(0.35 * sphere.across_px), 2), equator)
    above = max(min(int(sphere.top_y_px) - 2 - first, rows), 0)
    left, right, top, unc, dark, cut_off, blur, ledges, empty = _measure(region, places, (rows, above), noise)
    if top < 0:
        return empty_profile("no_edge") if top == NOT_SEEN else None
    _place_walls(left, right, x0, sphere.x_px - x0)
    return CavityProfile(
        y_px=np.arange(float(first), float(first + rows)),
        left_px=left,
        right_px=right,
        top_y_px=float(first + top),
        edge_unc_px=unc,
        dark_level=dark,
        cut_off=cut_off,
        status="ok",
        blur_px=blur,
        ledges_y_px=first + ledges,
        empty_px=(first + empty[0], first + empty[1]),
    )


@compiled
def _place_walls(left: Floats, right: Floats, x0: int, axis: float) -> None:
    """Count both walls from column 0 of the frame, not outwards from ``x0``; a closed row has them on the ``axis``."""
    for row in range(left.size):
        if np.isinf(left[row]):
            left[row], right[row] = -axis, axis
        left[row], right[row] = x0 - left[row], x0 + right[row]


@compiled
def _measure(
    region: Region, sphere: tuple[int, int, int], counts: tuple[int, int], noise: float
) -> tuple[Floats, Floats, int, float, float, bool, float, Floats, tuple[int, int]]:
    """Both walls (n,) outwards from the first column, infinite where closed; what else ``CavityProfile`` holds.

    In order: left and right wall, first row of the body (or why there is none), uncertainty of an edge, level of the
    dark, whether it is cut off, blur, rows of ledges, longest stretch without the body. ``counts`` are the rows of the
    profile and those whose light the sphere does not take away.
    """
    rows, above = counts
    ground, dark, black = find_levels(region, sphere)
    if not dark < (black + DARKEST_USEFUL * (1.0 - black)) * ground:
        return _nothing(NOT_SEEN)
    half = 0.5 * (ground + dark)
    spans = find_body(region, faint_level(ground, dark, noise), sphere)
    if _touches(spans, region.unread):
        return _nothing(NOT_READ)
    body_spans = (spans[0][:rows], spans[1][:rows])
    left, right, wall, blur = _edges(region, body_spans, above, (ground, dark))
    clear = (left[:above], right[:above], wall[:above])
    ledges = find_ledges(region, body_spans, (ground, dark), blur)
    mend_thin_walls(region, spans, clear, (ground, dark), blur, RIM_PX)
    mend_beside(region, (left, right), ledges, (ground, dark), blur)
    seen, hidden = 0, 0
    for row in range(rows):
        seen += 1 if np.isfinite(left[row]) else 0
        if np.isnan(left[row]) and spans[0][row] >= 0:
            hidden += 1 if row >= SURFACE_ROWS else 0
            if min(spans[0][row], region.columns - 1 - spans[1][row]) < RIM_PX:
                left[row], right[row] = -np.inf, np.inf
    if seen < FEWEST_ROWS:
        return _nothing(NOT_SEEN)
    closed = find_closed_rows(region, spans, rows, half)
    for row in range(rows):
        if closed[row]:
            left[row] = right[row] = np.nan
    left, left_spread = smooth_wall(-left, ledges)
    right, right_spread = smooth_wall(right, ledges)
    for row in range(rows):
        if closed[row]:
            left[row] = right[row] = np.inf
    top = 0
    while spans[0][top] < 0:
        top += 1
    unc = 0.5 * math.hypot(left_spread, right_spread)
    return left, right, top, unc, dark / ground, hidden > CUT_OFF * rows, blur, ledges, longest_gap(spans)


@compiled
def _nothing(why: int) -> tuple[Floats, Floats, int, float, float, bool, float, Floats, tuple[int, int]]:
    return np.empty(0), np.empty(0), why, np.nan, np.nan, False, np.nan, np.empty(0), (0, 0)


@compiled
def _touches(spans: Spans, unread: tuple[int, int]) -> bool:
    """Whether the body comes so near to rows that were not read that these may count."""
    if unread[0] == unread[1]:
        return False
    for row in range(max(unread[0] - CLEAR_ROWS, 0), min(unread[1] + CLEAR_ROWS, spans[0].size)):
        if spans[0][row] >= 0:
            return True
    return False


@compiled
def _edges(
    region: Region, spans: tuple[Ints, Ints], above: int, light: tuple[float, float]
) -> tuple[Floats, Floats, Floats, float]:
    """Left and right edge and the thickness of the walls in every row, and the blur of those ``above`` the sphere.

    The walls are measured out as far as that blur makes it worth while.
    """
    half = 0.5 * (light[0] + light[1])
    left, right, wall = find_edges(region, spans, half, RIM_PX, MEASURED_PX)
    blur = measure_blur(region, (left[:above], right[:above], wall[:above]), light)
    if REFERENCE_WALL * blur > MEASURED_PX:
        left, right, wall = find_edges(region, spans, half, RIM_PX, THICK_PX)
    return left, right, wall, blur


def empty_profile(status: str) -> CavityProfile:
    """Return a profile without rows and the status that says why."""
    none = np.empty(0)
    return CavityProfile(none, none, none, float("nan"), float("nan"), float("nan"), False, status)
