"""The splash crown: its mouth, rim and dome-over, and the shapes that it has in both views."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.ring_cavity import find_contact

Floats = NDArray[np.float64]
JET_ROOT = 1.13


@dataclass(frozen=True)
class Crown:
    """Radius of the crown at the surface, height and radius of its rim, in metres; height 0 when there is none."""

    mouth_m: float
    rim_height_m: float
    rim_radius_m: float


def find_crown(course: Course, t: float, wall: Floats) -> Crown:
    """The crown at time ``t`` (s after impact), over the cavity ``wall`` of that time.

    The rim is thrown up at a share of the impact speed and slowed by the air and by gravity; it leans outward until
    the air that rushes into the cavity draws it together: it meets on the axis at ``course.dome_over_s``.
    """
    if course.cavity is None or t <= 0.0:
        return Crown(0.0, 0.0, 0.0)
    physics, speed = course.scene.physics, course.motion.speed_m_s
    diameter = course.scene.sphere.diameter_m
    slowing = 2.0 * diameter / speed
    height = physics.crown_speed * speed * slowing * (1.0 - np.exp(-t / slowing)) - 0.25 * physics.gravity_m_s2 * t * t
    height = max(float(height), 0.2 * diameter if t > course.dome_over_s else 0.0)
    known = wall[np.isfinite(wall)]
    mouth = float(known[: max(1, known.size // 50)].max()) if known.size else 0.0
    # The root of the jet stands off the sphere: the water piles up outside the widest contact there has been.
    depth, radius = find_contact(course.motion, physics, np.linspace(0.0, t, 64))
    mouth = max(mouth, JET_ROOT * float(radius[depth < 0.6 * course.motion.radius_m].max(initial=0.0)))
    share = min(t / course.dome_over_s, 1.0)
    rim = (mouth + physics.crown_lean * height) * max(1.0 - share**4, 0.0)
    return Crown(mouth, height, rim)


def find_dome_height(course: Course) -> float:
    """Height of the crown's rim when it meets on the axis; NaN where it does not within the clip."""
    if course.cavity is None or not course.dome_over_s <= course.end_s:
        return float("nan")
    return find_crown(course, course.dome_over_s, course.cavity.wall(course.dome_over_s)).rim_height_m


def draw_crown_profile(crown: Crown, ragged: float, seed: int) -> Floats:
    """Half profile of the crown's film from its base to its rim, (radius, height) in metres, shape (n, 2)."""
    share = np.linspace(0.0, 1.0, 25)
    radius = crown.mouth_m + (crown.rim_radius_m - crown.mouth_m) * share**2
    height = crown.rim_height_m * share
    if ragged:
        rng = np.random.default_rng(seed)
        wave = sum(rng.normal() / k * np.sin(k * 5.0 * share + rng.uniform(0, 6.28)) for k in range(1, 5))
        radius = radius * (1.0 + 0.08 * ragged * wave * share)
    return np.stack([radius, height], axis=1)


def draw_rim_jets(crown: Crown, ragged: float, seed: int, jets: int = 17) -> Floats:
    """Jets that rise from the rim and sheets that hang at the contact line: a closed ragged outline in metres."""
    rng = np.random.default_rng(seed + 3)
    across = np.sort(rng.uniform(-1.0, 1.0, jets))
    reach = ragged * crown.rim_height_m * rng.uniform(0.05, 0.7, jets)
    width = 0.5 * rng.uniform(0.02, 0.08, jets) * max(crown.rim_radius_m, 0.2 * crown.mouth_m)
    points = [np.array([[-crown.rim_radius_m, crown.rim_height_m]])]
    for a, r, w in zip(across, reach, width, strict=True):
        x, h = a * crown.rim_radius_m, crown.rim_height_m
        points.append(np.array([[x - w, h], [x * 1.1 - 0.3 * w, h + r], [x * 1.1 + 0.3 * w, h + r], [x + w, h]]))
    points.append(np.array([[crown.rim_radius_m, crown.rim_height_m]]))
    foot = np.linspace(0.9 * crown.mouth_m, -0.9 * crown.mouth_m, 2 * jets)
    hang = -ragged * 0.2 * crown.rim_height_m * rng.uniform(0.0, 1.0, 2 * jets)
    points.append(np.column_stack([foot, hang]))
    return np.concatenate(points)
