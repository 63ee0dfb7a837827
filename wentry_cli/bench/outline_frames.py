"""Frames of a case with their truth, and how far light allows one to see in them."""

from __future__ import annotations

import math
import zlib
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.bench.outline_cases import Case
from wentry_cli.contours.bounds import cap_bound, cramer_rao_bound, visible_top
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.synthetic.camera_noise import Sensor, expose_frame
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still
from wentry_cli.synthetic.still_scenery import lamp_lit_cavity, mirror_image, surface_band, translucent_body

Floats = NDArray[np.float64]

MARGIN_PX = 18
MIRROR_GAP_PX = 8.0
BAND_PX = 18.0
PIXEL_VARIANCE = 1.0 / 12.0
# A pixel whose transmission droplets change by less is as good as plain.
HIDDEN = 0.003
# What is wanted of every frame, in this order.
QUANTITIES = (("x", "px"), ("y", "px"), ("stretch", "1"), ("bottom_y", "px"), ("local_bottom_y", "px"))


@dataclass(frozen=True)
class Frame:
    """A flat-fielded region with its truth (x, y, stretch, lowest row) and what every method is told.

    ``guess`` is a prediction that is off by about a pixel; ``ceiling`` is the transmission at which the sensor clips.
    ``hidden`` tells which pixels droplets change, ``clear`` the share of the scene that they leave to see in each; None
    where there are none.
    """

    region: NDArray[np.float32]
    truth: Floats
    guess: EllipseShape
    top_y: float
    ceiling: float
    hidden: NDArray[np.bool_] | None = None
    clear: NDArray[np.float32] | None = None


def draw_frame(case: Case, seed: int, number: int) -> Frame:
    """Render frame ``number`` of a case at a random sub-pixel place; the case has a stream of its own."""
    rng = np.random.default_rng([seed, zlib.crc32(case.name.encode()), number])
    margin = MARGIN_PX + (12 if case.ring else 0)
    across, along = case.radius * case.stretch + margin, case.radius / case.stretch**2 + margin
    x, y = across + rng.uniform(), along + rng.uniform()
    size = (int(2 * along + 1), int(2 * across * (1.0 - case.crop) + 1))
    shape = EllipseShape(x, y, case.radius, case.stretch, case.tilt_deg)
    top_y = visible_top(shape, case.visible)
    turn = rng.uniform(0.0, 2.0 * math.pi)
    body = StillBody(
        x, y, case.radius, case.stretch, tilt_deg=case.tilt_deg,
        misfit=(case.misfit * math.cos(turn), case.misfit * math.sin(turn)),
        separation_y_px=top_y - 3.0 if case.scenery == "cavity" else math.nan, motion_px=case.motion_px,
    )  # fmt: skip
    light = _light(case, body, top_y, rng)
    before = deepcopy(rng)
    still = draw_still(body, light, size, rng)
    off = rng.uniform(-1.0, 1.0, 3)
    told = case.radius * case.told_radius
    guess = EllipseShape(x + off[0], y + off[1], told, case.stretch / case.told_radius**0.5 + 0.01 * off[2])
    truth = np.array([x, y, still.half_width_px / case.radius, still.bottom_y_px])
    ground = case.level * (2**case.bits - 1)
    flat = still.flat if case.flat else (still.levels / ground).astype(np.float32)
    ceiling = 1.0 / case.level if case.level > 1.0 else math.inf
    if case.bright:
        inverse = np.float32(1.0 + case.dark)
        levels = expose_frame(inverse - still.transmission, still.light, light.sensor, rng)
        flat = np.asarray(inverse - levels / still.light, np.float32)
    hidden = clear = None
    if case.droplets:
        plain = draw_still(body, replace(light, droplets=0.0), size, rng)
        hidden = np.abs(still.transmission - plain.transmission) > HIDDEN
        dark = replace(light, dark=1.0, droplet_levels=(0.0, 0.0))  # the same droplets, and nothing else
        clear = draw_still(body, dark, size, before).transmission
    return Frame(np.ascontiguousarray(flat), truth, guess, top_y, ceiling, hidden, clear)


