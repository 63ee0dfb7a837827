"""Scan conversion of overlapping polygons into blurred pixels.

Every polygon carries a layer and a grey level; where polygons overlap, the highest layer is seen. Scan lines cross the
outlines at exact abscissae; each step of the visible level is laid down as a step that has been blurred by the point
spread function and integrated over the pixel, so the horizontal position of an edge is exact and the vertical one is
limited by the number of scan lines (16 in a pixel, 256 where an outline turns around), not by the pixel; a level edge
(the free surface, a plate) lies between two scan lines and is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from wentry_cli.compiled import compiled
from wentry_cli.synthetic.scan_lines import find_crossings, place_lines, sort_line

GRID_ROWS = 4
TABLE_STEPS = 256
REACH_SIGMA = 4.5

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Polygon:
    """A closed outline in pixels, shape (n, 2) as (x, y); ``level`` is the transmission seen where it lies on top."""

    points: Floats
    level: float
    layer: int


@dataclass(frozen=True)
class Window:
    """A rectangle of pixels, half open."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return (self.y1 - self.y0, self.x1 - self.x0)


def _smooth_ramp(u: Floats, sigma: float) -> Floats:
    """Second antiderivative of a normal density of standard deviation ``sigma``."""
    z = u / sigma
    density = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi)
    cumulative = 0.5 * (1.0 + erf(z / np.sqrt(2.0)))
    return np.asarray(sigma * (z * cumulative + density))


@lru_cache(maxsize=32)
def _step_table(sigma: float) -> Floats:
    """Increments between neighbouring pixels of a blurred, pixel-integrated step, for TABLE_STEPS + 1 phases."""
    half = int(np.ceil(REACH_SIGMA * sigma + 1.0))
    phase = np.arange(TABLE_STEPS + 1) / TABLE_STEPS
    pixel = np.arange(-half - 1, half + 2)
    u = pixel[None, :] - phase[:, None]
    value = _smooth_ramp(u + 0.5, sigma) - _smooth_ramp(u - 0.5, sigma)
    increments = np.diff(value, axis=1)
    return np.ascontiguousarray(increments / increments.sum(axis=1, keepdims=True))


@lru_cache(maxsize=32)
def _column_kernel(sigma: float) -> tuple[NDArray[np.float32], int]:
    """Weights of the fine rows in a pixel: point spread function times pixel, less the width of a fine row."""
    h = 1.0 / GRID_ROWS
    narrow = float(np.sqrt(max(sigma * sigma - h * h / 12.0, 0.01 * sigma * sigma)))
    reach = int(np.ceil((REACH_SIGMA * sigma + 0.5) * GRID_ROWS))
    offset = (np.arange(-reach, reach + GRID_ROWS) + 0.5) * h - 0.5
    root2 = narrow * np.sqrt(2.0)
    weight = 0.5 * (erf((offset + 0.5) / root2) - erf((offset - 0.5) / root2)) * h
    return (weight / weight.sum()).astype(np.float32), reach


@compiled
def _see_through(active, n_active, levels, layers):  # type: ignore[no-untyped-def]
    """Level of the highest layer among the polygons that cover a place; 1 where there is none."""
    top, best = 1.0, -1000000
    for q in range(n_active):
        if layers[active[q]] > best:
            best = layers[active[q]]
            top = levels[active[q]]
    return top


@compiled
def _enter_or_leave(active, n_active, polygon, outside):  # type: ignore[no-untyped-def]
    """Put a polygon into the list of those that cover a place, or take it out; returns the new length."""
    if outside:
        active[n_active] = polygon
        return n_active + 1
    for q in range(n_active):
        if active[q] == polygon:
            active[q] = active[n_active - 1]
            return n_active - 1
    return n_active


@compiled
def _add_step(row, u, step, table):  # type: ignore[no-untyped-def]
    """Lay the blurred increments of one step at the abscissa ``u`` of a row; what lies left of it goes to its start."""
    taps = table.shape[1]
    half, phases, width = taps // 2 - 1, table.shape[0] - 1, row.size
    if u < -half:
        row[0] += step
        return
    if u > width + half:
        return
    base = int(np.floor(u))
    fraction = (u - base) * phases
    cell = int(fraction)
    fraction -= cell
    if base >= half and base - half + taps <= width:  # as it nearly always is: a loop without a branch
        part, low, high = row[base - half : base - half + taps], table[cell], table[cell + 1]
        for t in range(taps):
            part[t] += step * ((1.0 - fraction) * low[t] + fraction * high[t])
        return
    for t in range(taps):
        column = max(base - half + t, 0)
        if column < width:
            row[column] += step * ((1.0 - fraction) * table[cell, t] + fraction * table[cell + 1, t])


