"""The top view of one drop, from its recording to the columns of top.csv and its row of geometry.csv."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.imaging.background import Background
from wentry_cli.stages.clip import Clip
from wentry_cli.stages.track_rows import fit_columns, frame_status
from wentry_cli.stages.track_side import SideResult, exposure_frames, fitting_level
from wentry_cli.tracking.impact import find_rise
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.top import (
    TopScale,
    magnification_at,
    scale_from_approach,
    top_stretch,
    track_top,
)

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

TOP_COLUMNS = ("center_x_px", "center_y_px", "radius_px", "radius_px_unc", "gated_fraction", "residual_rms_px")
NO_SCALE = TopScale(math.nan, math.nan, "unknown")


@dataclass(frozen=True)
class TopResult:
    """What the top view gave: columns of top.csv, scale, radius of the undeformed sphere in px, impact and unc in s."""

    columns: dict[str, Any]
    scale: TopScale
    radius_px: float
    impact_s: tuple[float, float]
    problem: str = ""


def measure_top(drop: Drop, clip: Clip, ground: Background, sampled: list[int], side: SideResult | None) -> TopResult:
    """Track the top view; with a side view its impact time and depth are used, else the rise of the radius."""
    seed = find_seed(clip, ground, sampled, radius_range=_radius_range(drop))
    clip.release()
    sightings: list[Sighting] = []
    if seed is not None:
        level, exposure = fitting_level(drop, ground), exposure_frames(drop, "top", clip)
        sightings = track_top(clip, ground, seed, level=level, exposure_frames=exposure)
    fits = fit_columns(clip.count, sightings)
    impact = _impact(side, clip, fits["radius_px"])
    t_s = clip.time_s - impact[0]
    scale = _scale(drop, t_s, (fits["radius_px"], fits["radius_px_unc"]))
    radius_m = drop.experiment.sphere.radius_m
    height = _centre_height(side, clip.time_s, radius_m)
    magnification = magnification_at(height, drop.view("top").camera_distance_m)
    stretch, stretch_unc = top_stretch(fits["radius_px"], fits["radius_px_unc"], scale, radius_m, magnification)
    if side is not None:
        stretch_unc = np.hypot(stretch_unc, side.shape_offset)
    columns: dict[str, Any] = {"frame": np.arange(clip.count), "t_s": t_s}
    columns |= {name: fits[name] for name in TOP_COLUMNS}
    columns |= {"stretch": stretch, "stretch_unc": stretch_unc, "status": frame_status(clip.count, sightings)}
    problem = "" if seed is not None else "no sphere was found: check source, roi_px and polarity of views.top"
    return TopResult(columns, scale, scale.px_m * radius_m, impact, problem)


def _radius_range(drop: Drop) -> tuple[float, float]:
    scale = drop.view("top").scale_pair.air
    if scale == "auto":
        return 7.0, math.inf
    radius = scale * drop.experiment.sphere.radius_m
    return 0.75 * radius, 1.4 * radius


def _impact(side: SideResult | None, clip: Clip, radius_px: NDArray[np.float64]) -> tuple[float, float]:
    """Impact on the camera clock: from the side view where that saw it, else where the radius starts to rise."""
    if side is not None and math.isfinite(side.impact.time_s):
        return side.impact.time_s, side.impact.time_unc_s
    early = radius_px[np.isfinite(radius_px)][:5]
    if early.size == 0:
        return math.nan, math.nan
    return find_rise(clip.time_s, radius_px / float(np.median(early)))


def _scale(drop: Drop, t_s: NDArray[np.float64], radii: tuple[NDArray[np.float64], NDArray[np.float64]]) -> TopScale:
    view, sphere = drop.view("top"), drop.experiment.sphere
    given = view.scale_pair.air
    if given != "auto":
        return TopScale(float(given), view.scale_px_per_m_unc, "given")
    found = scale_from_approach(t_s, *radii, sphere.radius_m, view.camera_distance_m)
    diameter = sphere.diameter_m_unc / sphere.diameter_m
    return TopScale(found.px_m, math.hypot(found.unc_px_m, found.px_m * diameter), found.source)


def _centre_height(side: SideResult | None, time_s: NDArray[np.float64], radius_m: float) -> NDArray[np.float64]:
    """Height of the sphere's centre at the times of the top view, from the side view; NaN where that saw nothing."""
    if side is None:
        return np.full(time_s.size, np.nan)
    stretch = np.nan_to_num(np.asarray(side.columns["stretch"], np.float64), nan=1.0)
    height = np.asarray(side.columns["y_b_m"], np.float64) + radius_m / stretch**2
    t_side = np.asarray(side.columns["t_s"], np.float64) + side.impact.time_s
    good = np.isfinite(height) & np.isfinite(t_side)
    if np.count_nonzero(good) < 2:
        return np.full(time_s.size, np.nan)
    return np.asarray(np.interp(time_s, t_side[good], height[good], left=np.nan, right=np.nan))
