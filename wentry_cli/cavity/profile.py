"""The cavity's silhouette, row by row: sub-pixel left and right edges between the surface and the sphere's equator."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]

SMOOTHING_ROWS = 3
BUMP_ROWS = 17  # what sticks out of a wall over fewer rows is a bubble or a droplet
BUMP_PX = 2.0
JUMP_PX = 3.0  # between two rows; a wall is not smoothed across it
RIM_PX = 3  # a row that is dark up to the rim of the patch belongs to the surface band
FAINTEST = 0.25  # of the contrast: what is darker than that belongs to a wall, however thin
NARROW_PX = (16.0, 26.0)  # below the first a width comes from the light that is missing, above the second from edges
REFERENCE_ROWS = 12
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
    edges, NaN where not seen. ``edge_unc_px`` is the standard uncertainty of one smoothed edge. ``status`` is ``ok``,
    ``no_edge`` (no cavity in sight) or ``out_of_frame`` (nothing between surface and sphere lies in the patch).
    """

    y_px: Floats
    left_px: Floats
    right_px: Floats
    edge_unc_px: float
    dark_level: float
    status: str

    @property
    def width_px(self) -> Floats:
        """Width of the silhouette per row."""
        return self.right_px - self.left_px


def measure_profile(patch: Patch, sphere: SphereOutline, *, surface_y_px: float) -> CavityProfile:
    """Measure the silhouette of the cavity between the surface and the equator of the sphere.

    The dark component that holds the sphere, and every other one that reaches from the surface over the axis, are
    filled from their outermost left to their outermost right pixel: a bright core, a lamp mirrored in it and bubbles
    inside do not count. Edges are half-level crossings along the row, smoothed over ± ``SMOOTHING_ROWS`` rows by a
    local parabola, never across a jump of the wall; outward bumps shorter than ``BUMP_ROWS`` are left out.
    """
    first = max(int(np.ceil(surface_y_px)) + 1, patch.y0)
    last = min(int(np.floor(sphere.y_px)), patch.y0 + patch.values.shape[0] - 1)
    if last - first < 8:
        return _empty("out_of_frame")
    bottom = min(int(sphere.y_px + 0.5 * sphere.along_px), patch.y0 + patch.values.shape[0])
    values = np.ascontiguousarray(patch.values[first - patch.y0 : bottom - patch.y0])
    ground, dark = _levels(values)
    if not dark < DARKEST_USEFUL * ground:
        return _empty("no_edge")
    rows = last - first + 1
    body = _silhouette(values, _faint_level(ground, dark, patch.noise_floor), sphere, patch.x0, first)
    left, right = _edges(values[:rows], body[:rows], 0.5 * (ground + dark), RIM_PX)
    above = max(min(int(sphere.top_y_px) - 2 - first, rows), 0)  # rows whose light the sphere does not take away
    _mend_narrow_rows(values[:above], body[:above], left[:above], right[:above], (ground, dark))
    seen = np.isfinite(left)
    if seen.sum() < 8:
        return _empty("no_edge")
    left, left_spread = _smoothed(-left)
    right, right_spread = _smoothed(right)
    return CavityProfile(
        y_px=first + np.arange(rows, dtype=np.float64),
        left_px=patch.x0 - left,
        right_px=patch.x0 + right,
        edge_unc_px=float(0.5 * np.hypot(left_spread, right_spread)),
        dark_level=float(dark / ground),
        status="ok",
    )


def _empty(status: str) -> CavityProfile:
    none = np.empty(0)
    return CavityProfile(none, none, none, float("nan"), float("nan"), status)


def _levels(values: NDArray[np.float32]) -> tuple[float, float]:
    """Return the level of the ground (its upper half) and of the dark walls."""
    sample = values[::4, ::4]
    sample = sample[np.isfinite(sample)]
    if sample.size < 50:
        return 1.0, 1.0
    ground = float(np.median(sample[sample > 0.7])) if np.any(sample > 0.7) else 1.0
    darker = sample[sample < 0.6 * ground]
    dark = float(np.percentile(darker, 30)) if darker.size >= 8 else ground
    return ground, dark


