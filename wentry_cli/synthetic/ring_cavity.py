"""A cavity of independent rings, and what emerges from it: necks, pinch-off, its depth, its cavity and its seal.

Where the contact line passes a depth z it leaves a ring of the radius r0 that the sphere has there. The ring moves
outward with a speed w, a share of the speed of the sphere plus a share of the speed at which the sphere widens, and
falls back under the hydrostatic pressure: R^2 = r0^2 + 2 r0 w s - g z s^2, s since its birth. Where the wall would lie
inside the sphere it wets it, so the contact line recedes upward by itself. From the dome-over on, the air under the
dome may pull at the rings near the surface: another - q exp(-4 z / D) (t - t_dome)^2, q the missing pressure over rho.
Where that closes the uppermost rings first, the cavity pulls away from the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.entry_dynamics import Motion
from wentry_cli.synthetic.scene import Physics

Floats = NDArray[np.float64]
STEPS_PER_RADIUS = 100
WETTING_HEIGHT = 0.25


@dataclass(frozen=True)
class Suction:
    """Missing pressure over density under the dome (m2/s2), from ``start_s`` on; it falls off over ``reach_m``."""

    pull_m2_s2: float = 0.0
    start_s: float = float("inf")
    reach_m: float = 1.0

    def at(self, depth: Floats) -> Floats:
        """The pull at ``depth``."""
        return np.asarray(self.pull_m2_s2 * np.exp(-depth / self.reach_m))


NO_SUCTION = Suction()


@dataclass(frozen=True)
class Cavity:
    """Rings on a grid of depths (m, down): birth time, radius and outward speed at birth, and number of the cavity.

    ``second_starts`` are the times at which the second, third … expansion starts and the depths of the contact line
    then. Seal: time, height (negative), cavity number and type; NaN, NaN, 0 and ``none`` where nothing closed.
    """

    depth: Floats
    born: Floats
    radius: Floats
    speed: Floats
    number: NDArray[np.int64]
    gravity_m_s2: float
    starts: tuple[tuple[float, float], ...]
    t_p_s: float
    y_p_m: float
    pinch_off_cavity: int
    seal_type: str
    suction: Suction = NO_SUCTION

    def wall(self, t: float) -> Floats:
        """Radius of every ring at time ``t``: NaN where not yet born, 0 where closed."""
        s = t - self.born
        square = self.radius**2 + 2.0 * self.radius * self.speed * s - self.gravity_m_s2 * self.depth * s * s
        square = (
            square - self.suction.at(self.depth) * np.maximum(t - np.maximum(self.born, self.suction.start_s), 0.0) ** 2
        )
        closed = t >= self.closes()
        return np.where(s < 0.0, np.nan, np.where(closed, 0.0, np.sqrt(np.maximum(square, 0.0))))

    def closes(self) -> Floats:
        """Time at which every ring closes."""
        return _closing_times((self.depth, self.born, self.radius, self.speed), self.gravity_m_s2, self.suction)


def _closing_times(rings: tuple[Floats, Floats, Floats, Floats], gravity: float, suction: Suction) -> Floats:
    """Greater root of the radius squared; with the suction where that starts before the ring has closed without."""
    depth, born, radius, speed = rings
    pull = gravity * np.maximum(depth, 1e-9)
    closes = born + radius * (speed + np.sqrt(speed**2 + pull)) / pull
    if not suction.pull_m2_s2:
        return np.asarray(closes)
    extra, wait = suction.at(depth), np.maximum(suction.start_s - born, 0.0)
    linear, rest = radius * speed + extra * wait, radius**2 - extra * wait**2
    total = pull + extra
    sooner = born + (linear + np.sqrt(np.maximum(linear**2 + total * rest, 0.0))) / total
    return np.asarray(np.where(born + wait < closes, sooner, closes))


def find_contact(motion: Motion, physics: Physics, t: Floats) -> tuple[Floats, Floats]:
    """Depth and radius of the contact line before any recession: ``contact_angle_deg`` above the equator.

    While the sphere is less deep than that, the contact line lies in the undisturbed surface.
    """
    y, _, _ = motion.center(t)
    stretch, _ = motion.stretch(t)
    along, across = motion.radius_m / stretch**2, stretch * motion.radius_m
    phi = np.radians(physics.contact_angle_deg)
    height = np.minimum(y + along * np.sin(phi), 0.0)
    relative = np.clip((height - y) / along, -1.0, 1.0)
    return -height, across * motion.shape.half_width(relative)


def find_expansions(motion: Motion) -> Floats:
    """Times at which the stretch crosses 1 upward after the first valley: each starts a new cavity."""
    t = np.linspace(0.0, motion.end_s, 8001)
    stretch, _ = motion.stretch(t)
    up = np.flatnonzero((stretch[:-1] < 1.0) & (stretch[1:] >= 1.0) & (t[1:] > 1e-4))
    share = (1.0 - stretch[up]) / (stretch[up + 1] - stretch[up])
    return np.asarray(t[up] + share * (t[up + 1] - t[up]))


def _first_passage(depth: Floats, t: Floats, grid: Floats) -> Floats:
    """Index (fractional) at which the running maximum of ``depth`` first reaches each grid depth."""
    deepest = np.maximum.accumulate(depth) + 1e-12 * np.arange(depth.size)
    return np.interp(grid, deepest, t)


def _free_times(depth: Floats, closes: Floats, t: Floats, top: Floats) -> Floats:
    """Time from which every ring is closed and no longer covered by the sphere, whose top is at the depth ``top``.

    A ring that closes on the sphere seals nothing before the sphere has sunk out of it. Infinite where never.
    """
    free = np.where(np.interp(closes, t, top) >= depth, closes, np.inf)
    free[closes > t[-1]] = np.inf
    for k in np.flatnonzero((closes <= t[-1]) & ~np.isfinite(free)):
        later = np.flatnonzero((t > closes[k]) & (top >= depth[k]))
        if later.size:
            i = int(later[0])
            share = (depth[k] - top[i - 1]) / (top[i] - top[i - 1]) if top[i] > top[i - 1] else 1.0
            free[k] = max(float(closes[k]), float(t[i - 1] + share * (t[i] - t[i - 1])))
    return free


def _find_seal(motion: Motion, depth: Floats, closes: Floats) -> tuple[float, float, str]:
    """First ring that is closed above the sphere: time, depth, type; at the uppermost ring it is a surface seal.

    Time and depth are those of the ring, not of a curve through its neighbours: above a ledge these close milliseconds
    later, and the frames are drawn ring by ring. It is a sphere seal where the ring had closed on the sphere, or closes
    within a tenth of a radius above it.
    """
    t = np.linspace(0.0, motion.end_s, 20001)
    top = -(motion.center(t)[0] + motion.radius_m / motion.stretch(t)[0] ** 2)
    free = _free_times(depth, closes, t, top)
    first = int(np.argmin(free))
    if not np.isfinite(free[first]):
        return float("nan"), float("nan"), "none"
    z, time = float(depth[first]), float(free[first])
    if first == 0:
        return time, 0.0, "surface_seal"
    near_top = z > float(np.interp(time, t, top)) - 0.1 * motion.radius_m
    return time, z, "sphere_seal" if near_top or time > closes[first] else "deep_seal"


def _count_dry_rings(motion: Motion, cavity_rings: tuple[Floats, Floats, Floats, Floats], gravity: float) -> int:
    """Number of rings laid before the wall has run up the sphere: a wetted shoulder draws no new cavity.

    Looks at the ring WETTING_HEIGHT radii above each new one, at the time of its birth: if that wall lies inside the
    sphere, water has closed over the contact line.
    """
    depth, born, radius, speed = cavity_rings
    above = round(WETTING_HEIGHT * STEPS_PER_RADIUS)
    new, old = np.arange(above, depth.size), np.arange(0, depth.size - above)
    s = born[new] - born[old]
    wall = radius[old] ** 2 + 2.0 * radius[old] * speed[old] * s - gravity * depth[old] * s * s
    stretch, _ = motion.stretch(born[new])
    relative = (-depth[old] - motion.center(born[new])[0]) * stretch**2 / motion.radius_m
    sphere = np.maximum(1.0 - relative**2, 0.0) * (stretch * motion.radius_m) ** 2
    wetted = np.flatnonzero((np.abs(relative) < 1.0) & (wall < sphere))
    return int(new[wetted[0]]) if wetted.size else depth.size


def build_cavity(motion: Motion, physics: Physics, suction: Suction = NO_SUCTION) -> Cavity:
    """Rings left by the sphere of ``motion`` and the seal that emerges from them."""
    t = np.linspace(0.0, motion.end_s, 20001)
    contact, radius = find_contact(motion, physics, t)
    step = motion.radius_m / STEPS_PER_RADIUS
    grid = np.arange(step, max(float(contact.max()), 2.5 * step), step)
    born = _first_passage(contact, t, grid)
    r0 = np.interp(born, t, radius)
    _, velocity, _ = motion.center(born)
    _, rate = motion.stretch(born)
    widening = np.maximum(rate, 0.0) * motion.radius_m
    speed = physics.wall_speed * np.maximum(-velocity, 0.0) + physics.wall_stretch_speed * widening
    dry = _count_dry_rings(motion, (grid, born, r0, speed), physics.gravity_m_s2)
    grid, born, r0, speed = grid[:dry], born[:dry], r0[:dry], speed[:dry]
    expansions = find_expansions(motion)
    number = 1 + np.searchsorted(expansions, born)
    starts = tuple((float(s), float(np.interp(s, t, np.maximum.accumulate(contact)))) for s in expansions)
    closes = _closing_times((grid, born, r0, speed), physics.gravity_m_s2, suction)
    t_p, z_p, seal = _find_seal(motion, grid, closes)
    counted = np.isfinite(z_p) and seal != "surface_seal"
    cavity = int(number[np.argmin(np.abs(grid - z_p))]) if counted else 0
    return Cavity(grid, born, r0, speed, number, physics.gravity_m_s2, starts, t_p, 0.0 - z_p, cavity, seal, suction)
