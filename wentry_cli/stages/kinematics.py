"""Stage ``kinematics``: heights, velocities and acceleration in every frame of the side view (``kinematics.csv``)."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.kinematics.ballistic import fit_parabola
from wentry_cli.kinematics.centre import below_ellipsoid, early_shape_time, early_shape_time_from_period
from wentry_cli.kinematics.entry import EntryMotion, fall_before_impact, solve_entry_motion
from wentry_cli.kinematics.fall_check import Fall
from wentry_cli.kinematics.state_pass import Ballistic
from wentry_cli.stages.inputs.air import fall_in_air, released
from wentry_cli.stages.inputs.columns import column, first_known, first_row, number
from wentry_cli.stages.track.scales import axis_effect
from wentry_cli.tables import has_table, new_table, read_table, write_table
from wentry_cli.tracking.scale import PixelMap, pixel_to_metre

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

Array = NDArray[np.float64]
logger = logging.getLogger(__name__)
CHECK_FALL = (
    "check fps of views.side and sphere.diameter_m, which give time and scale, polarity, which says what of a bright "
    "sphere is followed, and that the camera does not shake"
)
NOMINAL_DENSITY = 1070.0  # the paper's; only bounds the drag of the air where none was given


def run(folder: Path, drop: Drop) -> None:
    """Write ``kinematics.csv`` for a free flight or for an entry into water."""
    write = _free_flight if drop.experiment.kind == "free_flight" else _entry
    columns = write(folder, drop)
    if columns is not None:
        write_table(folder, "kinematics", new_table("kinematics", columns))


def _positions(view: pd.DataFrame, geometry: dict[str, Any], *, origin_y_px: float) -> tuple[Array, Array]:
    """x and height of the centre of the outline, m; x is 0 at the first measured centre."""
    x, y = column(view, "center_x_px"), column(view, "center_y_px")
    air = number(geometry, "scale_px_per_m")
    water = air if math.isfinite(origin_y_px) else number(geometry, "scale_water_px_per_m", air)
    surface = origin_y_px if math.isfinite(origin_y_px) else number(geometry, "surface_y_px")
    return pixel_to_metre(x, y, PixelMap(air, water, surface, first_known(x), surface))


def _free_flight(folder: Path, drop: Drop) -> dict[str, Any] | None:
    """Constant acceleration in x and y, with no prior on gravity; y = 0 at the first measured centre."""
    seen_in = next((v for v in ("side", "top") if has_table(folder, v)), None)
    if seen_in is None:
        return None
    view, geometry = read_table(folder, seen_in), first_row(folder, "geometry", view=seen_in)
    times = column(view, "t_s")
    x, y = _positions(view, geometry, origin_y_px=first_known(column(view, "center_y_px")))
    y_unc = _centre_unc(view, geometry)
    fit = fit_parabola(times, y, y_unc)
    states, covariance = fit.evaluate(times)
    seen = np.isfinite(y)
    spread = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    own = y_unc * fit.noise_scale
    bottom, bottom_unc = _flight_bottom(view, y - drop.experiment.sphere.radius_m, own)
    columns: dict[str, Any] = {"frame": view["frame"].to_numpy(), "t_s": times, "x_c_m": x}
    columns |= {"y_b_m": bottom, "y_b_m_unc": np.where(np.isfinite(bottom), bottom_unc, np.nan)}
    own = np.where(seen, own, np.nan)
    columns |= {"y_c_m": y, "y_c_m_unc": own, "y_c_m_unc_random": own}
    columns["y_b_m_unc_random"] = np.where(np.isfinite(bottom), np.minimum(own, bottom_unc), np.nan)
    for i, names in ((1, ("v_b_m_s", "v_c_m_s")), (2, ("a_c_m_s2",))):
        for name in names:
            columns[name] = np.where(seen, states[:, i], np.nan)
            columns[f"{name}_unc"] = np.where(seen, spread[:, i], np.nan)
    words = view["status"].fillna("no_object").to_numpy(dtype=object)
    words[seen & (words == "ok") & (fit.status == "too_few")] = "too_few"
    words[seen & ~fit.used & (words == "ok") & (fit.status == "ok")] = "poor_fit"
    columns["status"] = words
    return columns


def _flight_bottom(view: pd.DataFrame, below: Array, unc: Array) -> tuple[Array, Array]:
    """The lowest point as the view has it, or where it has none a radius ``below`` the centre."""
    if "y_b_m" not in view:
        return below, unc
    seen, seen_unc = column(view, "y_b_m"), column(view, "y_b_m_unc")
    known = np.isfinite(seen) & np.isfinite(seen_unc) & np.isfinite(below)
    return np.where(known, seen, below), np.where(known, seen_unc, unc)


def _centre_unc(view: pd.DataFrame, geometry: dict[str, Any]) -> Array:
    """Standard uncertainty of the centre, m, as the recording itself shows it.

    The radius of the sphere is constant, so that its scatter about a line, slow bends included, is the error of the
    edge; a centre made of the same edge scatters √2 times as much. (A line: an edge that drifts steadily falsifies a
    speed, not an acceleration.) From frame to frame it follows the stated uncertainty.
    """
    scale = number(geometry, "scale_px_per_m")
    stated = column(view, "radius_px_unc_random" if "radius_px_unc_random" in view else "radius_px_unc") / scale
    stated = np.where(np.isfinite(stated) & (stated > 0.0), stated, np.nan)
    typical = float(np.nanmedian(stated)) if np.isfinite(stated).any() else 0.1 / scale
    radius = column(view, "radius_px") / scale
    known = np.isfinite(radius)
    scatter = typical
    if known.sum() > 3:
        frames = np.arange(radius.size)[known]
        off = radius[known] - np.polyval(np.polyfit(frames, radius[known], 1), frames)
        scatter = math.sqrt(2.0 * float(np.sum(off**2)) / (known.sum() - 2))
    return np.where(np.isfinite(stated), stated / typical, 1.0) * (scatter or typical)


def _entry(folder: Path, drop: Drop) -> dict[str, Any] | None:
    if not has_table(folder, "side"):
        return None
    side, geometry = read_table(folder, "side"), first_row(folder, "geometry", view="side")
    times = column(side, "t_s")
    fall = fall_in_air(drop, side, geometry)
    _tell_of_fall(drop, fall)
    motion = _motion(folder, drop, (side, geometry, fall), _stretch(folder, drop, times), None)
    x, _ = _positions(side, geometry, origin_y_px=math.nan)
    columns: dict[str, Any] = {"frame": side["frame"].to_numpy(), "t_s": times, "x_c_m": x} | motion_columns(motion)
    columns["status"] = _words(side, columns, motion, _early_until(folder, drop))
    return columns


def _tell_of_fall(drop: Drop, fall: Fall | None) -> None:
    """Warn where the sphere falls before impact with clearly another acceleration than that of gravity."""
    if fall is None or fall.falls:
        return
    told = CHECK_FALL
    if drop.view("side").surface_y_px != "auto":
        when = "views.side.surface_y_px, which says when it ends"
        told = f"check {when}" if fall.falls_early else f"{told}, and {when}"
    logger.warning(
        "%s: before impact the sphere falls with %.2g ± %.1g m/s², not with gravity_m_s2 = %.3g: %s",
        drop.name, fall.acceleration, fall.unc, drop.experiment.gravity_m_s2, told,
        extra=puts_in_doubt("fall before impact"),
    )  # fmt: skip


def entry_motion(
    folder: Path, drop: Drop, stretch: tuple[Array, Array], *, bottom: tuple[Array, Array] | None = None
) -> EntryMotion:
    """Smooth the entry of ``drop`` with any λ at the frames of the side view (measured, or a model's).

    ``bottom`` defaults to ``y_b_m`` of ``side.csv``. The stages ``kinematics`` and ``model`` both come through here.
    """
    side, geometry = read_table(folder, "side"), first_row(folder, "geometry", view="side")
    return _motion(folder, drop, (side, geometry, fall_in_air(drop, side, geometry)), stretch, bottom)


def _motion(
    folder: Path,
    drop: Drop,
    seen: tuple[pd.DataFrame, dict[str, Any], Fall | None],
    stretch: tuple[Array, Array],
    bottom: tuple[Array, Array] | None,
) -> EntryMotion:
    side, geometry, fall = seen
    return solve_entry_motion(
        column(side, "t_s"),
        bottom or (column(side, "y_b_m"), column(side, "y_b_m_unc")),
        stretch,
        drop.experiment.sphere.radius_m,
        ballistic=_known_of_fall(side, geometry, fall, drop),
        mode=drop.experiment.analysis.smoother,
        slow_s=_slow(folder, side, drop),
        fixed_m=_fixed(geometry, column(side, "t_s")),
        tilt_deg=column(side, "tilt_deg") + number(geometry, "roll_deg", 0.0),
        below_m=_below(side, drop),
        released_s=released(geometry),
    )


def _below(side: pd.DataFrame, drop: Drop) -> Array:
    """How much lower than an ellipsoid the outline reaches in each frame, m; 0 where a person has put a value in."""
    stretch = column(side, "stretch") if drop.experiment.deformable else np.ones(len(side))
    depth = column(side, "bottom_y_px") - column(side, "center_y_px")
    radius_m = drop.experiment.sphere.radius_m
    depth[(side["status"] == "manual").to_numpy(dtype=bool)] = np.nan
    return below_ellipsoid(depth, column(side, "radius_px"), stretch, column(side, "tilt_deg"), radius_m)


def _fixed(geometry: dict[str, Any], times: Array) -> Array:
    """The part of the uncertainty of a height, m, that frames share: the surface's row, below it the axis."""
    surface = number(geometry, "surface_y_px_unc", 0.0) / number(geometry, "scale_px_per_m", math.inf)
    return np.hypot(surface, np.where(times > 0.0, _by_axis(geometry), 0.0))


def motion_columns(motion: EntryMotion) -> dict[str, Array]:
    """The columns that ``kinematics.csv`` and ``kinematics_model.csv`` share, from y_b_m to a_c_m_s2_unc."""
    return {
        "y_b_m": motion.bottom_m,
        "y_b_m_unc": motion.bottom_unc_m,
        "y_b_m_unc_random": motion.bottom_random_m,
        "y_c_m": motion.centre_m,
        "y_c_m_unc": motion.centre_unc_m,
        "y_c_m_unc_random": motion.centre_random_m,
        "v_b_m_s": motion.bottom_velocity,
        "v_b_m_s_unc": motion.bottom_velocity_unc,
        "v_c_m_s": motion.velocity,
        "v_c_m_s_unc": motion.velocity_unc,
        "a_c_m_s2": motion.acceleration,
        "a_c_m_s2_unc": motion.acceleration_unc,
    }


def _stretch(folder: Path, drop: Drop, times: Array) -> tuple[Array, Array]:
    """λ at the frames of the side view: measured, or 1 for a rigid sphere."""
    if not drop.experiment.deformable:
        return np.ones_like(times), np.zeros_like(times)
    if not has_table(folder, "stretch"):
        return np.full_like(times, np.nan), np.full_like(times, np.nan)
    table = read_table(folder, "stretch")
    return column(table, "stretch"), column(table, "stretch_unc")


def _known_of_fall(side: pd.DataFrame, geometry: dict[str, Any], fall: Fall | None, drop: Drop) -> Ballistic:
    """What is known of the fall before impact, and how far a change of scale at the waterline may shift the heights.

    Nothing is known of the acceleration of a fall that contradicts gravity.
    """
    experiment = drop.experiment
    times, heights = column(side, "t_s"), column(side, "y_b_m")
    before = (times < 0.0) & np.isfinite(heights)
    speed = -float(np.polyfit(times[before], heights[before], 1)[0]) if before.sum() > 2 else 0.0
    known = fall_before_impact(
        experiment.gravity_m_s2,
        speed,
        experiment.sphere.radius_m,
        experiment.sphere.density or NOMINAL_DENSITY,
        position_jump_m=_by_axis(geometry),
    )
    return known if fall is None or fall.falls else replace(known, acceleration=math.nan)


def _by_axis(geometry: dict[str, Any]) -> float:
    """How far the uncertain optical axis may shift all heights below the surface, m."""
    air = number(geometry, "scale_px_per_m")
    water = number(geometry, "scale_water_px_per_m", air)
    return number(geometry, "optical_axis_y_px_unc", 0.0) * axis_effect(air, water)


def _slow(folder: Path, side: pd.DataFrame, drop: Drop) -> float:
    """How slowly errors of shape and scale vary: half a free period, else the time to fall a diameter."""
    if drop.experiment.deformable and has_table(folder, "periods"):
        period = first_known(column(read_table(folder, "periods"), "peak_to_peak_s"))
        if math.isfinite(period):
            return 0.5 * period
    times, heights = column(side, "t_s"), column(side, "y_b_m")
    known = np.isfinite(heights)
    speed = float(np.ptp(heights[known]) / np.ptp(times[known])) if known.sum() > 1 else 0.0
    return drop.experiment.sphere.diameter_m / speed if speed > 0.0 else math.inf


def _early_until(folder: Path, drop: Drop) -> float:
    """How long after impact the shape is a wave: from the material, else from the measured period; 0 if rigid."""
    sphere = drop.experiment.sphere
    if not drop.experiment.deformable:
        return 0.0
    if drop.material is not None:
        return early_shape_time(sphere.radius_m, drop.material.g_inf_pa, sphere.density or NOMINAL_DENSITY)
    if has_table(folder, "periods"):
        period = first_known(column(read_table(folder, "periods"), "peak_to_peak_s")[:1])
        if math.isfinite(period):
            return early_shape_time_from_period(period)
    return 0.0


def _words(side: pd.DataFrame, columns: dict[str, Any], motion: EntryMotion, early: float) -> NDArray[np.object_]:
    """Status of each row: ok only where every value is there."""
    full = np.all([np.isfinite(v) for k, v in columns.items() if k != "frame"], axis=0)
    own = side["status"].fillna("no_object").to_numpy(dtype=object)
    manual = own == "manual"
    times = columns["t_s"]
    words = np.where(full, "ok", np.where(np.isin(own, ["ok", "manual"]), "occluded", own)).astype(object)
    if motion.centre.status == "too_few":
        words[np.isfinite(motion.centre_m)] = "too_few"
    words[motion.held & ~full & np.isfinite(motion.centre_m)] = "too_few"
    words[full & motion.outlier] = "poor_fit"
    words[full & (times >= 0.0) & (times < early)] = "early_shape"
    words[manual] = "manual"  # also where the person left the frame out
    return words