def _faint_level(ground: float, dark: float, noise: float) -> float:
    """Level below which a pixel counts as dark: a quarter of the contrast, or five standard deviations of noise."""
    return ground - min(max(FAINTEST * (ground - dark), 5.0 * noise), 0.5 * (ground - dark))


def _silhouette(
    values: NDArray[np.float32], level: float, sphere: SphereOutline, x0: int, y0: int
) -> NDArray[np.uint8]:
    """Mark the dark components that make up sphere and cavity."""
    mask = (values < level).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=cv2.CV_32S)
    axis = int(np.clip(round(sphere.x_px) - x0, 0, values.shape[1] - 1))
    reach = max(int(0.35 * sphere.across_px), 2)
    equator = int(np.clip(round(sphere.y_px) - y0, 0, values.shape[0] - 1))
    foot = labels[max(equator - 3, 0) : equator + 1, max(axis - 3 * reach, 0) : axis + 3 * reach + 1]
    counts = np.bincount(foot[foot > 0], minlength=len(stats))
    keep = np.zeros(len(stats), np.uint8)
    keep[int(np.argmax(counts))] = counts.max() > 0
    for index in range(1, len(stats)):
        left, top, width, height, _area = stats[index]
        spans_axis = left <= axis <= left + width - 1 and width >= reach
        if spans_axis and top <= 2 and height >= 4:
            keep[index] = 1
    keep[0] = 0
    chosen: NDArray[np.uint8] = keep[labels]
    return chosen


@compiled
def _span(body: NDArray[np.uint8], row: int) -> tuple[int, int]:
    """First and last column of the body in ``row``, −1 where there is none."""
    columns = body.shape[1]
    first, last = -1, -1
    for column in range(columns):
        if body[row, column]:
            first = column
            break
    if first >= 0:
        for column in range(columns - 1, -1, -1):
            if body[row, column]:
                last = column
                break
    return first, last


@compiled
def _edges(values: NDArray[np.float32], body: NDArray[np.uint8], level: float, rim: int) -> tuple[Floats, Floats]:
    """Outermost half-level crossings per row, at most four pixels inside the outermost dark pixel."""
    rows, columns = body.shape
    left, right = np.full(rows, np.nan), np.full(rows, np.nan)
    for row in range(rows):
        first, last = _span(body, row)
        if first < rim or last > columns - 1 - rim:
            continue
        for column in range(first, min(first + 5, last + 1)):
            outside, inside = values[row, column - 1], values[row, column]
            if inside < level <= outside:
                left[row] = column - (level - inside) / (outside - inside)
                break
        for column in range(last, max(last - 5, first - 1), -1):
            outside, inside = values[row, column + 1], values[row, column]
            if inside < level <= outside:
                right[row] = column + (level - inside) / (outside - inside)
                break
    return left, right


@compiled
def _missing_light(
    values: NDArray[np.float32], body: NDArray[np.uint8], ground: float, dark: float, rim: int
) -> tuple[Floats, Floats]:
    """Width of a fully dark bar that takes away as much light as each row does, and the centre of what is missing."""
    rows, columns = body.shape
    width, centre = np.full(rows, np.nan), np.full(rows, np.nan)
    for row in range(rows):
        first, last = _span(body, row)
        if first < rim or last > columns - 1 - rim:
            continue
        total, moment = 0.0, 0.0
        for column in range(max(first - 5, 0), min(last + 6, columns)):
            missing = (ground - values[row, column]) / (ground - dark)
            if np.isfinite(missing):
                total += missing
                moment += missing * column
        if total > 0.3:
            width[row], centre[row] = total, moment / total
    return width, centre


