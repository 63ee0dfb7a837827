"""The cavity's silhouette, row by row: sub-pixel left and right edges between the surface and the sphere's equator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.edge_blur import TYPICAL_PX, measure_blur
from wentry_cli.cavity.row_edges import find_closed_rows, find_edges, mend_thin_walls
from wentry_cli.cavity.wall_smoothing import smooth_wall
from wentry_cli.compiled import compiled
from wentry_cli.imaging.components import DarkParts, find_dark_parts
from wentry_cli.imaging.order_statistics import linear_quantile
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

SURFACE_ROWS = 12  # where the surface band may reach, and a cavity that has left it is still followed
RIM_PX = 3  # a row that is dark up to the rim of the patch belongs to the surface band
FAINTEST = 0.25  # of the contrast: what is darker than that belongs to a wall, however thin
SAMPLE = 6000  # pixels that tell the levels
DARKEST_USEFUL = 0.75  # a wall brighter than this is no wall


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
    standard deviation of the blur of lens and pixel. ``cut_off`` tells that a wall reaches the rim of the patch well
    below the surface. ``status`` is ``ok``, ``no_edge`` (no cavity in sight) or ``out_of_frame`` (nothing between
    surface and sphere lies in the patch).
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

    @property
    def width_px(self) -> Floats:
        """Width of the silhouette per row."""
        return self.right_px - self.left_px


def measure_profile(patch: Patch, sphere: SphereOutline, *, surface_y_px: float) -> CavityProfile:
    """Measure the silhouette of the cavity between the surface and the equator of the sphere.

    The dark component that holds the sphere, and every other one that reaches from the surface over the axis, are
    filled from their outermost left to their outermost right pixel: a bright core, a lamp mirrored in it and bubbles
    inside do not count. Edges are half-level crossings along the row, smoothed over ± 3 rows by a
    local parabola, never across a jump of the wall; outward bumps are left out.
    """
    first = max(int(np.ceil(surface_y_px)) + 1, patch.y0)
    last = min(int(np.floor(sphere.y_px)), patch.y0 + patch.values.shape[0] - 1)
    if last - first < 8:
        return empty_profile("out_of_frame")
    bottom = min(int(sphere.y_px + 0.5 * sphere.along_px), patch.y0 + patch.values.shape[0])
    values = np.ascontiguousarray(patch.values[first - patch.y0 : bottom - patch.y0])
    ground, dark = _levels(values)
    if not dark < DARKEST_USEFUL * ground:
        return empty_profile("no_edge")
    rows = last - first + 1
    parts, keep = _silhouette(values, _faint_level(ground, dark, patch.noise_floor), sphere, patch.x0, first)
    spans = parts.spans(keep)
    left, right, wall = find_edges(values[:rows], (spans[0][:rows], spans[1][:rows]), 0.5 * (ground + dark), RIM_PX)
    above = max(min(int(sphere.top_y_px) - 2 - first, rows), 0)  # rows whose light the sphere does not take away
    blur = measure_blur(values, (left[:above], right[:above], wall[:above]), (ground, dark))
    mend_thin_walls(values, spans, (left[:above], right[:above], wall[:above]), (ground, dark), blur, RIM_PX)
    seen = np.isfinite(left)
    if seen.sum() < 8:
        return empty_profile("no_edge")
    closed = find_closed_rows(values, parts, keep, rows, 0.5 * (ground + dark))
    left[closed] = right[closed] = np.nan
    left, left_spread = smooth_wall(-left)
    right, right_spread = smooth_wall(right)
    left[closed], right[closed] = patch.x0 - sphere.x_px, sphere.x_px - patch.x0
    return CavityProfile(
        y_px=first + np.arange(rows, dtype=np.float64),
        left_px=patch.x0 - left,
        right_px=patch.x0 + right,
        top_y_px=float(first + np.flatnonzero(spans[0] >= 0)[0]),
        edge_unc_px=float(0.5 * np.hypot(left_spread, right_spread)),
        dark_level=float(dark / ground),
        cut_off=bool(np.sum((~seen & (spans[0][:rows] >= 0))[SURFACE_ROWS:]) > 0.1 * rows),
        status="ok",
        blur_px=blur,
    )


def empty_profile(status: str) -> CavityProfile:
    """Return a profile without rows and the status that says why."""
    none = np.empty(0)
    return CavityProfile(none, none, none, float("nan"), float("nan"), float("nan"), False, status)


@compiled
def _levels(values: NDArray[np.float32]) -> tuple[float, float]:
    """Return the level of the ground (its upper half) and of the dark walls, from some thousands of pixels."""
    apart = max(4, int(math.sqrt(values.size / SAMPLE)))
    rows, columns = (values.shape[0] + apart - 1) // apart, (values.shape[1] + apart - 1) // apart
    sample = np.empty(rows * columns)
    seen, bright = 0, 0
    for row in range(rows):
        line = values[apart * row, :]
        for column in range(columns):
            value = line[apart * column]
            seen += 1 if np.isfinite(value) else 0
            if value > 0.7:
                sample[bright] = value
                bright += 1
    if seen < 50:
        return 1.0, 1.0
    ground = linear_quantile(sample, bright, 0.5) if bright else 1.0
    count = 0
    for row in range(rows):
        line = values[apart * row, :]
        for column in range(columns):
            value = line[apart * column]
            if value < 0.6 * ground:
                sample[count] = value
                count += 1
    return ground, linear_quantile(sample, count, 0.3) if count >= 8 else ground


def _faint_level(ground: float, dark: float, noise: float) -> float:
    """Level below which a pixel counts as dark: a quarter of the contrast, or five standard deviations of noise."""
    return ground - min(max(FAINTEST * (ground - dark), 5.0 * noise), 0.5 * (ground - dark))


def _silhouette(
    values: NDArray[np.float32], level: float, sphere: SphereOutline, x0: int, y0: int
) -> tuple[DarkParts, NDArray[np.bool_]]:
    """Return the dark components and which of them make up sphere and cavity."""
    parts = find_dark_parts(values, level)
    axis = int(np.clip(round(sphere.x_px) - x0, 0, values.shape[1] - 1))
    reach = max(int(0.35 * sphere.across_px), 2)
    equator = int(np.clip(round(sphere.y_px) - y0, 0, values.shape[0] - 1))
    return parts, _belongs((parts.row, parts.first, parts.last, parts.label), parts.boxes, (axis, reach, equator))


@compiled
def _belongs(runs: tuple[Ints, Ints, Ints, Ints], boxes: Ints, sphere: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Tell which parts hold most of the sphere's rows above its equator, or reach from the surface over its axis.

    ``sphere`` is the column of its axis, the width that counts and the row of its equator.
    """
    axis, reach, equator = sphere
    keep, counts = np.zeros(boxes.shape[0], np.bool_), np.zeros(boxes.shape[0], np.int64)
    for run in range(runs[0].size):
        if equator - 3 <= runs[0][run] <= equator:
            inside = min(runs[2][run], axis + 3 * reach) - max(runs[1][run], axis - 3 * reach) + 1
            counts[runs[3][run]] += max(inside, 0)
    best = 0
    for part in range(boxes.shape[0]):
        best = part if counts[part] > counts[best] else best
        left, top, right, bottom = boxes[part, 0], boxes[part, 1], boxes[part, 2], boxes[part, 3]
        spans_axis = left <= axis <= right and right - left + 1 >= reach
        keep[part] = spans_axis and top <= SURFACE_ROWS and bottom - top + 1 >= 4
    if keep.size and counts[best] > 0:
        keep[best] = True
    return keep
