"""Rows of side.csv and top.csv from sightings: a row per frame, empty where nothing was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wentry_cli.kinematics.centre import ellipsoid_depth
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.tilt import identified_tilt

SEPARATION_WINDOW = 2
STUCK, STUCK_PX, STUCK_DEFORMED_PX, NEARBY = 4.0, 0.03, 0.1, 7
FEWEST_APART = 5
MUCH_LESS_SURE, SURE_PX, SURER, CROWDED = 5.0, 0.1, 0.5, 0.3
FIT_COLUMNS = {
    "center_x_px": "center_x_px",
    "center_y_px": "center_y_px",
    "radius_px": "radius_px",
    "radius_px_unc": "radius_unc_px",
    "stretch": "stretch",
    "stretch_unc": "stretch_unc",
    "bottom_y_px": "bottom_y_px",
    "bottom_y_px_unc": "bottom_y_unc_px",
    "arc_fraction": "arc_fraction",
    "gated_fraction": "gated_fraction",
    "residual_rms_px": "residual_rms_px",
}


def frame_status(count: int, sightings: Sequence[Sighting]) -> list[str]:
    """A status word for every frame.

    Frames before the first sighting show a sphere that has not come in yet (``out_of_frame``); those after the last
    keep the reason why the path ended. Without any sighting all are ``no_object``.
    """
    status = ["no_object"] * count
    if not sightings:
        return status
    status[: sightings[0].frame] = ["out_of_frame"] * sightings[0].frame
    for item in sightings:
        status[item.frame] = item.status
    last = sightings[-1]
    ending = last.status if last.status in {"out_of_frame", "occluded"} else "no_object"
    status[last.frame + 1 :] = [ending] * (count - last.frame - 1)
    return status


def fit_columns(count: int, sightings: Sequence[Sighting]) -> dict[str, NDArray[np.float64]]:
    """What the fits say, NaN in frames that failed."""
    good = [item for item in sightings if item.ok]
    frames = [item.frame for item in good]
    found = {name: [getattr(item.fit, attribute) for item in good] for name, attribute in FIT_COLUMNS.items()}
    outlines = [item.outline for item in good]
    found["stretch"], found["bottom_y_px"] = [wide for wide, _ in outlines], [low for _, low in outlines]
    columns = {name: np.full(count, np.nan) for name in FIT_COLUMNS}
    for name, values in found.items():
        columns[name][frames] = values
    return columns


def local_bottom_holds(columns: dict[str, Any], doubt_px: float, *, deforms: bool) -> NDArray[np.bool_]:
    """Frames whose lowest point is that of the bottom alone: it was measured, and nothing sticks to it.

    Droplets may also leave so little of the bottom that the whole outline knows much better, even with the
    ``doubt_px`` of its shape; where much sticks to the sphere the bottom must be clearly the surer of the two.
    """
    known = np.isfinite(columns["bottom_local_y_px"])
    outline = columns["bottom_y_px_unc"]
    crowded = columns["gated_fraction"] > CROWDED
    enough = np.where(crowded, 0.0, np.minimum(MUCH_LESS_SURE * outline, SURE_PX))
    sure = columns["bottom_local_y_px_unc"] < np.maximum(enough, SURER * np.hypot(outline, doubt_px))
    return np.asarray(known & sure & ~contradicted_bottom(columns, deforms=deforms))


def local_bottom_unc(columns: dict[str, Any], doubt_px: float) -> NDArray[np.float64]:
    """Uncertainty of the bottom alone, px.

    Where much sticks to the sphere a bubble may sit on the bottom for many frames and pass for it: what the bottom
    lies off the whole outline, beyond the uncertainty of the two, is then doubt.
    """
    local, outline = columns["bottom_local_y_px_unc"], np.hypot(columns["bottom_y_px_unc"], doubt_px)
    apart = columns["bottom_local_y_px"] - columns["bottom_y_px"]
    beyond = np.sqrt(np.maximum(apart**2 - local**2 - outline**2, 0.0))
    return np.asarray(np.where(columns["gated_fraction"] > CROWDED, np.hypot(local, beyond), local))


def lowest_rows(
    columns: dict[str, Any], use_local: NDArray[np.bool_], air: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lowest point of each frame, px, and its uncertainty: that of the bottom alone, else that of the outline.

    In ``air`` a sphere does not change its shape, so neither does what its outline lies off its bottom: where the
    outline goes on for the bottom it takes that along, or the step between the two would be taken for a velocity.
    """
    local, outline = columns["bottom_local_y_px"], columns["bottom_y_px"]
    unc = columns["bottom_y_px_unc"]
    apart = (local - outline)[use_local & air]
    if apart.size >= FEWEST_APART:
        error = float(np.std(apart, ddof=1)) / np.sqrt(apart.size)
        outline = np.where(air, outline + float(np.median(apart)), outline)
        unc = np.where(air, np.hypot(unc, error), unc)
    return np.where(use_local, local, outline), np.where(use_local, columns["bottom_local_y_px_unc"], unc)


