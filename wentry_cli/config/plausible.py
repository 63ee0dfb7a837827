"""Keys that are right each by itself, but not together: what no laboratory has, told with every place at once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from wentry_cli.config.models import Experiment, View
from wentry_cli.config.moved import BY_HAND, with_uncertainty
from wentry_cli.config.places import Document, followed
from wentry_cli.errors import ConfigurationError

SPHERE_PX = (2.0, 20_000.0)
SMALLEST_ROI_PX = 16
DENSITIES = (10.0, 25_000.0)
HIGHEST_DROP_M = 4.0
ROUNDED = 1.001  # an exposure and a rate are given to a few digits
Problem = tuple[str, str]


def doubtful(experiment: Experiment) -> Iterator[tuple[str, float, str]]:
    """Keys whose values a laboratory can have but seldom has: each with its value and what is odd about it."""
    height = experiment.drop.height_m
    if height is not None and height > HIGHEST_DROP_M:
        speed = math.sqrt(2.0 * experiment.gravity_m_s2 * height)
        told = f"{height:g} m is higher than most rooms and gives {speed:.3g} m/s at impact; is it meant in metres?"
        yield "drop.height_m", height, told


def refuse_implausible(experiment: Experiment, folder: Path, document: Document) -> None:
    """Raise ``ConfigurationError`` where keys of the drop in ``folder`` contradict each other, every one named."""
    lines = []
    for key, message in [*_of_sphere(experiment), *_of_views(experiment, folder), *_of_uncertainties(experiment)]:
        path = tuple(key.split("."))
        lines.append(f"{document.place(path) or folder}: error: {key}: {message}")
    if lines:
        raise ConfigurationError("\n".join(lines))


def _of_sphere(experiment: Experiment) -> Iterator[Problem]:
    sphere = experiment.sphere
    low, high = DENSITIES
    if sphere.mass_kg is not None and not low <= sphere.mass_kg / sphere.volume_m3 <= high:
        density = sphere.mass_kg / sphere.volume_m3
        yield "sphere.mass_kg", f"with diameter_m it gives {density:.4g} kg/m³, not within {low:g} to {high:g}"


def _of_views(experiment: Experiment, folder: Path) -> Iterator[Problem]:
    for name in experiment.sides:
        view: View = getattr(experiment.views, name)
        for key, message in [*_of_scale(view, experiment), *_of_camera(view, experiment)]:
            yield f"views.{name}.{key}", message
    side, top = experiment.views.side, experiment.views.top
    if side is not None and top is not None and _is_one_picture(side, top, folder):
        yield (
            "views.top.source",
            "is the recording of the side view; name another, or give both views their part of the picture by roi_px",
        )


def _of_scale(view: View, experiment: Experiment) -> Iterator[Problem]:
    low, high = SPHERE_PX
    pair = view.scale_pair
    given = {name: value for name, value in (("air", pair.air), ("water", pair.water)) if not isinstance(value, str)}
    alike = isinstance(view.scale_px_per_m, float | int)
    for name, scale in list(given.items())[: 1 if alike else 2]:
        across = scale * experiment.sphere.diameter_m
        if not low <= across <= high:
            yield (
                "scale_px_per_m" if alike else f"scale_px_per_m.{name}",
                f"{scale:g} makes the sphere {across:.3g} px wide, not {low:g} to {high:g}; check scale and diameter",
            )
        elif view.scale_px_per_m_unc >= scale:
            yield "scale_px_per_m_unc", f"must be less than the scale {scale:g}, not {view.scale_px_per_m_unc:g}"


def _of_camera(view: View, experiment: Experiment) -> Iterator[Problem]:
    distance, diameter = view.camera_distance_m, experiment.sphere.diameter_m
    if distance is not None and distance <= diameter:
        yield "camera_distance_m", f"must be greater than the sphere's diameter {diameter:g} m, not {distance:g}"
    elif distance is not None and view.camera_distance_m_unc >= distance:
        yield (
            "camera_distance_m_unc",
            f"must be less than the distance {distance:g}, not {view.camera_distance_m_unc:g}",
        )
    if view.exposure_s is not None and view.fps != "from_header" and view.exposure_s * view.fps > ROUNDED:
        yield "exposure_s", too_long(view.exposure_s, view.fps)
    if view.roi_px is not None:
        left, top, right, bottom = view.roi_px
        if min(right - left, bottom - top) < SMALLEST_ROI_PX:
            yield (
                "roi_px",
                f"{right - left} x {bottom - top} pixels hold no sphere; give {SMALLEST_ROI_PX} or more each way",
            )


def too_long(exposure_s: float, fps: float) -> str:
    """What is wrong with an exposure that lasts longer than a frame."""
    return f"{exposure_s:g} s is longer than a frame at {fps:g} frames/s ({1.0 / fps:g} s); correct exposure_s or fps"


def _is_one_picture(side: View, top: View, folder: Path) -> bool:
    """Whether both views read the same part of one recording; a camera may see both through a mirror."""
    if followed(folder / side.source) != followed(folder / top.source):
        return False
    if side.roi_px is None or top.roi_px is None:
        return True
    return (side.rotate, side.flip, side.roi_px) == (top.rotate, top.flip, top.roi_px)


def _of_uncertainties(experiment: Experiment) -> Iterator[Problem]:
    for key in BY_HAND:
        value, unc = with_uncertainty(experiment, key)
        if value is not None and unc >= value:
            yield f"{key}_unc", f"must be less than {key.rsplit('.', 1)[-1]} {value:g}, not {unc:g}"
