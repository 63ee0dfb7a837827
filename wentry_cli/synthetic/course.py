"""The course of a drop: where the sphere is at any time, whatever the scene; one object for renderer and truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.entry_dynamics import Motion, solve_entry
from wentry_cli.synthetic.outline import describe_shape
from wentry_cli.synthetic.ring_cavity import Cavity, Suction, build_cavity
from wentry_cli.synthetic.scene import Scene
from wentry_cli.synthetic.stretch_dynamics import solve_oscillation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """Motion of the sphere (times after impact, or after the first frame of a free flight) and its cavity."""

    scene: Scene
    motion: Motion
    cavity: Cavity | None
    dome_over_s: float
    start_s: float
    end_s: float

    def times(self, fps: float, empty_frames: int = 0) -> Floats:
        """Mid-exposure times of the frames at ``fps``, with ``empty_frames`` before the clip proper."""
        n = int(np.floor((self.end_s - self.start_s) * fps)) + 1
        return np.asarray(self.start_s + np.arange(-empty_frames, n) / fps)


def _solve_flight(scene: Scene, end_s: float) -> Motion:
    """A sphere in free flight, height 0 at the first frame."""
    g, u = scene.physics.gravity_m_s2, scene.impact_speed_m_s or 0.0

    def state(t: Floats) -> Floats:
        return np.stack([-u * t - 0.5 * g * t * t, -u - g * t])

    def stretch_at(t: Floats) -> tuple[Floats, Floats]:
        return np.ones_like(t), np.zeros_like(t)

    return Motion(0.5 * scene.sphere.diameter_m, u, g, state, lambda t: np.full_like(t, -g), stretch_at, end_s)


def _solve_plate(scene: Scene, end_s: float) -> Motion:
    """A sphere that lands on a rigid plate, stays in contact while it pushes, and leaves when it pulls.

    In contact the lowest point rests on the plate (y_c = R/stretch^2 for an ellipsoid), sunk by
    ``physics.contact_patch`` R (1 - 1/stretch^2)^2 where the plate flattens it. It leaves when that would need an
    acceleration below -g, and flies freely while it goes on oscillating.
    """
    radius, u, g = 0.5 * scene.sphere.diameter_m, scene.speed_m_s, scene.physics.gravity_m_s2
    physics = scene.physics.model_copy(update={"loading_rate": 0.5, "loading_time": 0.02, "period_factor": 1.0})
    swing = solve_oscillation(scene.sphere.law, radius, scene.sphere.density_kg_m3, u, physics, end_s=end_s)
    grid = np.linspace(0.0, end_s, 40001)
    stretch, rate = swing.at(grid)
    shape = describe_shape(scene.switches.tilt_deg, scene.switches.misfit)
    pressed = np.maximum(1.0 - stretch**-2, 0.0)
    height = radius * (shape.lowest(stretch) - physics.contact_patch * pressed**2)
    slope = shape.lowest_slope(stretch) - 4.0 * physics.contact_patch * pressed / stretch**3
    velocity = radius * slope * rate
    pull = np.gradient(velocity, grid)
    leaving = np.flatnonzero((pull < -g) & (grid > 2.0 * 0.02 * radius / u) & (velocity > 0.0))
    leave = int(leaving[0]) if leaving.size else grid.size - 1
    s = grid[leave:] - grid[leave]
    height[leave:] = height[leave] + velocity[leave] * s - 0.5 * g * s * s
    velocity[leave:] = velocity[leave] - g * s
    pull[leave:] = -g

    def state(t: Floats) -> Floats:
        return np.stack([np.interp(t, grid, height), np.interp(t, grid, velocity)])

    def stretch_at(t: Floats) -> tuple[Floats, Floats]:
        return swing.at(t)

    return Motion(radius, u, g, state, lambda t: np.interp(t, grid, pull), stretch_at, end_s, shape)


def plan_course(scene: Scene, phase: float) -> Course:
    """Solve the physics of ``scene`` and set the ends of its clip.

    ``phase`` in [0, 1) puts the impact between two frames of the side view (of the top view where there is no other).
    """
    clip = scene.clip
    camera = scene.side or scene.top
    assert camera is not None
    if scene.kind == "free_flight":
        return Course(scene, _solve_flight(scene, clip.longest_s), None, np.inf, 0.0, clip.longest_s)
    start = -(np.ceil(clip.before_s * camera.fps) + phase) / camera.fps
    longest = start + clip.longest_s
    if scene.kind == "surface_impact":
        return Course(scene, _solve_plate(scene, longest), None, np.inf, start, longest)
    motion = solve_entry(scene, end_s=max(longest, 0.05) * 1.5)
    dome = scene.physics.dome_over_time * scene.sphere.diameter_m / scene.speed_m_s
    pull = scene.physics.dome_suction * scene.speed_m_s**2
    cavity = build_cavity(motion, scene.physics, Suction(pull, dome, 0.25 * scene.sphere.diameter_m))
    end = min(longest, cavity.t_p_s + clip.after_pinch_off_s) if np.isfinite(cavity.t_p_s) else longest
    return Course(scene, motion, cavity, dome, float(start), float(end))