def lowest_points(
    columns: dict[str, Any], bottom_px: NDArray[np.float64], roll_rad: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Column and row of the lowest point of each frame: that of the picture, unless the camera was rolled.

    Then it lies below the centre along the true vertical, as deep as the ellipse is in that direction.
    """
    x, y = columns["center_x_px"], columns["center_y_px"]
    if not roll_rad:
        return x, bottom_px
    stretch, tilt_deg = columns["stretch"], columns["tilt_deg"]
    deeper = ellipsoid_depth(stretch, tilt_deg + np.degrees(roll_rad)) - ellipsoid_depth(stretch, tilt_deg)
    known = np.isfinite(tilt_deg) & np.isfinite(stretch)  # elsewhere it is as deep in all directions
    depth = bottom_px - y + np.where(known, columns["radius_px"] * deeper, 0.0)
    return x - depth * np.sin(roll_rad), y + depth * np.cos(roll_rad)


def contradicted_bottom(columns: dict[str, Any], *, deforms: bool) -> NDArray[np.bool_]:
    """Frames in which the bottom alone lies off the whole outline by more than it usually does: something sticks to it.

    The outline of a sphere that deforms may depart from an ellipse by itself, but slowly: for it (``deforms``) usual is
    what the frames nearby say.
    """
    apart = columns["bottom_local_y_px"] - columns["bottom_y_px"]
    seen = np.flatnonzero(np.isfinite(apart))
    usual = np.full(apart.shape, np.median(apart[seen]) if seen.size else 0.0)
    if deforms and seen.size:
        wide = np.pad(apart[seen], NEARBY, mode="edge")
        usual[seen] = np.median(np.lib.stride_tricks.sliding_window_view(wide, 2 * NEARBY + 1), axis=1)
    unc = np.hypot(columns["bottom_local_y_px_unc"], columns["bottom_y_px_unc"])
    least = STUCK_DEFORMED_PX if deforms else STUCK_PX
    return np.asarray(np.nan_to_num(np.abs(apart - usual)) > STUCK * np.nan_to_num(unc) + least)


def blurred_stretch(columns: dict[str, Any], exposure_frames: float) -> NDArray[np.float64]:
    """What of λ a frame does not tell because the sphere moves and deforms at once while it is exposed.

    The fits know the blur of a motion, not that of a deformation: a bottom that is carried down while it is drawn up
    is blurred less than they take it to be. On rendered clips λ comes out wrong by the product of what changes during
    the exposure, that of λ times the way over the radius.
    """
    grows = exposure_frames * _per_frame(columns["stretch"])
    way = exposure_frames * np.hypot(_per_frame(columns["center_x_px"]), _per_frame(columns["center_y_px"]))
    return np.asarray(np.nan_to_num(np.abs(grows) * way / columns["radius_px"]))


def _per_frame(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differences of neighbours that were both measured, else of one; NaN where there are none."""
    step = np.append(np.diff(values), np.nan)
    before = np.append(np.nan, step[:-1])
    both = 0.5 * (step + before)
    return np.where(np.isfinite(both), both, np.where(np.isfinite(step), step, before))


def side_columns(count: int, sightings: Sequence[Sighting]) -> dict[str, Any]:
    """The pixel columns of side.csv."""
    columns: dict[str, Any] = {"frame": np.arange(count), **fit_columns(count, sightings)}
    for name in ("bottom_local_y_px", "separation_y_px", "tilt_deg"):
        columns[name], columns[f"{name}_unc"] = np.full(count, np.nan), np.full(count, np.nan)
    for item in sightings:
        if item.ok and item.bottom is not None and item.bottom.status == "ok":
            columns["bottom_local_y_px"][item.frame] = item.bottom.y_px
            columns["bottom_local_y_px_unc"][item.frame] = item.bottom.y_unc_px
        if item.ok and item.separation is not None and item.separation.status == "ok":
            columns["separation_y_px"][item.frame] = item.separation.y_px
            columns["separation_y_px_unc"][item.frame] = item.separation.y_unc_px
        if item.ok and item.fit is not None:
            columns["tilt_deg"][item.frame], columns["tilt_deg_unc"][item.frame] = identified_tilt(item.fit)
    columns["separation_y_px"] = _steady_separation(columns["separation_y_px"], columns["center_y_px"])
    columns["status"] = frame_status(count, sightings)
    return columns


def _steady_separation(line: NDArray[np.float64], centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median over five frames of where the separation line is on the sphere (relative to its centre)."""
    offset = line - centre
    known = np.isfinite(offset)
    steady = np.full(line.size, np.nan)
    if known.any():
        padded = np.pad(offset, SEPARATION_WINDOW, constant_values=np.nan)
        windows = sliding_window_view(padded, 2 * SEPARATION_WINDOW + 1)
        steady[known] = centre[known] + np.nanmedian(windows[known], axis=1)
    return steady
