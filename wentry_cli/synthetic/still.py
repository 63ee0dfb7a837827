"""Single frames with known shape, for tests and for the accuracy of estimators: no dynamics, no files."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.camera_noise import Sensor, expose_frame, make_light
from wentry_cli.synthetic.outline import describe_shape, draw_blob, draw_sphere_outline, measure_outline
from wentry_cli.synthetic.raster import Polygon, Window, draw_polygons

Floats = NDArray[np.float64]
CAVITY_POINTS = 200


@dataclass(frozen=True)
class StillBody:
    """A deformed sphere in pixels; ``separation_y_px`` joins a dark cavity to it above that row (NaN: none).

    ``cavity_flare`` widens the cavity upward (pixels across per pixel up), ``cavity_bend`` more and more (1/px);
    ``misfit`` is (e3, e4) of ``outline.draw_sphere_outline``; a positive ``tilt_deg`` moves the lower pole to the
    right; ``motion_px`` is the displacement during the exposure.
    """

    center_x_px: float
    center_y_px: float
    radius_px: float
    stretch: float = 1.0
    tilt_deg: float = 0.0
    misfit: tuple[float, float] = (0.0, 0.0)
    separation_y_px: float = float("nan")
    cavity_flare: float = 0.15
    cavity_bend: float = 0.0
    motion_px: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class StillLight:
    """How the body is seen: transmissions, blur, noise, and what hides it.

    ``dark`` is that of all that is dark, ``sphere`` that of the sphere where it lets more light through;
    ``gradient`` is the change of the light across the frame as a fraction; ``droplets`` the fraction of the arc below
    the separation that droplets cover, ``droplet_levels`` the least and the greatest transmission of these;
    ``bright_spots`` a number of bright spots inside the silhouette;
    ``splash_ring`` a dark ring outside that merges with this fraction of the outline (top view); ``scenery`` what else
    is in the picture and does not move.
    """

    dark: float = 0.08
    sphere: float | None = None
    psf_px: float = 1.0
    sensor: Sensor = field(default_factory=Sensor)
    gradient: tuple[float, float] = (0.0, 0.0)
    vignette: float = 0.0
    droplets: float = 0.0
    droplet_levels: tuple[float, float] = (0.05, 0.5)
    bright_spots: int = 0
    splash_ring: float = 0.0
    scenery: tuple[Polygon, ...] = ()


@dataclass(frozen=True)
class Still:
    """A frame and its truth: noiseless ``transmission``, noisy grey ``levels``, ``light`` of the empty frame.

    ``half_width_px`` is the greatest one across the body's own axis (stretch times R), ``bottom_y_px`` the lowest
    point in the picture.
    """

    levels: NDArray[np.uint8] | NDArray[np.uint16]
    light: NDArray[np.float32]
    transmission: NDArray[np.float32]
    half_width_px: float
    bottom_y_px: float

    @property
    def flat(self) -> NDArray[np.float32]:
        """Noisy transmission: grey levels over the light of the empty frame."""
        return (self.levels / self.light).astype(np.float32)


def _cavity_outline(body: StillBody, outline: Floats, top_y: float) -> Floats:
    """A cavity from the separation row up to ``top_y``, as wide there as the sphere and flaring upward."""
    y = body.separation_y_px - body.center_y_px
    above = outline[:, 1] < y
    right = float(np.max(np.where(np.abs(outline[:, 1] - y) < 2.0, outline[:, 0], -np.inf)))
    if not above.any() or not np.isfinite(right):
        right = body.stretch * body.radius_px * 0.98
    sphere_y = body.radius_px / body.stretch**2
    inside = np.clip(1.0 - (y / sphere_y) ** 2, 0.0, 1.0)
    right = body.stretch * body.radius_px * float(np.sqrt(inside)) if not any(body.misfit) else right
    height = y - (top_y - body.center_y_px)
    up = np.linspace(0.0, height, CAVITY_POINTS) if body.cavity_bend else np.array([0.0, height])
    half = right + body.cavity_flare * up + 0.5 * body.cavity_bend * up * up
    side = np.column_stack([np.maximum(half, 0.0), y - up])
    return np.concatenate([side, (side * (-1.0, 1.0))[::-1]])


def _hide_with_droplets(body: StillBody, outline: Floats, light: StillLight, rng: np.random.Generator) -> list[Polygon]:
    separation = body.separation_y_px - body.center_y_px
    visible = outline[outline[:, 1] > separation] if np.isfinite(separation) else outline
    length = float(np.hypot(*np.diff(visible, axis=0).T).sum())
    covered, drops = 0.0, []
    while covered < light.droplets * length:
        x, y = visible[rng.integers(len(visible))]
        radius = float(np.exp(rng.normal(np.log(0.05), 0.4))) * body.radius_px
        away = rng.uniform(-0.6, 0.9) * radius
        norm = float(np.hypot(x, y))
        at = (body.center_x_px + x * (1 + away / norm), body.center_y_px + y * (1 + away / norm))
        drops.append(Polygon(draw_blob(at, radius, rng), float(rng.uniform(*light.droplet_levels)), 5))
        covered += 2.0 * float(np.sqrt(max(radius**2 - away**2, 0.0)))
    return drops


def _scatter_bright_spots(body: StillBody, count: int, rng: np.random.Generator) -> list[Polygon]:
    spots = []
    for _ in range(count):
        angle, reach = rng.uniform(0, 2 * np.pi), 0.75 * np.sqrt(rng.uniform())
        x = body.center_x_px + reach * body.stretch * body.radius_px * np.cos(angle)
        y = body.center_y_px + reach * body.radius_px / body.stretch**2 * np.sin(angle)
        radius = body.radius_px * rng.uniform(0.03, 0.12)
        spots.append(Polygon(draw_blob((x, y), radius, rng), float(rng.uniform(0.5, 1.1)), 4))
    return spots


def _draw_splash_ring(body: StillBody, share: float, dark: float) -> Polygon:
    """A dark crescent outside a circle that touches it over ``share`` of its outline."""
    half = np.pi * share
    angle = np.linspace(-half, half, 181)
    r = body.radius_px * body.stretch
    inner = np.stack([0.98 * r * np.cos(angle), 0.98 * r * np.sin(angle)], axis=1)
    outer = 1.35 * inner[::-1]
    at = np.array([body.center_x_px, body.center_y_px])
    return Polygon(np.concatenate([inner, outer]) + at, dark, 1)


def _instants(body: StillBody, shape: tuple[int, int]) -> list[tuple[float, float]]:
    length = float(np.hypot(*body.motion_px))
    n = max(1, int(np.ceil(length / 0.4)))
    share = (np.arange(n) + 0.5) / n - 0.5
    return [(float(f * body.motion_px[0]), float(f * body.motion_px[1])) for f in share]


def draw_still(body: StillBody, light: StillLight, shape: tuple[int, int], rng: np.random.Generator) -> Still:
    """Draw one frame of ``shape`` (rows, columns) and say what is true in it.

    The centre of the first pixel is (0, 0). ``rng`` makes the noise and places droplets and spots.
    """
    outline = draw_sphere_outline(body.radius_px, body.stretch, tilt_deg=body.tilt_deg, misfit=body.misfit)
    _, bottom = measure_outline(outline)
    half_width = body.stretch * body.radius_px * describe_shape(0.0, body.misfit).widest
    still = _scatter_bright_spots(body, light.bright_spots, rng)
    still += _hide_with_droplets(body, outline, light, rng) if light.droplets else []
    still += light.scenery
    if light.splash_ring:
        still.append(_draw_splash_ring(body, light.splash_ring, light.dark))
    cavity = _cavity_outline(body, outline, -20.0) if np.isfinite(body.separation_y_px) else None
    instants = []
    for dx, dy in _instants(body, shape):
        at = np.array([body.center_x_px + dx, body.center_y_px + dy])
        polygons = [Polygon(outline + at, light.dark if light.sphere is None else light.sphere, 2), *still]
        if cavity is not None:
            polygons.append(Polygon(cavity + at, light.dark, 1))
        instants.append(polygons)
    window = Window(0, 0, shape[1], shape[0])
    transmission = draw_polygons(instants, window, light.psf_px)
    sensor = light.sensor
    lamp = make_light(shape, sensor.level * sensor.white, light.gradient, light.vignette)
    levels = expose_frame(transmission, lamp, sensor, rng)
    return Still(levels, lamp, transmission, half_width, body.center_y_px + bottom)
