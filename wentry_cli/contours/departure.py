"""How a sphere departs from the ellipse: smooth waves round it, measured where its whole outline is seen.

The distance of the outline from the centre is that of the ellipse times

    1 + sum over n of (a_n cos n psi + b_n sin n psi),    n = 3, 4, 5, 6,

with psi the eccentric angle from the lower pole (of the undeformed sphere: its polar angle). A sphere that is not quite
round keeps these numbers when it is stretched evenly, so what is measured on the flying sphere helps where only a part
of the stretched outline is left to see. Two periods and less are the ellipse itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.arc import FIRST_WAVE, J, arc_geometry
from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.imaging.edges import edge_candidates
from wentry_cli.imaging.patch import Patch

Floats = NDArray[np.float64]
Departure = tuple[float, ...]

NONE: Departure = ()
LAST_WAVE = 6
RAYS = 240
SEARCH_PX, STEP_PX, LINES = 4.0, 0.5, 3
MOST_OFF = 0.03
LEAST_SHARE_SEEN = 0.95
FEWEST_FRAMES, FRAMES_THAT_SCATTER = 2, 4
BLUR_PX = 3.0  # along the outline, what lies nearer shares its noise
# Waves count that differ from nothing by so many standard errors and by so many pixels.
SIGNIFICANT = 5.0
LIKELY = 2.5
LEAST_PX = 0.01


def waves_at(psi: Floats) -> Floats:
    """Cosine and sine of every wave at the angles psi from the lower pole, shape (n, 8)."""
    columns = [turn(n * psi) for n in range(FIRST_WAVE, LAST_WAVE + 1) for turn in (np.cos, np.sin)]
    return np.stack(columns, axis=-1)


@dataclass(frozen=True)
class Waves:
    """The waves of one whole outline and the standard error of each; empty where they cannot be told."""

    waves: Departure = NONE
    error: float = math.nan


def measure_departure(patch: Patch, fit: SilhouetteFit) -> Waves:
    """Waves of one whole outline about its fitted ellipse; none where a part of it is not seen or not smooth."""
    offsets, rays = outline_offsets(patch, fit)
    _, waves = _rays()
    off = offsets / fit.radius_px
    good = np.abs(off) < MOST_OFF
    if np.mean(good) < LEAST_SHARE_SEEN:
        return Waves()
    ellipse = rays[:, J : J + 4] / fit.radius_px
    design = np.column_stack([ellipse, waves])[good]
    solution = np.linalg.lstsq(design, off[good], rcond=None)[0]
    independent = min(float(np.count_nonzero(good)), 2.0 * math.pi * fit.radius_px / BLUR_PX)
    error = float(np.std(off[good] - design @ solution)) * math.sqrt(2.0 / independent)
    return Waves(tuple(solution[4:].tolist()), error)


def outline_offsets(patch: Patch, fit: SilhouetteFit) -> tuple[Floats, Floats]:
    """How far outside of the fitted ellipse the edge lies along ``RAYS`` normals, px, and their geometry."""
    values = np.ascontiguousarray(patch.values, dtype=np.float32)
    rays = arc_geometry(fit.shape.vector(patch.x0, patch.y0), _rays()[0])
    at, _, _ = edge_candidates(values, rays, SEARCH_PX, STEP_PX, LINES)
    return at[:, 0], rays


@cache
def _rays() -> tuple[Floats, Floats]:
    """Angles of the rays that are looked along and the waves there; read only."""
    phi: Floats = (np.arange(RAYS, dtype=np.float64) + 0.5) * (2.0 * math.pi / RAYS)
    return phi, waves_at(0.5 * math.pi - phi)


@dataclass(frozen=True)
class Shape:
    """The waves of a sphere, empty where none is clear, and the size of those that may be there, over the radius."""

    waves: Departure = NONE
    doubt: float = 0.0


def pool_departures(found: Sequence[Waves], radius_px: float) -> Shape:
    """Median over frames without the waves that are not significant: these are the doubt. Nothing from one frame.

    The error of the median is told by the scatter of the frames, or, where there are few, by what each frame says.
    """
    rows = np.array([one.waves for one in found if one.waves])
    if len(rows) < FEWEST_FRAMES:
        return Shape()
    middle = np.median(rows, axis=0)
    if len(rows) < FRAMES_THAT_SCATTER:
        stated = float(np.median([one.error for one in found if one.waves]))
        scatter = np.maximum(0.5 * np.ptp(rows, axis=0), stated)
    else:
        scatter = 1.4826 * np.median(np.abs(rows - middle), axis=0)
    error = scatter * 1.25 / math.sqrt(len(rows))
    clear = np.abs(middle) > np.maximum(SIGNIFICANT * error, LEAST_PX / radius_px)
    likely = ~clear & (np.abs(middle) > LIKELY * error)
    doubt = float(np.sqrt(np.sum(middle[likely] ** 2)))
    return Shape(tuple(np.where(clear, middle, 0.0).tolist()) if clear.any() else NONE, doubt)


def extremes(shape: EllipseShape, departure: Departure) -> tuple[float, float]:
    """Greatest half-width over the radius, and the lowest row, of the ellipse with its departure."""
    sine, cosine, waves = _round()
    factor = 1.0 + waves @ np.array(departure)
    across, along = shape.semi_across * sine * factor, shape.semi_along * cosine * factor
    tilt = math.radians(shape.tilt_deg)
    x = across * math.cos(tilt) + along * math.sin(tilt)
    y = along * math.cos(tilt) - across * math.sin(tilt)
    half_width = 0.5 * (_peak(x) + _peak(-x))
    return half_width / shape.radius, shape.y + _peak(y)


@cache
def _round() -> tuple[Floats, Floats, Floats]:
    """Sine, cosine and waves at every half degree; read only."""
    psi: Floats = np.arange(720, dtype=np.float64) * (2.0 * math.pi / 720)
    return np.sin(psi), np.cos(psi), waves_at(psi)


def _peak(values: Floats) -> float:
    """Greatest value of a closed curve, refined by a parabola."""
    k = int(np.argmax(values))
    before, here, after = values[k - 1], values[k], values[(k + 1) % len(values)]
    bend = before - 2.0 * here + after
    return float(here if bend == 0.0 else here - (before - after) ** 2 / (8.0 * bend))
