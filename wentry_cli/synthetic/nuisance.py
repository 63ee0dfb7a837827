"""What spoils the side view: surface band, mirror image, droplets, bubbles, jets, a second object."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.camera_view import SideGeometry
from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.outline import draw_blob, shift_outline
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.scene import Scene

Floats = NDArray[np.float64]
MIRROR, BEHIND, IN_FRONT, BAND = 5, -10, 90, 95


def draw_static(scene: Scene, view: SideGeometry) -> list[Polygon]:
    """What does not move: the surface seen edge on (or the plate), and a second object."""
    camera, switches = scene.side, scene.switches
    assert camera is not None
    polygons = []
    if scene.kind == "water_entry" and switches.surface_band_px:
        polygons.append(_draw_band(scene, view))
    if scene.kind == "surface_impact":
        y, w, h = view.surface_y_px, camera.width, camera.height
        plate = np.array([[-9.0, y], [w + 9.0, y], [w + 9.0, h + 9.0], [-9.0, h + 9.0]])
        polygons.append(Polygon(plate, 0.12, BEHIND))
    if switches.second_object:
        x, h = 0.9 * camera.width, camera.height
        bar = np.array([[x, 0.25 * h], [x + 9.0, 0.25 * h], [x + 9.0, h + 9.0], [x, h + 9.0]])
        polygons.append(Polygon(bar, 0.1, BEHIND))
    return polygons


def _draw_band(scene: Scene, view: SideGeometry) -> Polygon:
    """The free surface edge on: a dark band, uneven where the scene asks for it (meniscus on the near glass)."""
    camera, switches = scene.side, scene.switches
    assert camera is not None
    x = np.linspace(-9.0, camera.width + 9.0, 200)
    half = np.full_like(x, 0.5 * switches.surface_band_px)
    upper, lower = half.copy(), half.copy()
    if switches.surface_band_uneven:
        rng = np.random.default_rng(scene.seed + 77)
        for k in range(1, 7):
            upper += (
                half * switches.surface_band_uneven * rng.normal() / k * np.sin(k * x / 60.0 + rng.uniform(0, 6.28))
            )
            lower += (
                half * switches.surface_band_uneven * rng.normal() / k * np.sin(k * x / 45.0 + rng.uniform(0, 6.28))
            )
    y = view.surface_y_px
    top, bottom = np.column_stack([x, y - upper]), np.column_stack([x, y + lower])
    return Polygon(np.concatenate([top, bottom[::-1]]), 0.3, BAND)


def _draw_mirror_image(outline: Floats, view: SideGeometry) -> list[Polygon]:
    """The twin of what is above the surface, below it."""
    if outline[:, 1].max() <= 0.0:
        return []
    twin = np.column_stack([outline[:, 0], -np.maximum(outline[:, 1], 0.0)])
    return view.draw(twin, 0.4, MIRROR)


@dataclass(frozen=True)
class Speck:
    """A droplet or bubble: its outline about its centre, its grey level, when it appears, where, and how it moves."""

    outline: Floats
    level: float
    size_m: float
    start_s: float
    place: tuple[float, float]
    motion: tuple[float, float]


@lru_cache(maxsize=8)
def _throw_droplets(seed: int, count: int, radius_m: float, speed_m_s: float) -> tuple[Speck, ...]:
    """Droplets that the impact throws up: place is the start in metres, motion a velocity."""
    rng = np.random.default_rng(seed + 11)
    specks = []
    for _ in range(count):
        start = rng.uniform(0.0, 4.0 * radius_m / speed_m_s)
        motion = (0.25 * speed_m_s * rng.normal(), speed_m_s * rng.uniform(0.05, 0.4))
        place, size = (radius_m * rng.normal(), 0.0), radius_m * float(np.exp(rng.normal(-3.0, 0.4)))
        blob = draw_blob((0.0, 0.0), size, rng, points=24)
        specks.append(Speck(blob, float(rng.uniform(0.05, 0.4)), size, float(start), place, motion))
    return tuple(specks)


def _draw_droplets(course: Course, t: float, view: SideGeometry, count: int) -> list[Polygon]:
    """Droplets in free flight in front of the scene."""
    radius, g = course.motion.radius_m, course.scene.physics.gravity_m_s2
    polygons = []
    for speck in _throw_droplets(course.scene.seed, count, radius, course.motion.speed_m_s):
        s = t - speck.start_s
        y = speck.motion[1] * s - 0.5 * g * s * s
        if s > 0.0 and y > -0.2 * radius:
            at = shift_outline(speck.outline, speck.place[0] + speck.motion[0] * s, y)
            polygons += view.draw(at, speck.level, IN_FRONT)
    return polygons


@lru_cache(maxsize=8)
def _place_bubbles(seed: int, count: int, radius_m: float) -> tuple[Speck, ...]:
    """Bubbles: place is (share of the lower half of the outline, distance off it in their own size), motion a drift."""
    rng = np.random.default_rng(seed + 23)
    specks = []
    for _ in range(count):
        birth = rng.uniform(0.0, 0.12)
        at, drift = rng.uniform(0.0, 1.0), rng.normal(0.0, 0.02)
        size, off = radius_m * float(np.exp(rng.normal(-2.9, 0.35))), rng.uniform(-0.4, 1.0)
        blob = draw_blob((0.0, 0.0), size, rng, points=24)
        specks.append(Speck(blob, float(rng.uniform(0.1, 0.5)), size, float(birth), (at, off), (drift, 0.0)))
    return tuple(specks)


def _draw_bubbles(course: Course, t: float, outline: Floats, view: SideGeometry) -> list[Polygon]:
    """Bubbles and drops that cling to the wetted edge of the sphere for a while and hide it."""
    radius = course.motion.radius_m
    life = 6.0 * radius / course.motion.speed_m_s
    middle = outline.mean(axis=0)
    polygons = []
    for speck in _place_bubbles(course.scene.seed, course.scene.switches.bubbles, radius):
        s = (t - speck.start_s) / life
        if 0.0 < s < 1.0:
            # the outline starts at the lowest point and runs around; the lower half is the quarter on either side
            index = int((speck.place[0] - 0.5 + speck.motion[0] * s) * 0.5 * len(outline)) % len(outline)
            away = outline[index] - middle
            x, y = outline[index] + away / np.hypot(*away) * speck.place[1] * speck.size_m
            polygons += view.draw(shift_outline(speck.outline, x, y), speck.level, IN_FRONT)
    return polygons


def _draw_jet(course: Course, t: float, view: SideGeometry) -> list[Polygon]:
    """Two thin jets that shoot up and down from the pinch-off and keep its width from staying zero."""
    cavity = course.cavity
    if cavity is None or not np.isfinite(cavity.t_p_s) or t <= cavity.t_p_s:
        return []
    radius = course.motion.radius_m
    length = min(6.0 * (t - cavity.t_p_s), 2.0 * radius)
    width = 0.04 * radius
    y = cavity.y_p_m
    jet = np.array([[width, y - length], [0.4 * width, y + length], [-0.4 * width, y + length], [-width, y - length]])
    born = float(cavity.born[np.argmin(np.abs(cavity.depth + y))])
    return view.draw(shift_outline(jet, course.scene.switches.drift_m_s * born, 0.0), 0.1, IN_FRONT)


def draw_side_nuisance(course: Course, t: float, outline: Floats, view: SideGeometry) -> list[Polygon]:
    """Everything in front of or beside the sphere that the scene switches on, at ``t`` seconds after impact."""
    switches = course.scene.switches
    polygons: list[Polygon] = []
    if switches.mirror_image:
        polygons += _draw_mirror_image(outline, view)
    if t > 0.0 and switches.droplets:
        polygons += _draw_droplets(course, t, view, switches.droplets)
    if t > 0.0 and switches.bubbles:
        polygons += _draw_bubbles(course, t, outline, view)
    if switches.jets:
        polygons += _draw_jet(course, t, view)
    return polygons
