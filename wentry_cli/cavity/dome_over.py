"""When the splash closes over the sphere: an event of the top view, not a seal."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEAST_CONTRAST = 0.12  # between the sphere and the splash in front of it, as a share of the brighter
OPEN, CLOSED = 0.6, 0.15  # radius of the opening over that of the disc
FITTED = (0.08, 0.5)
CLOSED_RIM = 0.3  # of its greatest width: the tip of a dome has some width
STEADY = 5  # frames of splash alone at the end


@dataclass(frozen=True)
class DomeOver:
    """When the opening of the crown has closed, s; NaN unless ``status`` is ``ok``.

    ``clip_ended``: it was open to the end; ``no_edge``: splash and sphere look alike, or the sphere was not seen.
    """

    t_s: float
    t_unc_s: float
    status: str


def disc_level(values: NDArray[np.generic], x_px: float, y_px: float, radius_px: float) -> float:
    """Mean grey level of the disc about (``x_px``, ``y_px``) in the pixels of ``values`` (rows, columns)."""
    y, x = np.ogrid[: values.shape[0], : values.shape[1]]
    inside = (x - x_px) ** 2 + (y - y_px) ** 2 <= radius_px**2
    return float(values[inside].mean()) if inside.any() else float("nan")


def find_dome_over(t_s: Floats, level: Floats) -> DomeOver:
    """Find when the crown has closed over the sphere.

    Parameters
    ----------
    t_s, level : (n,) arrays
        Time and mean grey level of a disc that lies within the sphere's image even when the sphere is slender, from
        frames that show the sphere in all of it to frames that show only splash; NaN is left out.

    Notes
    -----
    The share of the disc that still shows the sphere is the square of the radius of the opening over the disc's. That
    radius falls nearly in proportion to the time that is left: a line through its last stretch gives the closure.
    """
    seen = np.isfinite(t_s) & np.isfinite(level)
    time, values = t_s[seen], level[seen]
    if time.size < 8:
        return DomeOver(np.nan, np.nan, "clip_ended" if time.size else "no_edge")
    sphere, splash = float(np.median(values[:3])), float(np.median(values[-STEADY:]))
    if abs(splash - sphere) <= LEAST_CONTRAST * max(abs(splash), abs(sphere)):
        return DomeOver(np.nan, np.nan, "no_edge")
    opening = np.sqrt(np.clip((splash - values) / (splash - sphere), 0.0, 1.0))
    still_open, closed = np.flatnonzero(opening > OPEN), np.flatnonzero(opening < CLOSED)
    closed = closed[closed > still_open[-1]] if still_open.size else closed
    steady = np.ptp(opening[-STEADY:] ** 2) < 0.1
    if still_open.size == 0 or closed.size < STEADY or not steady:
        return DomeOver(np.nan, np.nan, "clip_ended")
    return _closure(time, opening, int(still_open[-1]), int(closed[0]))


def find_rim_closure(t_s: Floats, width: Floats) -> DomeOver:
    """Find when the rim of the crown has closed, from its width in the side view (n,), NaN where it was not seen.

    After the closure the dome sinks and its tip broadens again: only what lies between the greatest width and the
    least counts. The tip itself has some width just below its highest row, which is taken off: how much of it an open
    rim has is anywhere between none and all, and the uncertainty holds that. A rim is a wall that moves: one that is
    wide in a frame and closed in the next was another thing, and is refused (``poor_fit``).
    """
    if not np.isfinite(width).any():
        return DomeOver(np.nan, np.nan, "no_edge")
    widest = int(np.nanargmax(width))
    least = float(np.nanmin(width[widest:]))
    if least > CLOSED_RIM * width[widest]:
        return DomeOver(np.nan, np.nan, "clip_ended")
    end = widest + int(np.flatnonzero(width[widest:] <= 1.15 * least)[0]) + STEADY
    closing = _without_reopening(width[widest:end])
    tip = float(np.nanmedian(closing[-STEADY:]))
    if _leaps(closing, tip):
        return DomeOver(np.nan, np.nan, "poor_fit")
    time, opening = t_s[widest:end], np.maximum(closing - tip, 0.0)
    over = find_dome_over(time, opening**2)
    if over.status != "ok":
        return over
    half = float(time[np.flatnonzero(opening > 0.5 * opening[0])[-1]])
    per_px = max(over.t_s - half, 0.0) / (0.5 * float(opening[0]))
    return replace(over, t_unc_s=float(np.hypot(over.t_unc_s, per_px * tip / np.sqrt(12.0))))


def _without_reopening(width: Floats) -> Floats:
    """The width (n,), nowhere less than later on: jets may hide a rim, and one that closes does not open."""
    later = np.fmax.accumulate(width[::-1])[::-1]
    return np.where(np.isfinite(width), later, np.nan)


def _leaps(width: Floats, least: float) -> bool:
    """Whether the rim goes from open to closed, of its greatest width (the first), from one sample to the next."""
    opening = (width[np.isfinite(width)] - least) / (width[0] - least)
    closed = int(np.flatnonzero(opening < CLOSED)[0])
    return bool(opening[closed - 1] > OPEN)


def _closure(time: Floats, opening: Floats, first: int, last: int) -> DomeOver:
    """Zero of a line through the opening while it closes.

    Where too few samples show it close, it is the first closed one, as uncertain as the time since the last open one.
    A line that leads beyond what the first closed sample leaves open is one of a crown that closed faster in the end:
    the time is that of the sample, and as uncertain as the line is late.
    """
    part = slice(first, last + 2)
    use = (opening[part] > FITTED[0]) & (opening[part] < FITTED[1])
    if use.sum() < 3:
        return DomeOver(float(time[last]), max(float(time[last] - time[first]), 0.0), "ok")
    design = np.stack([np.ones(int(use.sum())), time[part][use] - time[last]], axis=1)
    solution, *_ = np.linalg.lstsq(design, opening[part][use], rcond=None)
    if not solution[1] < 0.0:
        return DomeOver(np.nan, np.nan, "poor_fit")
    rest = opening[part][use] - design @ solution
    step = float(np.median(np.diff(time)))
    unc = float(np.hypot(np.sqrt(np.mean(rest**2)) / abs(solution[1]), 0.5 * step))
    left = max(float(solution[0] - opening[last]), 0.0) / abs(solution[1])
    return DomeOver(float(time[last] - solution[0] / solution[1]) - left, float(np.hypot(unc, left)), "ok")
