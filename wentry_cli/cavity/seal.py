"""How the cavity closes: the first neck to reach zero, and whether at depth, at the sphere or under the surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.detachment import NO_DETACHMENT, Detachment, find_detachment, hidden_rows
from wentry_cli.cavity.neck import NeckTrack
from wentry_cli.cavity.pinch_off import ClosureFit, fit_closure

Floats = NDArray[np.float64]

CLOSEST_RADIUS_PX = 1.5  # blur hides a gap of three pixels
LOWEST = 0.5  # in radii: so deep the top of the sphere is at least when a cavity above it leaves the surface
AT_SPHERE = 0.1  # in radii of the sphere: a neck that may lie so close above its top closes on it
EDGE_MODEL_PX = 0.05  # what blur and the slope of the wall leave in a radius, however low the noise
ALMOST_CLOSED = 0.45  # in radii of the sphere: a neck that is wider when last seen has not been seen to close
LONGEST_LEAP_FRAMES = 3.0
MOST_DOUBT_FRAMES = 3.0  # in the time of a closure that was seen
FEWEST_SAMPLES, FEWEST_SHUT = 8, 3
LEAP_ROWS, LAST_ROWS, LEAP_PX, LEAP_SIGMA, LEAP_SHARE = 10, 40, 1.5, 8.0, 0.8
LASTING = 0.12  # in radii: a neck as wide as that right after its closure did not close; jets and mist are thinner
AFTERMATH_FRAMES = (2.0, 10.0)  # what is seen there later is another thing
SURE = 2.0  # standard uncertainties between two closures of which one is called the first


@dataclass(frozen=True)
class Scene:
    """What the closure is judged against, per frame of the clip: arrays of shape (n,), pixels, NaN where not seen.

    ``time_s`` are mid-exposure times; ``sphere_top_px`` the row of the sphere's highest point; ``cavity_top_px`` the
    highest row at which the cavity was seen and ``apex_px`` the depth of its apex below the surface
    (``detachment.find_apex``), ``surface_px`` the row of the free surface. ``dome_over_s`` is when the splash had domed
    over, NaN where that is not known. The clip ends with its last frame that is not ``unreadable``.
    """

    time_s: Floats
    sphere_top_px: Floats
    cavity_top_px: Floats
    apex_px: Floats
    surface_px: float
    radius_px: float
    exposure_s: float
    surface_unc_px: float = 0.0
    dome_over_s: float = float("nan")
    unreadable: frozenset[int] = frozenset()

    @property
    def last_frame(self) -> int:
        """The last frame that could be read; 0 where none could."""
        return max((k for k in range(self.time_s.size) if k not in self.unreadable), default=0)


@dataclass(frozen=True)
class Seal:
    """The first closure: ``value`` is deep_seal, sphere_seal or surface_seal, empty where ``status`` is not ``ok``."""

    t_s: float
    t_unc_s: float
    y_px: float
    y_unc_px: float
    value: str
    status: str
    fit: ClosureFit | None = None


def _no_seal(status: str) -> Seal:
    nan = float("nan")
    return Seal(nan, nan, nan, nan, "", status)


def find_seal(tracks: Sequence[NeckTrack], scene: Scene) -> Seal:
    """Find the first closure of the cavity and its kind.

    The neck that reaches zero first is the pinch-off; it is a ``sphere_seal`` where it closes on the top of the sphere
    (the contact line has run up), else a ``deep_seal``. A cavity that has left the surface before is a
    ``surface_seal``. Where the order of the two is not clear, or the cavity left the surface before the splash had
    domed over, the status is ``not_identified``. Without a closing neck it is ``clip_ended`` where one still narrows in
    the last frames or the cavity is still open in them, ``no_edge`` where no frame shows a cavity or a sphere that
    stands out from the ground, else ``no_neck``. What leaves the surface together with
    the sphere's own top is a sphere wetted all round, and the bubbles on it: there is no cavity to close (``no_neck``).
    """
    fits = [_close(track, scene) for track in tracks]
    fits = [_seen_closed(track, fit, scene) for track, fit in zip(tracks, fits, strict=True)]
    closed = [(fit.t_s, i) for i, fit in enumerate(fits) if fit.status == "ok"]
    if not np.isfinite(scene.cavity_top_px).any():
        return _no_seal("no_edge")
    left = _detachment(scene)
    wetted = _interpolate(left.t_s, scene.time_s, scene.sphere_top_px) < scene.surface_px + LOWEST * scene.radius_px
    if wetted:
        left = NO_DETACHMENT
    if not closed and not np.isfinite(left.t_s):
        return _no_seal("no_neck") if wetted else _not_seen(tracks, fits, _without_sphere(scene))
    at_surface = Seal(left.t_s, left.t_unc_s, scene.surface_px, scene.surface_unc_px, "surface_seal", "ok")
    if left.t_s + SURE * left.t_unc_s < scene.dome_over_s:
        return _no_seal("not_identified")
    if not closed:
        return at_surface
    first = min(closed)[1]
    at_depth = _at_depth(tracks[first], fits[first], scene)
    apart = SURE * float(np.hypot(at_depth.t_unc_s, left.t_unc_s))
    if not left.t_s < at_depth.t_s + apart:
        return at_depth
    return at_surface if left.t_s < at_depth.t_s - apart else _no_seal("not_identified")


def _without_sphere(scene: Scene) -> Scene:
    """The scene without the highest rows that are those of the sphere itself: its own top is no cavity."""
    itself = scene.cavity_top_px > scene.sphere_top_px - AT_SPHERE * scene.radius_px
    return replace(scene, cavity_top_px=np.where(itself, np.nan, scene.cavity_top_px))


def _detachment(scene: Scene) -> Detachment:
    depth, hidden = scene.cavity_top_px - scene.surface_px, hidden_rows(scene.surface_unc_px)
    return find_detachment(scene.time_s, depth, scene.apex_px, hidden_px=hidden, radius_px=scene.radius_px)


def _close(track: NeckTrack, scene: Scene) -> ClosureFit:
    """Fit the closure of one neck and refuse what was not seen to close."""
    whole, track = scene.time_s[track.frame], _without_leap(track)
    time = scene.time_s[track.frame]
    opened = track.radius_px >= CLOSEST_RADIUS_PX
    radius_unc = _scatter(track.radius_px[opened][-30:], track.radius_unc_px[opened][-30:])
    fit = _fit(time, track.radius_px, radius_unc, scene)
    if fit.status != "ok":
        return fit
    fit = replace(fit, t_unc_s=math.hypot(fit.t_unc_s, _shift_if_all_are_off(time, track, radius_unc, scene)))
    step = float(np.nanmedian(np.diff(scene.time_s)))
    before = time < fit.t_s
    leap = fit.t_s - whole[whole < fit.t_s][-1] if before.any() else np.inf
    since = (time - fit.t_s) / step
    after = (since > AFTERMATH_FRAMES[0]) & (since < AFTERMATH_FRAMES[1])
    lasting = np.any(track.radius_px[after] > max(LASTING * scene.radius_px, 3.0))
    seen_to_close = (
        fit.samples >= FEWEST_SAMPLES
        and leap <= LONGEST_LEAP_FRAMES * step
        and track.radius_px[before][-1] <= ALMOST_CLOSED * scene.radius_px
        and not lasting
        and fit.t_unc_s <= MOST_DOUBT_FRAMES * step
    )
    return fit if seen_to_close else replace(fit, t_s=float("nan"), t_unc_s=float("nan"), status="poor_fit")


def _scatter(radius_px: Floats, radius_unc_px: Floats) -> float:
    """Standard deviation of a radius from frame to frame, px: what is uncertain in all alike does not scatter."""
    if radius_px.size < FEWEST_SAMPLES:
        return max(float(np.median(radius_unc_px)), EDGE_MODEL_PX) if radius_px.size else np.inf
    scatter = float(np.median(np.abs(np.diff(radius_px, 3)))) / (0.6745 * math.sqrt(20.0))
    return max(min(scatter, float(np.median(radius_unc_px))), EDGE_MODEL_PX)


def _fit(time_s: Floats, radius_px: Floats, radius_unc_px: float, scene: Scene) -> ClosureFit:
    return fit_closure(
        time_s,
        radius_px,
        radius_unc_px,
        exposure_s=scene.exposure_s,
        min_radius=CLOSEST_RADIUS_PX,
        last_time_s=float(np.nanmax(scene.time_s[: scene.last_frame + 1])),
    )


def _shift_if_all_are_off(time_s: Floats, track: NeckTrack, radius_unc_px: float, scene: Scene) -> float:
    """By how much the closure moves, s, if all radii are too small or all too large by what is common to them."""
    if not track.common_unc_px.any():
        return 0.0
    ends = []
    for sign in (-1.0, 1.0):
        off = np.maximum(track.radius_px + sign * track.common_unc_px * (track.radius_px > 0.0), 0.0)
        ends.append(_fit(time_s, off, radius_unc_px, scene).extrapolated_t_s)
    return 0.5 * abs(ends[1] - ends[0]) if np.isfinite(ends).all() else 0.0


def _seen_closed(track: NeckTrack, fit: ClosureFit, scene: Scene) -> ClosureFit:
    """The closure of a neck that stays closed, between its last open and first closed frame where no law tells more.

    Anywhere between the two is as likely; a law that leads far behind them is refuted.
    """
    shut = track.radius_px < CLOSEST_RADIUS_PX
    opened = np.flatnonzero(~shut)
    if opened.size < FEWEST_SAMPLES or track.frame.size - opened[-1] - 1 < FEWEST_SHUT:
        return fit
    last = opened[-1]
    lasting = bool(shut[last + 1 :].all()) and track.frame[last + 1] - track.frame[last] <= LONGEST_LEAP_FRAMES
    if not lasting or track.radius_px[last] > ALMOST_CLOSED * scene.radius_px:
        return fit
    start, end = scene.time_s[track.frame[last]], scene.time_s[track.frame[last + 1]]
    if fit.status == "ok" and fit.t_s < end + SURE * fit.t_unc_s + 0.5 * scene.exposure_s:
        return fit
    unc = float(end - start + scene.exposure_s) / np.sqrt(12.0)
    return replace(fit, t_s=float(0.5 * (start + end)), t_unc_s=unc, samples=int(opened.size), status="ok")


def _without_leap(track: NeckTrack) -> NeckTrack:
    """The neck up to where its row leaps and its radius with it: what is followed then, at a cusp, is another place.

    A row leaps that lies off the line through the ones before by pixels and by far more than these do.
    """
    for k in range(max(LEAP_ROWS, track.frame.size - LAST_ROWS), track.frame.size):
        if not track.radius_px[k] < LEAP_SHARE * track.radius_px[k - 1]:
            continue
        before = slice(k - LEAP_ROWS, k)
        line = np.polyfit(track.frame[before], track.y_px[before], 1)
        scatter = float(np.std(track.y_px[before] - np.polyval(line, track.frame[before])))
        off = abs(track.y_px[k] - float(np.polyval(line, track.frame[k])))
        if off > max(LEAP_PX, LEAP_SIGMA * scatter):
            return track.until(k)
    return track


def _at_depth(track: NeckTrack, fit: ClosureFit, scene: Scene) -> Seal:
    y_px, y_unc_px = _row_at(track, fit.t_s, scene.time_s)
    top = _interpolate(fit.t_s, scene.time_s, scene.sphere_top_px)
    at_sphere = np.isfinite(top) and y_px + np.nan_to_num(y_unc_px) > top - AT_SPHERE * scene.radius_px
    return Seal(fit.t_s, fit.t_unc_s, y_px, y_unc_px, "sphere_seal" if at_sphere else "deep_seal", "ok", fit)


def _row_at(track: NeckTrack, t_s: float, times: Floats) -> tuple[float, float]:
    """Row of the neck when it closes: a straight line through its last twelve rows before, and its uncertainty."""
    time = times[track.frame]
    before = (time < t_s) & (track.radius_px > 0.0)
    time, rows = time[before][-12:] - t_s, track.y_px[before][-12:]
    if rows.size < 4:
        return float(rows[-1]) if rows.size else float("nan"), float("nan")
    design = np.stack([np.ones_like(time), time], axis=1)
    solution, *_ = np.linalg.lstsq(design, rows, rcond=None)
    scatter = float(np.sqrt(np.sum((rows - design @ solution) ** 2) / (rows.size - 2)))
    covariance = np.linalg.pinv(design.T @ design) * scatter**2
    return float(solution[0]), float(np.hypot(np.sqrt(covariance[0, 0]), 0.5))


def _interpolate(t_s: float, times: Floats, values: Floats) -> float:
    seen = np.isfinite(times) & np.isfinite(values)
    return float(np.interp(t_s, times[seen], values[seen])) if seen.any() else float("nan")


def _not_seen(tracks: Sequence[NeckTrack], fits: Sequence[ClosureFit], scene: Scene) -> Seal:
    last = scene.last_frame
    open_at_end = any(
        track.frame[-1] >= last - 3 and track.radius_px[-1] > 0.0 and fit.status in {"clip_ended", "too_few"}
        for track, fit in zip(tracks, fits, strict=True)
    )
    refused = any(fit.status == "poor_fit" for fit in fits)
    still_open = bool(np.isfinite(scene.cavity_top_px[max(0, last - 2) : last + 1]).any())
    if open_at_end or (still_open and not refused):
        return _no_seal("clip_ended")
    return _no_seal("poor_fit" if refused else "no_neck")