def _mend_narrow_rows(
    values: NDArray[np.float32], body: NDArray[np.uint8], left: Floats, right: Floats, levels: tuple[float, float]
) -> None:
    """Replace the edges of narrow rows, whose walls are thinner than the blur, by those from the missing light.

    What a row takes away is its width times a share that depends on how much of it the bright core fills; the share is
    read from the nearest rows that are wide enough. Blur does not change the sum.
    """
    spans = _spans(body)
    narrow = np.flatnonzero((spans > 0) & (spans < NARROW_PX[1] + 6.0))
    if narrow.size == 0:
        return
    missing, centre = _missing_light(values, body, *levels, RIM_PX)
    width = right - left
    wide = np.flatnonzero((width > NARROW_PX[1]) & np.isfinite(missing))
    if wide.size < 5:
        return
    share = missing[wide] / width[wide]
    for row in narrow:
        nearest = _nearest(wide, int(row))
        half = 0.5 * missing[row] / max(float(np.median(share[nearest])), 0.05)
        trust = float(np.clip((NARROW_PX[1] - 2.0 * half) / (NARROW_PX[1] - NARROW_PX[0]), 0.0, 1.0))
        if not np.isfinite(half) or trust == 0.0:
            continue
        trust = trust if np.isfinite(width[row]) else 1.0
        left[row] = trust * (centre[row] - half) + (1.0 - trust) * np.nan_to_num(left[row])
        right[row] = trust * (centre[row] + half) + (1.0 - trust) * np.nan_to_num(right[row])


def _nearest(wide: NDArray[np.int64], row: int) -> slice:
    """The slice of the increasing rows ``wide`` that lie nearest to ``row``."""
    first = int(np.clip(np.searchsorted(wide, row) - REFERENCE_ROWS // 2, 0, max(wide.size - REFERENCE_ROWS, 0)))
    return slice(first, first + REFERENCE_ROWS)


@compiled
def _spans(body: NDArray[np.uint8]) -> Floats:
    spans = np.zeros(body.shape[0])
    for row in range(body.shape[0]):
        first, last = _span(body, row)
        if first >= 0:
            spans[row] = last - first + 1.0
    return spans


def _smoothed(edge: Floats) -> tuple[Floats, float]:
    """Return the edge (outward positive) without bumps, smoothed by local parabolas, and its scatter between rows."""
    clean = edge.copy()
    clean[_sticks_out(edge)] = np.nan
    smooth = np.empty_like(clean)
    _local_parabola(clean, SMOOTHING_ROWS, JUMP_PX, smooth)
    rest = (clean - smooth)[np.isfinite(smooth)]
    return smooth, float(1.4826 * np.median(np.abs(rest))) if rest.size else float("nan")


def _sticks_out(edge: Floats) -> NDArray[np.bool_]:
    filled = np.where(np.isfinite(edge), edge, -1e6)
    kernel = np.ones((BUMP_ROWS, 1), np.uint8)
    opened = cv2.morphologyEx(filled[:, None].astype(np.float32), cv2.MORPH_OPEN, kernel)[:, 0]
    return np.asarray(filled - opened > BUMP_PX)


@compiled
def _local_parabola(edge: Floats, half: int, jump: float, smooth: Floats) -> None:
    for row in range(edge.size):
        smooth[row] = np.nan
        if not np.isfinite(edge[row]):
            continue
        low = row
        while low > max(row - half, 0) and abs(edge[low - 1] - edge[low]) <= jump:
            low -= 1
        high = row
        while high < min(row + half, edge.size - 1) and abs(edge[high + 1] - edge[high]) <= jump:
            high += 1
        n, s1, s2, s3, s4, t0, t1, t2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for other in range(low, high + 1):
            d = float(other - row)
            n += 1.0
            s1 += d
            s2 += d * d
            s3 += d * d * d
            s4 += d * d * d * d
            t0 += edge[other]
            t1 += edge[other] * d
            t2 += edge[other] * d * d
        if n < 5.0:
            smooth[row] = t0 / n if n < 3.0 else (t0 * s2 - t1 * s1) / (n * s2 - s1 * s1)
            continue
        determinant = n * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
        value = t0 * (s2 * s4 - s3 * s3) - s1 * (t1 * s4 - s3 * t2) + s2 * (t1 * s3 - s2 * t2)
        smooth[row] = value / determinant
