"""What is true in a rendered drop: tables frame by frame, necks, and the numbers of the drop.

The stretch is the greatest half-width over R across the body's own axis (``outline`` says what that means for misfit
and tilted shapes), y_b the lowest point of the drawn outline, and time 0 its first contact: y_b = 0 there.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from wentry_cli.synthetic.camera_view import place_side
from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.drop_folder import write_whole
from wentry_cli.synthetic.outline import measure_outline
from wentry_cli.synthetic.periods import PERIOD_DEFINITION, Periods, find_periods
from wentry_cli.synthetic.ring_cavity import find_contact
from wentry_cli.synthetic.side_view import Instant, find_film, see_instant
from wentry_cli.synthetic.splash import find_dome_height
from wentry_cli.synthetic.top_view import find_magnification, shows_circle

Floats = NDArray[np.float64]
LEAST_ARC = 0.2
BAND_BLUR = 2.0
WALL_ROWS = 24


def find_separation(course: Course, now: Instant) -> float:
    """Height of the contact line: the lowest place where the wall stands off the sphere; NaN before impact."""
    cavity = course.cavity
    if cavity is None or now.t <= 0.0:
        return float("nan")
    contact = float(find_contact(course.motion, course.scene.physics, np.array([now.t]))[0][0])
    along = course.motion.radius_m / now.stretch**2
    across = course.motion.radius_m * now.stretch
    relative = np.clip((-now.depth - now.y_c_m) / along, -1.0, 1.0)
    sphere = across * course.motion.shape.half_width(relative)
    off = (now.wall >= sphere * (1.0 - 1e-6)) & (now.depth <= contact)
    if off.size > 1 and off[-1] and now.wall[-2] < sphere[-2] * (1.0 - 1e-6):
        # the ring that is being laid touches the sphere in any case; where the one above it is wet, so is this
        off[-1] = False
    if not off.any():
        top = now.y_c_m + along
        return float(min(top, 0.0)) if contact > 0.0 else 0.0
    return -float(now.depth[off][-1])


def is_measurable(course: Course, now: Instant, separation_m: float) -> bool:
    """Whether the side view shows the sphere: all of it before impact, at least a fifth of its outline after.

    What is wet, below the dark band of the surface and its blur (two standard deviations), and not in front of the
    sphere's own mirror image is shown.
    """
    camera = course.scene.side
    if camera is None:
        return shows_circle(course, now.t)
    view = place_side(course.scene)
    pixels = view.to_water(now.outline) if now.t > 0.0 else view.to_air(now.outline)
    if np.isfinite(separation_m):
        switches = course.scene.switches
        shown = now.outline[:, 1] < min(separation_m, 0.0)
        shown &= pixels[:, 1] > view.surface_y_px + 0.5 * switches.surface_band_px + BAND_BLUR * camera.lamp.psf_px
        if switches.mirror_image:
            shown &= ~_before_image(now.outline)
        if shown.sum() < LEAST_ARC * len(shown):
            return False
        pixels = pixels[shown]
    inside = (pixels[:, 0] > 2.0) & (pixels[:, 0] < camera.width - 3.0)
    inside &= (pixels[:, 1] > 2.0) & (pixels[:, 1] < camera.height - 3.0)
    return bool(inside.all())


def _before_image(outline: Floats) -> NDArray[np.bool_]:
    """Which points of an outline, in metres, lie within the mirror image of what of it is above the surface."""
    middle = float(outline[:, 0].mean())
    order = np.argsort(outline[:, 1])
    half_width = np.interp(-outline[:, 1], outline[order, 1], np.abs(outline[order, 0] - middle), left=0.0, right=0.0)
    return np.asarray((outline[:, 1] < 0.0) & (np.abs(outline[:, 0] - middle) < half_width))


def tabulate_side(course: Course, times: Floats) -> list[dict[str, Any]]:
    """Rows of truth.csv at ``times`` (mid-exposure, after impact)."""
    y, v, a = course.motion.center(times)
    widest = course.motion.shape.widest
    camera = course.scene.side or course.scene.top
    empty = camera.empty_frames if camera is not None else 0
    rows = []
    for k, t in enumerate(times):
        now = see_instant(course, float(t))
        about = now.outline - (now.x_m, now.y_c_m)
        _, below = measure_outline(np.column_stack([about[:, 0], -about[:, 1]]))
        separation = find_separation(course, now)
        rows.append({
            "frame": k, "time_s": float(t - times[0]), "t_s": float(t), "stretch": now.stretch * widest,
            "y_b_m": now.y_c_m - below, "y_c_m": float(y[k]), "v_c_m_s": float(v[k]), "a_c_m_s2": float(a[k]),
            "separation_y_m": separation, "measurable": int(k >= empty and is_measurable(course, now, separation)),
        })  # fmt: skip
    return rows


def tabulate_top(course: Course, times: Floats) -> list[dict[str, Any]]:
    """Rows of top.csv: apparent radius in pixels, and whether the opening of the crown shows the whole circle."""
    camera = course.scene.top
    assert camera is not None
    rows = []
    for k, t in enumerate(times):
        y, stretch = float(course.motion.center(t)[0]), float(course.motion.stretch(t)[0])
        magnification = find_magnification(course, y)
        stretch *= course.motion.shape.widest
        radius = stretch * course.motion.radius_m
        apparent = radius * camera.scale_px_per_m * magnification
        rows.append({
            "frame": k, "time_s": float(t - times[0]), "t_s": float(t), "stretch": stretch,
            "radius_px": apparent, "magnification": magnification,
            "measurable": int(k >= camera.empty_frames and shows_circle(course, float(t))),
        })  # fmt: skip
    return rows


def find_necks(course: Course, t: float) -> list[tuple[float, float]]:
    """Interior minima of the cavity wall at ``t``: height and radius, from the surface down, closed ones left out."""
    cavity = course.cavity
    if cavity is None or t <= 0.0 or (np.isfinite(cavity.t_p_s) and t >= cavity.t_p_s):
        return []
    now = see_instant(course, t)
    top = -(now.y_c_m + course.motion.radius_m / now.stretch**2)
    use = now.depth < top
    wall, depth = now.wall[use], now.depth[use]
    if wall.size < 5:
        return []
    low = np.flatnonzero((wall[1:-1] < wall[:-2]) & (wall[1:-1] <= wall[2:])) + 1
    return [(-float(depth[i]), float(wall[i])) for i in low if wall[i] > 0.0]


def tabulate_necks(course: Course, times: Floats) -> list[dict[str, Any]]:
    """Rows of necks.csv; a neck keeps its number while it moves by less than half a radius between frames."""
    rows: list[dict[str, Any]] = []
    alive: dict[int, float] = {}
    count = 0
    for k, t in enumerate(times):
        here: dict[int, float] = {}
        for y, radius in find_necks(course, float(t)):
            near = [n for n, at in alive.items() if abs(at - y) < 0.5 * course.motion.radius_m and n not in here]
            if near:
                label = min(near, key=lambda n: abs(alive[n] - y))
            else:
                count += 1
                label = count
            here[label] = y
            rows.append({"frame": k, "t_s": float(t), "neck": label, "y_m": y, "radius_m": radius})
        alive = here
    return rows


def tabulate_walls(course: Course, times: Floats) -> list[dict[str, Any]]:
    """Rows of walls.csv: the cavity wall at WALL_ROWS depths a frame (wall 1) and the film inside it (wall 2)."""
    rows: list[dict[str, Any]] = []
    assert course.cavity is not None
    for k, t in enumerate(times):
        now = see_instant(course, float(t))
        walls = [np.column_stack([now.wall, -now.depth])]
        walls += [find_film(course, now, start) for start in course.cavity.starts[:1]]
        for number, wall in enumerate(walls, start=1):
            for radius, y in wall[:: max(1, len(wall) // WALL_ROWS)]:
                rows.append({"frame": k, "t_s": float(t), "wall": number, "y_m": float(y), "radius_m": float(radius)})
    return rows


def _number(value: float) -> float | None:
    return float(f"{value:.9g}") if np.isfinite(value) else None


def summarise_truth(course: Course, side_times: Floats | None) -> dict[str, Any]:
    """The contents of truth.yaml."""
    scene, cavity = course.scene, course.cavity
    periods = find_periods(course) if scene.sphere.law is not None else Periods((), (), (), (), ())
    widest = course.motion.shape.widest  # λ is the greatest half-width over R here as in truth.csv
    u0 = course.motion.speed_m_s
    truth: dict[str, Any] = {
        "impact_time_s": None if scene.kind == "free_flight" or side_times is None else _number(-float(side_times[0])),
        "u0_m_s": _number(u0),
        "t_p_s": _number(cavity.t_p_s) if cavity else None,
        "y_p_m": _number(cavity.y_p_m) if cavity else None,
        "pinch_off_cavity": cavity.pinch_off_cavity if cavity and cavity.pinch_off_cavity else None,
        "seal_type": cavity.seal_type if cavity else None,
        "dome_over_s": _number(course.dome_over_s),
        "dome_over_y_m": _number(find_dome_height(course)),
        "period_definition": PERIOD_DEFINITION if periods.ends_s else None,
        "periods": [
            {"start_s": _number(a), "end_s": _number(b)} for a, b in zip(periods.starts_s, periods.ends_s, strict=True)
        ],
        "peak_times_s": [_number(p) for p in periods.peak_times_s],
        "peaks": [_number(widest * p) for p in periods.peaks],
        "valleys": [_number(widest * p) for p in periods.valleys],
        "free_period_s": _number(periods.peak_times_s[1] - periods.peak_times_s[0]) if len(periods.peaks) > 1 else None,
        "delta_u_over_u0": None,
    }
    if periods.ends_s and scene.kind == "water_entry":
        v1 = float(course.motion.center(periods.ends_s[0])[1])
        truth["delta_u_over_u0"] = _number((u0 + v1) / u0)
    if cavity is not None and cavity.seal_type == "deep_seal" and periods.peaks:
        n = cavity.pinch_off_cavity
        truth["stretch_peak_n"] = _number(widest * periods.peaks[n - 1]) if n <= len(periods.peaks) else None
    if scene.sphere.law is None and scene.kind == "water_entry":
        truth["pinch_off_cavity"] = None
    if scene.side is not None:
        view = place_side(scene)
        truth["scale_px_per_m"] = _number(view.scale_px_per_m)
        truth["scale_water_px_per_m"] = _number(view.scale_px_per_m * view.wet_scale)
        truth["surface_y_px"] = _number(view.surface_y_px)
        truth["optical_axis_y_px"] = _number(view.axis_y_px) if view.wet_scale != 1.0 else None
    return truth


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """A CSV of ``rows``: floats with 9 significant digits, NaN as an empty cell."""

    def cell(value: Any) -> str:
        if isinstance(value, float):
            return f"{value:.9g}" if np.isfinite(value) else ""
        return str(value)

    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([[cell(row[c]) for c in columns] for row in rows])


TRUTH_COLUMNS = (
    "frame", "time_s", "t_s", "stretch", "y_b_m", "y_c_m", "v_c_m_s", "a_c_m_s2", "separation_y_m", "measurable",
)  # fmt: skip
NECK_COLUMNS = ("frame", "t_s", "neck", "y_m", "radius_m")
WALL_COLUMNS = ("frame", "t_s", "wall", "y_m", "radius_m")
TOP_COLUMNS = ("frame", "time_s", "t_s", "stretch", "radius_px", "magnification", "measurable")


def write_truth(course: Course, folder: Path, side_times: Floats | None, top_times: Floats | None) -> None:
    """Write truth.csv, necks.csv, walls.csv, truth.yaml, and top.csv where there is a top view, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    times = side_times if side_times is not None else top_times
    assert times is not None
    write_rows(folder / "truth.csv", tabulate_side(course, times), TRUTH_COLUMNS)
    write_rows(folder / "necks.csv", tabulate_necks(course, times), NECK_COLUMNS)
    if course.cavity is not None:
        write_rows(folder / "walls.csv", tabulate_walls(course, times), WALL_COLUMNS)
    if top_times is not None:
        write_rows(folder / "top.csv", tabulate_top(course, top_times), TOP_COLUMNS)
    text = yaml.safe_dump(summarise_truth(course, times), sort_keys=False)
    write_whole(folder / "truth.yaml", text)
