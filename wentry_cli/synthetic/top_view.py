"""What the top camera sees at an instant: the sphere as a circle that recedes, the crown around it, the dome."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.outline import draw_blob
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.ring_cavity import find_contact
from wentry_cli.synthetic.splash import find_crown

Floats = NDArray[np.float64]
POINTS = 1440
RING_BEHIND, SPHERE, SHADOW, HIGHLIGHT, RING = range(5)


def _circle(radius: float, ragged: Floats | None = None) -> Floats:
    theta = np.arange(POINTS) * (2.0 * np.pi / POINTS)
    r = radius * (1.0 if ragged is None else ragged)
    return np.stack([r * np.cos(theta), r * np.sin(theta)], axis=1)


def find_magnification(course: Course, height_m: float) -> float:
    """Magnification of the plane at ``height_m`` against that of the surface; 1 without a camera distance."""
    camera = course.scene.top
    assert camera is not None
    if camera.camera_distance_m is None:
        return 1.0
    return camera.camera_distance_m / (camera.camera_distance_m - height_m)


def find_half_width(course: Course, t: float) -> float:
    """Radius of the circle that the sphere shows from above, in metres."""
    motion = course.motion
    return float(motion.stretch(t)[0]) * motion.shape.widest * motion.radius_m


def _ragged(course: Course, t: float, amount: float) -> Floats:
    rng = np.random.default_rng(course.scene.seed + 5)
    theta = np.arange(POINTS) * (2.0 * np.pi / POINTS)
    r = np.ones(POINTS)
    for k in range(3, 24):
        r += amount / np.sqrt(k) * rng.normal() * np.cos(k * theta + rng.uniform(0, 6.28) + 20.0 * t * rng.normal())
    return r


@dataclass(frozen=True)
class SplashRing:
    """The crown from above, in metres: opening, outer edge, how ragged, and whether it still lies behind the sphere."""

    opening_m: float
    outer_m: float
    ragged: float
    behind: bool


def find_splash_ring(course: Course, t: float) -> SplashRing | None:
    """The ring at ``t``; None before impact. Its opening is 0 once it has domed over."""
    if course.cavity is None or t <= 0.0:
        return None
    crown = find_crown(course, t, course.cavity.wall(t))
    if crown.rim_height_m == 0.0:
        return None
    # Until the equator has passed the surface the crown stands below the sphere's edge and is hidden by it.
    behind = float(find_contact(course.motion, course.scene.physics, np.array([t]))[0][0]) <= 0.0
    outer = max(crown.mouth_m, crown.rim_radius_m) + 0.18 * course.motion.radius_m
    ragged = 0.012 + 0.05 * course.scene.switches.ragged_crown
    return SplashRing(min(crown.mouth_m, crown.rim_radius_m), outer, ragged, behind)


def shows_circle(course: Course, t: float) -> bool:
    """Whether the top view shows the whole edge of the sphere: in the frame, clear of the ring, seen through it."""
    camera = course.scene.top
    assert camera is not None
    magnification = find_magnification(course, float(course.motion.center(t)[0]))
    radius = find_half_width(course, t) * magnification
    if radius * camera.scale_px_per_m > 0.5 * min(camera.width, camera.height) - 3.0:
        return False
    ring = find_splash_ring(course, t)
    if ring is None:
        return True
    margin = 3.0 / camera.scale_px_per_m
    if ring.behind:
        return ring.outer_m * (1.0 + 2.0 * ring.ragged) + margin < radius
    return ring.opening_m * (1.0 - 2.0 * ring.ragged) - margin > radius


def _light_from_the_front(course: Course, radius: float, middle: Floats, ring: SplashRing | None) -> list[Polygon]:
    """Wet highlights on the sphere, and the shadow that the crown throws onto it from a lamp on the left.

    In a bright view levels are inverted: a negative one is brighter than the ground of a dark view, a high one dark.
    """
    switches = course.scene.switches
    polygons = []
    if switches.crown_shadow and ring is not None and not ring.behind:
        theta = np.linspace(0.6 * np.pi, 1.4 * np.pi, 120)
        rim = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        inner = 0.995 * radius * rim * np.array([0.75, 1.0])
        polygons.append(Polygon(np.concatenate([0.995 * radius * rim, inner[::-1]]) + middle, 0.6, SHADOW))
    rng = np.random.default_rng(course.scene.seed + 31)
    for _ in range(switches.wet_highlights):
        angle, reach, size = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.1, 0.92), rng.uniform(0.01, 0.05)
        at = (reach * np.cos(angle) * radius + middle[0], reach * np.sin(angle) * radius + middle[1])
        polygons.append(Polygon(draw_blob(at, size * radius, rng, points=24), -0.25, HIGHLIGHT))
    return polygons


def draw_top_instant(course: Course, t: float) -> list[Polygon]:
    """Polygons of the top view at ``t``: the crown is a ring in front of the sphere, seen through its opening."""
    camera, scene = course.scene.top, course.scene
    assert camera is not None
    motion = course.motion
    y = float(motion.center(t)[0])
    magnification = find_magnification(course, y)
    middle_x = 0.5 * (camera.width - 1) if camera.center_x_px is None else camera.center_x_px
    middle_y = 0.5 * (camera.height - 1)
    middle = np.array([middle_x, middle_y])
    drift = np.array([scene.switches.drift_m_s * t * camera.scale_px_per_m * magnification, 0.0])
    radius = find_half_width(course, t) * camera.scale_px_per_m * magnification
    polygons = [Polygon(_circle(radius) + middle + drift, camera.lamp.dark, SPHERE)]
    ring = find_splash_ring(course, t)
    polygons += _light_from_the_front(course, radius, middle + drift, ring)
    if ring is not None:
        edge = _ragged(course, t, ring.ragged)
        outline = _circle(ring.outer_m * camera.scale_px_per_m, edge)
        if ring.opening_m * camera.scale_px_per_m > 0.5:
            hole = _circle(ring.opening_m * camera.scale_px_per_m, edge)
            outline = np.concatenate([outline, outline[:1], hole[:1], hole[::-1]])
        polygons.append(Polygon(outline + middle, 0.3, RING_BEHIND if ring.behind else RING))
    return polygons
