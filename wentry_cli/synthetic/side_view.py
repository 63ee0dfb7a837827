"""What the side camera sees at an instant, as polygons: sphere, cavity with its bright core, crown, surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.camera_view import SideGeometry, place_side
from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.nuisance import draw_side_nuisance, draw_static
from wentry_cli.synthetic.outline import draw_sphere_outline, shift_outline
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.ring_cavity import STEPS_PER_RADIUS, find_contact
from wentry_cli.synthetic.splash import draw_crown_profile, draw_rim_jets, find_crown

Floats = NDArray[np.float64]
CROWN, WALL, CORE, FILM, SPHERE, SPHERE_CORE, FRONT = 1, 2, 3, 4, 6, 7, 8
CORE_STEPS = 5


@dataclass(frozen=True)
class Instant:
    """The sphere and the cavity wall at one time, in metres, heights above the surface."""

    t: float
    x_m: float
    y_c_m: float
    stretch: float
    outline: Floats
    depth: Floats
    wall: Floats
    wall_x_m: Floats


@lru_cache(maxsize=16)
def find_core_share(lamp_half_angle_deg: float, refractive_index: float = 1.333) -> float:
    """Share of the cavity's half-width through which the lamp shines.

    A ray that crosses an air cylinder in water at a share b of its radius is bent by 2 (asin(n b) - asin(b)); it
    comes from the lamp while that is less than the lamp's half-angle, and is totally reflected for b > 1/n.
    """
    b = np.linspace(0.0, 1.0 / refractive_index, 2001)
    bent = 2.0 * np.degrees(np.arcsin(np.minimum(refractive_index * b, 1.0)) - np.arcsin(b))
    return float(b[np.searchsorted(bent, lamp_half_angle_deg) - 1])


def see_instant(course: Course, t: float) -> Instant:
    """The scene at ``t`` seconds after impact."""
    scene, motion = course.scene, course.motion
    y = float(motion.center(t)[0])
    stretch = float(motion.stretch(t)[0])
    switches = scene.switches
    outline = draw_sphere_outline(motion.radius_m, stretch, tilt_deg=switches.tilt_deg, misfit=switches.misfit)
    x = switches.drift_m_s * t
    outline = np.column_stack([outline[:, 0] + x, y - outline[:, 1]])
    if scene.kind == "surface_impact":
        outline[:, 1] = np.maximum(outline[:, 1], 0.0)  # the plate flattens what would lie below it
    if course.cavity is None or t <= 0.0:
        return Instant(t, x, y, stretch, outline, np.empty(0), np.empty(0), np.empty(0))
    wall = course.cavity.wall(t)
    born = np.isfinite(wall)
    depth, wall = course.cavity.depth[born], wall[born]
    wall_x = switches.drift_m_s * course.cavity.born[born]
    contact, radius = find_contact(motion, scene.physics, np.array([t]))
    if depth.size and depth[-1] < contact[0] < depth[-1] + 1.5 * motion.radius_m / STEPS_PER_RADIUS:
        # the ring that is being laid, between two depths of the grid
        depth, wall = np.append(depth, contact), np.append(wall, radius)
        wall_x = np.append(wall_x, x)
    return Instant(t, x, y, stretch, outline, depth, wall, wall_x)


def _mirror(half: Floats, x: Floats | float) -> Floats:
    """Closed outline from a half profile (radius, height) about an axis at ``x``, a number or one for each height."""
    right = np.column_stack([x + half[:, 0], half[:, 1]])
    left = np.column_stack([x - half[:, 0], half[:, 1]])
    return np.concatenate([right, left[::-1]])


def _draw_cavity(course: Course, now: Instant, view: SideGeometry) -> list[Polygon]:
    if now.depth.size < 2:
        return []
    camera = course.scene.side
    assert camera is not None
    lamp = camera.lamp
    half = np.column_stack([now.wall, -now.depth])
    mouth = np.array([[now.wall[0], 0.0]])
    axis = np.concatenate([now.wall_x_m[:1], now.wall_x_m])
    polygons = view.draw(_mirror(np.concatenate([mouth, half]), axis), lamp.dark, WALL)
    slope = np.gradient(now.wall, now.depth) if now.depth.size > 3 else np.zeros_like(now.wall)
    share = find_core_share(lamp.lamp_half_angle_deg) / np.sqrt(1.0 + slope**2)
    inside = now.depth > 0.05 * course.motion.radius_m
    core = np.maximum(share * now.wall - 1.5 / view.scale_px_per_m, 0.0)[inside]
    for k in range(CORE_STEPS):
        width = core * (1.0 - 0.5 * (k / CORE_STEPS) ** 2)
        level = lamp.dark + (0.8 - lamp.dark) * (k + 1) / CORE_STEPS
        body = _mirror(np.column_stack([width, -now.depth[inside]]), now.wall_x_m[inside])
        polygons += view.draw(body, level, CORE * 10 + k) if len(body) > 3 else []
    if course.scene.switches.lamp_image:
        polygons += _draw_lamp_image(now, core, now.depth[inside], view)
    return polygons + _draw_films(course, now, view)


def _draw_lamp_image(now: Instant, core: Floats, depth: Floats, view: SideGeometry) -> list[Polygon]:
    """The inverted image of the lamp: dark bands bite into the bright core and draw necks that are none."""
    if depth.size < 20:
        return []
    polygons: list[Polygon] = []
    for share in (0.45, 0.75):
        k = int(share * depth.size)
        angle = np.linspace(0.0, 2.0 * np.pi, 60)
        tall = 0.35 * float(core[k]) + 1e-9
        for side in (1.0, -1.0):
            x = now.wall_x_m[k] + side * core[k] * (1.0 + 0.3 * np.cos(angle))
            polygons += view.draw(np.column_stack([x, -depth[k] + tall * np.sin(angle)]), 0.08, FILM * 10 - 1)
    return polygons


def find_film(course: Course, now: Instant, start: tuple[float, float]) -> Floats:
    """Rim of a later cavity inside the earlier one: its half profile (radius, height), empty where there is none.

    The second expansion throws up a film from the depth where it starts, as the first impact does from the surface;
    it leans inward, so that it is seen as a second dark wall in the bright core.
    """
    s = now.t - start[0]
    if s <= 0.0 or now.depth.size < 4 or course.cavity is None:
        return np.empty((0, 2))
    rise = min(0.25 * course.motion.speed_m_s * s, 0.7 * course.motion.radius_m)
    at = (now.depth > start[1] - rise) & (now.depth <= start[1])
    if at.sum() < 4:
        return np.empty((0, 2))
    base = float(now.wall[at][-1])
    climb = (start[1] - now.depth[at]) / (0.7 * course.motion.radius_m)
    radius = np.minimum(base * (1.0 - 0.5 * climb**0.35), 0.9 * now.wall[at])
    return np.column_stack([radius, -now.depth[at]])


def _draw_films(course: Course, now: Instant, view: SideGeometry) -> list[Polygon]:
    polygons: list[Polygon] = []
    if course.cavity is None:
        return polygons
    thick = 0.08 * course.motion.radius_m
    for start in course.cavity.starts[:1]:
        film = find_film(course, now, start)
        if len(film):
            inner = np.column_stack([np.maximum(film[:, 0] - thick, 0.0), film[:, 1]])
            ring = np.concatenate([film, inner[::-1]])
            for side in (1.0, -1.0):
                x = course.scene.switches.drift_m_s * start[0]
                polygons += view.draw(shift_outline(ring * (side, 1.0), x, 0.0), 0.15, FILM * 10)
    return polygons


def _draw_crown(course: Course, now: Instant, view: SideGeometry) -> list[Polygon]:
    crown = find_crown(course, now.t, now.wall)
    if crown.rim_height_m * view.scale_px_per_m < 1.0:
        return []
    switches = course.scene.switches
    profile = draw_crown_profile(crown, switches.ragged_crown, course.scene.seed)
    front = FRONT * 10 if switches.opaque_crown else CROWN * 10
    body_level = 0.1 if switches.opaque_crown else 0.5
    polygons = [Polygon(view.to_air(_mirror(profile, 0.0)), body_level, front)]
    thick = 0.10 * course.motion.radius_m
    inner = np.column_stack([np.maximum(profile[:, 0] - thick, 0.0), profile[:, 1]])
    ring = np.concatenate([profile, inner[::-1]])
    for side in (1.0, -1.0):
        polygons.append(Polygon(view.to_air(ring * (side, 1.0)), 0.12, front + 1))
    if switches.ragged_crown:
        jets = draw_rim_jets(crown, switches.ragged_crown, course.scene.seed)
        polygons.append(Polygon(view.to_air(jets), body_level, front))
    return polygons


def draw_side_instant(course: Course, t: float) -> list[Polygon]:
    """Polygons of the side view at ``t``, static ones included."""
    view = place_side(course.scene)
    camera = course.scene.side
    assert camera is not None
    now = see_instant(course, t)
    dark = camera.lamp.dark
    level = 0.25 if course.scene.switches.translucent_sphere else dark
    polygons = draw_static(course.scene, view)
    if course.cavity is not None:
        polygons += _draw_crown(course, now, view) + _draw_cavity(course, now, view)
    polygons += view.draw(now.outline, level, SPHERE * 10)
    if course.scene.switches.translucent_sphere:
        middle = np.array([now.x_m, now.y_c_m])
        polygons += view.draw(middle + 0.45 * (now.outline - middle), 0.6, SPHERE_CORE * 10)
    return polygons + draw_side_nuisance(course, now.t, now.outline, view)
