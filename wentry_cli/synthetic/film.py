"""A view as a sequence of exposed frames over a cached background."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.camera_noise import Sensor, expose_frame, make_light
from wentry_cli.synthetic.course import Course
from wentry_cli.synthetic.raster import Polygon, Window, draw_polygons
from wentry_cli.synthetic.scene import Camera

Drawing = Callable[[Course, float], list[Polygon]]
BLUR_STEP_PX = 0.5
MOST_INSTANTS = 24


@dataclass
class Film:
    """Draws frames of one view; only the window in which something moves is drawn anew."""

    course: Course
    camera: Camera
    drawing: Drawing
    static: Sequence[Polygon]
    seed: int
    light: NDArray[np.float32] = field(init=False)
    background: NDArray[np.float32] = field(init=False)
    sensor: Sensor = field(init=False)
    hot: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        """Light, sensor, still background and hot pixels, made once."""
        camera, lamp = self.camera, self.camera.lamp
        shape = (camera.height, camera.width)
        self.sensor = Sensor(camera.bits, lamp.level, lamp.noise, lamp.shot_share)
        self.light = make_light(shape, lamp.level * self.sensor.white, lamp.gradient, lamp.vignette)
        self.background = draw_polygons([list(self.static)], Window(0, 0, camera.width, camera.height), lamp.psf_px)
        rng = np.random.default_rng([self.seed, 999])
        count = self.course.scene.switches.hot_pixels
        self.hot = np.stack([rng.integers(0, camera.height, count), rng.integers(0, camera.width, count)])

    def transmission(self, t: float) -> NDArray[np.float32]:
        """Transmission of the frame exposed about ``t`` (s after impact)."""
        instants = [self.drawing(self.course, float(s)) for s in self._instants(t)]
        window = self._window(instants)
        frame = self.background.copy()
        if window is not None:
            part = draw_polygons(instants, window, self.camera.lamp.psf_px)
            frame[window.y0 : window.y1, window.x0 : window.x1] = part
        return 1.05 - frame if self.camera.polarity == "bright" else frame

    def expose(self, index: int, t: float) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Grey levels of frame ``index`` exposed about ``t``; ``nan`` gives an empty frame."""
        empty = 1.05 - self.background if self.camera.polarity == "bright" else self.background
        seen = empty if np.isnan(t) else self.transmission(t)
        flicker = self.course.scene.switches.flicker
        light = self.light
        if flicker:
            light = light * np.float32(1.0 + flicker * np.sin(0.37 * index + 0.5))
        levels = expose_frame(seen, light, self.sensor, np.random.default_rng([self.seed, index]))
        levels[self.hot[0], self.hot[1]] = self.sensor.white
        return levels

    def _instants(self, t: float) -> NDArray[np.float64]:
        """Times within the exposure, close enough that nothing moves by more than BLUR_STEP_PX between them."""
        exposure = self.camera.exposure_s
        speed = float(np.abs(self.course.motion.center(t)[1])) + self.course.motion.radius_m * 2.0 * float(
            np.abs(self.course.motion.stretch(t)[1])
        )
        moved = speed * exposure * self.camera.scale_px_per_m
        n = int(np.clip(np.ceil(moved / BLUR_STEP_PX), 1, MOST_INSTANTS))
        return np.asarray(t + exposure * ((np.arange(n) + 0.5) / n - 0.5))

    def _window(self, instants: Sequence[Sequence[Polygon]]) -> Window | None:
        """Pixels that anything but the static polygons can change."""
        still = len(self.static)
        moving = [p.points for polygons in instants for p in polygons[still:]]
        if not moving:
            return None
        margin = int(np.ceil(5.0 * self.camera.lamp.psf_px + 2.0))
        low = np.min([p.min(axis=0) for p in moving], axis=0) - margin
        high = np.max([p.max(axis=0) for p in moving], axis=0) + margin + 1
        x0, x1 = (int(np.clip(v, 0, self.camera.width)) for v in (low[0], high[0]))
        y0, y1 = (int(np.clip(v, 0, self.camera.height)) for v in (low[1], high[1]))
        return Window(x0, y0, x1, y1) if x1 > x0 and y1 > y0 else None
