"""Motion of the centre: free fall, slam, drag, weight, buoyancy and added mass, together with the slowed clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wentry_cli.synthetic.outline import Shape, describe_shape
from wentry_cli.synthetic.scene import Scene
from wentry_cli.synthetic.stretch_dynamics import Oscillation, solve_oscillation, tabulate_solution

Floats = NDArray[np.float64]
ELLIPSOID = Shape(1.0, None)


@dataclass(frozen=True)
class Motion:
    """Everything about the sphere against time after first contact (s), heights in metres above the surface.

    At time 0 the lowest point of ``shape`` is at height 0, whatever the shape.
    """

    radius_m: float
    speed_m_s: float
    gravity_m_s2: float
    state: Callable[[Floats], Floats]
    acceleration: Callable[[Floats], Floats]
    stretch_at: Callable[[Floats], tuple[Floats, Floats]]
    end_s: float
    shape: Shape = ELLIPSOID

    def center(self, t: Floats | float) -> tuple[Floats, Floats, Floats]:
        """Height, velocity and acceleration of the centre."""
        t = np.asarray(t, float)
        g, u = self.gravity_m_s2, self.speed_m_s
        before = t < 0.0
        state = self.state(np.clip(t, 0.0, self.end_s).ravel()).reshape((-1, *t.shape))
        first = self.radius_m * float(self.shape.lowest(1.0))
        y = np.where(before, first - u * t - 0.5 * g * t * t, state[0])
        v = np.where(before, -u - g * t, state[1])
        a = np.where(before, -g, self.acceleration(np.clip(t, 0.0, self.end_s).ravel()).reshape(t.shape))
        return y, v, a

    def stretch(self, t: Floats | float) -> tuple[Floats, Floats]:
        """Stretch and its rate."""
        return self.stretch_at(np.asarray(t, float))

    def bottom(self, t: Floats | float) -> Floats:
        """Height of the lowest point."""
        return np.asarray(self.center(t)[0] - self.radius_m * self.shape.lowest(self.stretch(t)[0]))


def _wetted_share(depth: Floats) -> tuple[Floats, Floats]:
    """Growth of the added mass with the wetted depth (in radii) and its derivative: h^1.5 at first, then full."""
    root = np.sqrt(np.maximum(depth, 0.0))
    rest = np.exp(-2.0 * root**3)
    return 1.0 - rest, 3.0 * root * rest


def _clock(scene: Scene, y: Floats) -> Floats:
    """Rate of the material's time against that of the laboratory at the height ``y``."""
    physics = scene.physics
    growth = physics.period_growth * np.maximum(-y, 0.0) / (10.0 * scene.sphere.diameter_m)
    return np.asarray(1.0 / (physics.period_factor * (1.0 + growth)))


def _force_balance(scene: Scene, oscillation: Oscillation, shape: Shape) -> Callable[[Floats], Floats]:
    """Acceleration of the centre from its state (height, velocity, material time), for one state or many."""
    physics, ball = scene.physics, scene.sphere
    radius = 0.5 * ball.diameter_m
    volume = 4.0 / 3.0 * np.pi * radius**3
    mass = ball.density_kg_m3 * volume
    water, g = physics.water_kg_m3, physics.gravity_m_s2

    def acceleration(state: Floats) -> Floats:
        y, v, tau = state
        stretch, rate = oscillation.at(tau)
        rate = rate * _clock(scene, y)
        bottom = y - radius * shape.lowest(stretch)
        bottom_rate = v - radius * shape.lowest_slope(stretch) * rate
        share, share_slope = _wetted_share(-bottom / radius)
        added = physics.added_mass * water * volume * stretch**3
        growth = added * (share_slope * -bottom_rate / radius + 3.0 * share * rate / stretch)
        slam = np.maximum(growth, 0.0) * np.maximum(-v, 0.0)
        area = np.pi * (stretch * radius) ** 2
        drag = -0.5 * water * physics.drag * stretch**physics.drag_stretch_exponent * area * share * v * np.abs(v)
        depth = np.clip(-bottom * stretch**2 / (2.0 * radius), 0.0, 1.0)
        buoyancy = water * volume * g * depth**2 * (3.0 - 2.0 * depth)
        return np.asarray((-mass * g + buoyancy + drag + slam) / (mass + added * share))

    return acceleration


def solve_entry(scene: Scene, *, end_s: float) -> Motion:
    """Solve the entry of the sphere of ``scene`` for ``end_s`` seconds after first contact.

    Drag acts on the area of the stretched sphere, pi (stretch R)^2, and grows with the wetted share; the added mass
    of the wetted part grows with depth and with the cube of the stretch, its growth is the slam.
    """
    radius = 0.5 * scene.sphere.diameter_m
    speed, physics = scene.speed_m_s, scene.physics
    oscillation = solve_oscillation(
        scene.sphere.law, radius, scene.sphere.density_kg_m3, speed, physics, end_s=1.2 * end_s + 1e-3
    )
    shape = describe_shape(scene.switches.tilt_deg, scene.switches.misfit)
    balance = _force_balance(scene, oscillation, shape)

    def derivative(_: float, state: Floats) -> list[float]:
        return [float(state[1]), float(balance(state)), float(_clock(scene, state[0]))]

    step = 0.02 * radius / speed
    solution = solve_ivp(
        derivative, (0.0, end_s), [radius * float(shape.lowest(1.0)), -speed, 0.0], "DOP853",
        rtol=1e-8, atol=1e-10, dense_output=True, first_step=step / 100, max_step=20 * step,
    )  # fmt: skip
    if not solution.success:
        raise RuntimeError(f"the entry could not be integrated: {solution.message}")

    states = tabulate_solution(solution.t, solution.sol)

    def stretch_at(t: Floats) -> tuple[Floats, Floats]:
        state = states(np.clip(t, 0.0, end_s).ravel()).reshape((3, *t.shape))
        stretch, rate = oscillation.at(np.where(t > 0.0, state[2], 0.0))
        return stretch, rate * _clock(scene, state[0])

    def acceleration(t: Floats) -> Floats:
        return np.asarray(balance(states(t)))

    return Motion(radius, speed, physics.gravity_m_s2, states, acceleration, stretch_at, end_s, shape)
