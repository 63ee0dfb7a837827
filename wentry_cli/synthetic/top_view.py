"""What the top camera sees at an instant: the sphere as a circle that recedes, the crown around it, the dome."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.ring_cavity import find_contact
from wentry_cli.synthetic.splash import find_crown

Floats = NDArray[np.float64]
POINTS = 1440


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


def _ragged(course: Course, t: float, amount: float) -> Floats:
    rng = np.random.default_rng(course.scene.seed + 5)
    theta = np.arange(POINTS) * (2.0 * np.pi / POINTS)
    r = np.ones(POINTS)
    for k in range(3, 24):
        r += amount / np.sqrt(k) * rng.normal() * np.cos(k * theta + rng.uniform(0, 6.28) + 20.0 * t * rng.normal())
    return r


def _draw_crown(course: Course, t: float, scale: float) -> list[Floats | None]:
    """Outer edge of the crown and its opening (None once it has domed over)."""
    wall = course.cavity.wall(t) if course.cavity is not None else np.empty(0)
    crown = find_crown(course, t, wall)
    if crown.rim_height_m == 0.0:
        return []
    amount = 0.012 + 0.05 * course.scene.switches.ragged_crown
    ragged = _ragged(course, t, amount)
    outer = max(crown.mouth_m, crown.rim_radius_m) + 0.18 * course.motion.radius_m
    opening = min(crown.mouth_m, crown.rim_radius_m)
    opening = max(opening, 0.0) if crown.rim_radius_m > crown.mouth_m else crown.rim_radius_m
    shapes: list[Floats | None] = [_circle(outer * scale, ragged)]
    shapes.append(_circle(opening * scale, ragged) if opening * scale > 0.5 else None)
    return shapes


def find_opening(course: Course, t: float) -> float:
    """Radius of the hole in the crown through which the camera sees the sphere, m; inf where there is no crown."""
    if course.cavity is None or t <= 0.0:
        return float("inf")
    if float(find_contact(course.motion, course.scene.physics, np.array([t]))[0][0]) <= 0.0:
        return float("inf")
    crown = find_crown(course, t, course.cavity.wall(t))
    if crown.rim_height_m == 0.0:
        return float("inf") if t < course.dome_over_s else 0.0
    return min(crown.mouth_m, crown.rim_radius_m)


def draw_top_instant(course: Course, t: float) -> list[Polygon]:
    """Polygons of the top view at ``t``: the crown is a ring in front of the sphere, seen through its opening."""
    camera, scene = course.scene.top, course.scene
    assert camera is not None
    motion = course.motion
    y, stretch = float(motion.center(t)[0]), float(motion.stretch(t)[0])
    magnification = find_magnification(course, y)
    middle_x = 0.5 * (camera.width - 1) if camera.center_x_px is None else camera.center_x_px
    middle_y = 0.5 * (camera.height - 1)
    middle = np.array([middle_x, middle_y])
    drift = np.array([scene.switches.drift_m_s * t * camera.scale_px_per_m * magnification, 0.0])
    radius = stretch * motion.radius_m * camera.scale_px_per_m * magnification
    polygons = [Polygon(_circle(radius) + middle + drift, camera.lamp.dark, 1)]
    shapes = _draw_crown(course, t, camera.scale_px_per_m) if t > 0.0 else []
    if shapes:
        outer, opening = shapes
        assert outer is not None
        ring = outer if opening is None else np.concatenate([outer, outer[:1], opening[:1], opening[::-1]])
        # Until the equator has passed the surface the crown stands below the sphere's edge and is hidden by it.
        behind = float(find_contact(motion, scene.physics, np.array([t]))[0][0]) <= 0.0
        polygons.append(Polygon(ring + middle, 0.3, 0 if behind else 2))
    return polygons