def _light(case: Case, body: StillBody, top_y: float, rng: np.random.Generator) -> StillLight:
    gradient = (0.6 * case.gradient, 0.8 * case.gradient)
    scenery = _scenery(case, body, top_y, rng)
    sensor = Sensor(case.bits, case.level, case.noise)
    return StillLight(
        dark=case.dark, psf_px=case.psf, sensor=sensor, gradient=gradient, droplets=case.droplets,
        bright_spots=case.bright_spots, splash_ring=case.ring, scenery=scenery,
        vignette=0.4 if case.scenery == "cavity" else 0.0,
    )  # fmt: skip


def _scenery(case: Case, body: StillBody, top_y: float, rng: np.random.Generator) -> tuple[Polygon, ...]:
    if case.scenery == "translucent":
        return tuple(translucent_body(body, rng))
    if case.scenery == "mirror":
        return tuple(mirror_image(body, MIRROR_GAP_PX))
    if case.scenery == "band":
        return (surface_band(body, top_y - 4.0, BAND_PX, rng),)
    if case.scenery == "cavity":
        return (lamp_lit_cavity(body, 0.06),)
    return ()


def bounds_of(case: Case) -> Floats:
    """Bounds of QUANTITIES for a case as if nothing were hidden, shot noise included; stretch of a circle: its radius.

    The local bottom's is NaN in the top view.
    """
    shape = EllipseShape(0.0, 0.0, case.radius, case.stretch, case.tilt_deg)
    bounds = _bounds(case, shape)
    if not case.top_view:
        noise, dark = _noise(case)
        contrast = (1.0 - case.dark) / 0.92
        bounds[4] = cap_bound(shape, noise=noise / contrast, noise_dark=dark / contrast)
    return bounds


def bounds_left(case: Case, frame: Frame) -> Floats:
    """Bounds of QUANTITIES for what droplets leave of a frame (2, quantities), NaN for the local bottom.

    First for who is told which pixels they change, which then tell nothing; then for who knows the droplets themselves,
    so that a pixel that they cover in part still tells what the rest of it shows.
    """
    assert frame.hidden is not None
    assert frame.clear is not None
    x, y, *_ = frame.truth
    shape = EllipseShape(float(x), float(y), case.radius, case.stretch, case.tilt_deg)
    return np.stack([_bounds(case, shape, counts) for counts in (~frame.hidden, frame.clear**2)])


def _noise(case: Case) -> tuple[float, float]:
    """Standard deviation of a pixel on the ground and on the sphere."""
    shot = Sensor().shot_share
    noise = math.hypot(case.noise, 1.0 / (math.sqrt(12.0) * case.level * (2**case.bits - 1)))
    dark = noise * math.sqrt(1.0 - shot + shot * case.dark)
    return (dark, noise) if case.bright else (noise, dark)


def _bounds(case: Case, shape: EllipseShape, counts: NDArray[np.generic] | None = None) -> Floats:
    noise, dark = _noise(case)
    margin = MARGIN_PX + case.radius * case.stretch
    bound = cramer_rao_bound(
        shape, free=case.free, noise=noise, noise_dark=dark, blur_px=math.sqrt(case.psf**2 + PIXEL_VARIANCE),
        contrast=1.0 - case.dark, visible=case.visible, motion_px=case.motion_px,
        right_px=shape.x - margin + 2.0 * margin * (1.0 - case.crop) if case.crop else math.inf,
        counts=None if counts is None else np.asarray(counts, np.float64),
    )  # fmt: skip
    stretch = bound.radius_px / case.radius if case.top_view else bound.stretch
    return np.array([bound.x_px, bound.y_px, stretch, bound.bottom_y_px, math.nan])