@compiled
def _lay_steps(fine, crossings, levels, layers, table, placing):  # type: ignore[no-untyped-def]
    count, xs, who, sense = crossings
    x0, share, weights, begin = placing
    m = 0
    winding = np.zeros(levels.size, np.int64)
    active = np.empty(levels.size, np.int64)
    for k in range(count.size - 1):
        a, b = count[k], count[k + 1]
        while k >= begin[m + 1]:
            m += 1
        sort_line(crossings, a, b)
        n_active, seen = 0, 1.0
        for i in range(a, b):
            p = who[i]
            before = winding[p]
            winding[p] = before + sense[i]
            if before == 0 or winding[p] == 0:
                n_active = _enter_or_leave(active, n_active, p, before == 0)
            top = _see_through(active, n_active, levels, layers)
            if top != seen:
                _add_step(fine[m], xs[i] - x0, (top - seen) * share * weights[k], table)
            seen = top
        for i in range(a, b):
            winding[who[i]] = 0


@compiled
def _gather_rows(fine, kernel, grid_rows, out):  # type: ignore[no-untyped-def]
    rows, columns = out.shape
    taps = kernel.size
    total = np.empty(columns, np.float32)
    for r in range(rows):
        total[:] = 0.0
        for t in range(taps):
            weight = kernel[t]
            line = fine[r * grid_rows + t]
            for c in range(columns):
                total[c] += weight * line[c]
        running = 1.0
        for c in range(columns):
            running += total[c]
            out[r, c] = running


def clear_fine_rows(window: Window, psf_px: float) -> NDArray[np.float32]:
    """Empty accumulator for :func:`lay_polygons` over ``window`` with a blur of ``psf_px``."""
    _, reach = _column_kernel(psf_px)
    rows, columns = window.shape
    return np.zeros((rows * GRID_ROWS + 2 * reach, columns), np.float32)


def lay_polygons(
    fine: NDArray[np.float32], polygons: Sequence[Polygon], window: Window, psf_px: float, weight: float = 1.0
) -> None:
    """Add ``weight`` times the picture of ``polygons`` to ``fine``: call once per instant of an exposure."""
    if not polygons:
        return
    _, reach = _column_kernel(psf_px)
    points = np.concatenate([p.points for p in polygons])
    starts = np.cumsum([0] + [len(p.points) for p in polygons])
    first = window.y0 - 0.5 - reach / GRID_ROWS
    heights, weights, begin = place_lines(points, starts, first, fine.shape[0], GRID_ROWS)
    crossings = find_crossings(points, starts, heights)
    levels = np.array([p.level for p in polygons])
    layers = np.array([p.layer for p in polygons])
    _lay_steps(fine, crossings, levels, layers, _step_table(psf_px), (float(window.x0), weight, weights, begin))


def finish_rows(fine: NDArray[np.float32], window: Window, psf_px: float) -> NDArray[np.float32]:
    """Blur the accumulator down to pixels: transmission, 1 where nothing lies. Shape of ``window``."""
    kernel, _ = _column_kernel(psf_px)
    out = np.empty(window.shape, np.float32)
    _gather_rows(fine, kernel, GRID_ROWS, out)
    return out


def draw_polygons(instants: Sequence[Sequence[Polygon]], window: Window, psf_px: float = 1.0) -> NDArray[np.float32]:
    """Transmission of ``window``, averaged over the ``instants`` of one exposure.

    Arguments: for each instant the polygons in full-frame pixels; the standard deviation of the Gaussian point spread
    function in pixels. Returns float32, shape of the window, 1 where no polygon lies.
    """
    fine = clear_fine_rows(window, psf_px)
    for polygons in instants:
        lay_polygons(fine, polygons, window, psf_px, 1.0 / len(instants))
    return finish_rows(fine, window, psf_px)
