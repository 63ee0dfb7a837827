"""The top view: a circle in every frame until the splash closes over it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.flight import leaves_frame, margin_of
from wentry_cli.tracking.follow import Plan, Watch, follow
from wentry_cli.tracking.impact import weighted_line
from wentry_cli.tracking.prediction import Path, plausible
from wentry_cli.tracking.round_levels import median_levels
from wentry_cli.tracking.sighting import Look, Sighting
from wentry_cli.tracking.source import Frames, read_patch
from wentry_cli.tracking.splash_ring import judge_rings
from wentry_cli.tracking.top_depth import Height, TopCamera

HIDDEN_AFTER = 10
# The softest spheres widen by 3 % of their radius a frame, those filmed at few frames a second by more.
FASTEST_GROWTH, SUDDEN = 0.06, 0.5
FIRST_CIRCLES, BRIGHTER = 5, 0.15
SEARCH_STEP = 1
NEAREST = 1e-3  # of its distance from the surface, a sphere in front of the camera
SMALLEST_AGAIN, LARGEST_AGAIN, ALIKE_AGAIN, BRIGHT_AGAIN = 0.6, 2.4, 0.08, 0.5


def track_top(
    frames: Frames, ground: Background, seed: Path, *, level: str = "accurate", exposure_frames: float = 0.0
) -> list[Sighting]:
    """Fit a circle in every frame, from the seed backwards to the first and forwards until the sphere is hidden.

    What could not be measured in ten frames in a row is hidden; it is looked for again, and where it never comes back
    the splash has domed over: all later frames are ``occluded``.
    """
    plan = _circle_plan(frames.shape, level, exposure_frames)
    start = seed.frames[0]
    seen: list[Sighting] = []
    darkness: list[tuple[float, float]] = []
    path: Path | None = replace(seed)
    while path is not None:
        watch = Watch(accept=_like_the_sphere(path, darkness), patience=HIDDEN_AFTER)
        seen += follow(frames, ground, path, range(start, frames.count), plan, watch)
        path, start = find_again(frames, ground, path, seen[-1].frame + 1)
        seen += [Sighting(index, "occluded") for index in range(seen[-1].frame + 1, start)]
    backward = seed.turned()
    before = follow(frames, ground, backward, range(seed.frames[0] - 1, -1, -1), plan)
    return _hidden_at_the_end(judge_rings(frames, ground, [*reversed(before), *seen]))


def _like_the_sphere(path: Path, darkness: list[tuple[float, float]]) -> Callable[[Sighting], bool]:
    """Whether a circle is as large as the sphere can have become, and as dark within: no edge of the ring is both.

    Within the outer edge of a ring there is the ring itself, which is lighter than the sphere, or the gap between the
    two. ``darkness`` collects what the first circles are within.
    """

    def accept(sighting: Sighting) -> bool:
        assert sighting.fit is not None
        last, expected = path.shapes[-1].semi_across, path.predict(sighting.frame).semi_across
        allowed = FASTEST_GROWTH * path.radius * (SUDDEN + abs(sighting.frame - path.frames[-1]))
        if not min(last, expected) - allowed < sighting.fit.radius_px < max(last, expected) + allowed:
            return False
        found = sighting.inside, sighting.lightest
        if len(darkness) < FIRST_CIRCLES:
            darkness.append(found)
            return True
        usual = np.nanmedian(darkness, axis=0)
        return not any(level > before + BRIGHTER for level, before in zip(found, usual, strict=True))

    return accept


def find_again(frames: Frames, ground: Background, path: Path, index: int) -> tuple[Path | None, int]:
    """Look for a sphere that the splash has hidden, from frame ``index`` on: a path through it, and its frame.

    It is the innermost dark disc about where it was last seen, alike in two frames one after the other.
    """
    last = path.shapes[-1]
    for at in range(index, frames.count - 1, SEARCH_STEP):
        first, second = (_inner_disc(frames, ground, frame, last, path.radius) for frame in (at, at + 1))
        if abs(second - first) < ALIKE_AGAIN * first:
            again = Path(path.radius)
            again.add(at, EllipseShape(last.x, last.y, path.radius, first / path.radius))
            return again, at
    return None, index


def _inner_disc(frames: Frames, ground: Background, index: int, last: EllipseShape, radius: float) -> float:
    """Radius at which a frame turns bright for the first time, on its way out from a point; NaN where it does not."""
    reach = LARGEST_AGAIN * radius
    patch = read_patch(frames, index, ground, (last.x - reach, last.y - reach, last.x + reach, last.y + reach))
    if isinstance(patch, str):
        return math.nan
    away = np.arange(0.0, reach, 1.0)
    bright = np.flatnonzero(median_levels(patch, last.x, last.y, away) > BRIGHT_AGAIN)
    return float(away[bright[0]]) if bright.size and away[bright[0]] > SMALLEST_AGAIN * radius else math.nan


def _hidden_at_the_end(seen: list[Sighting]) -> list[Sighting]:
    last = max((index for index, item in enumerate(seen) if item.ok), default=-1)
    tail = seen[last + 1 :]
    if len(tail) < HIDDEN_AFTER:
        return seen
    hidden = [Sighting(item.frame, _hidden(item.status)) for item in tail]
    return [*seen[: last + 1], *hidden]


def _hidden(status: str) -> str:
    return status if status in {"bad_frame", "gap", "out_of_frame"} else "occluded"


def _circle_plan(frame_shape: tuple[int, int], level: str, exposure_frames: float) -> Plan:
    def plan(_: int, guess: EllipseShape, velocity: tuple[float, float]) -> Look | str:
        radius = guess.radius * guess.stretch
        circle = EllipseShape(guess.x, guess.y, radius)
        if leaves_frame(circle, frame_shape):
            return "out_of_frame"
        reach = radius + margin_of(radius)
        box = (guess.x - reach, guess.y - reach, guess.x + reach, guess.y + reach)
        motion = (velocity[0] * exposure_frames, velocity[1] * exposure_frames)
        return Look(box, "x y R", motion_px=motion, level=level, outline="circle", one_sided=True)

    return plan


@dataclass(frozen=True)
class TopScale:
    """Scale of the top view in the plane of the free surface, px/m, with its standard uncertainty and origin."""

    px_m: float
    unc_px_m: float
    source: str


def scale_from_approach(
    time_s: ArrayLike, radius_px: ArrayLike, unc_px: ArrayLike, radius_m: float, distance_m: float | None
) -> TopScale:
    """Scale from the undeformed sphere on its way to the surface.

    ``time_s`` counts from impact; the radii before it (px) lie on a line, since the sphere recedes from the camera, and
    its value at impact is that of a sphere whose centre is one radius above the surface. With the distance of the
    camera above the surface known that is carried down to the surface. NaN where fewer than three frames are known.
    """
    time, radius, unc = (np.asarray(item, np.float64) for item in (time_s, radius_px, unc_px))
    before = (time < 0) & np.isfinite(radius) & np.isfinite(unc) & (unc > 0)
    if np.count_nonzero(before) < 3:
        return TopScale(math.nan, math.nan, "unknown")
    design = np.stack([np.ones(np.count_nonzero(before)), time[before]], axis=1)
    solution, covariance, _ = weighted_line(design, radius[before], unc[before])
    lower = 1.0 if distance_m is None else 1.0 - radius_m / distance_m
    scale = float(solution[0]) * lower / radius_m
    return TopScale(scale, scale * math.sqrt(covariance[0, 0]) / float(solution[0]), "approach")


def top_stretch(
    radius_px: ArrayLike,
    unc_px: ArrayLike,
    scale: TopScale,
    radius_m: float,
    magnification: tuple[ArrayLike, ArrayLike],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stretch λ and its standard uncertainty from radii in px: the radius over that of the undeformed sphere.

    ``magnification`` is that of the plane of the sphere's equator against that of the surface, with its uncertainty.
    Both are NaN where no sphere can be stretched like that, so that scale or distance must be wrong.
    """
    factor, factor_unc = (np.asarray(item, np.float64) for item in magnification)
    reference = scale.px_m * radius_m * factor
    radius, unc = np.asarray(radius_px, np.float64), np.asarray(unc_px, np.float64)
    stretch = plausible(radius / reference)
    common = np.hypot(scale.unc_px_m / scale.px_m, factor_unc / factor)
    return stretch, np.hypot(unc / reference, stretch * common)


def magnification_at(height: Height, camera: TopCamera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Magnification 1 / (1 - h/Z) of the plane at a height against that of the surface (pinhole), and its uncertainty.

    What is not known of the height and of the distance Z both count. NaN for a height at which the camera stands.
    """
    below = 1.0 - height.value_m * camera.inverse_1_m
    factor = 1.0 / np.where(below > NEAREST, below, np.nan)
    high = np.hypot(height.unc_m, height.zero_unc_m)
    return factor, factor**2 * np.hypot(camera.inverse_1_m * high, camera.unc_1_m * height.value_m)


def magnification_change(height: Height, camera: TopCamera, at_rest: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Relative uncertainty of the magnification in each frame against the mean of those ``at_rest``.

    The undeformed sphere shows what scale, zero of the heights and distance of the camera do to all frames alike: what
    is left is what they do more in one frame than in these.
    """
    factor, _ = magnification_at(height, camera)
    by_zero, by_distance = (part - np.nanmean(part[at_rest]) for part in (factor, factor * height.value_m))
    high = np.hypot(factor * height.unc_m, by_zero * height.zero_unc_m)
    return np.hypot(camera.inverse_1_m * high, camera.unc_1_m * by_distance)
