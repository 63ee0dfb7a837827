"""Whether recording and configuration belong together, as far as size, rate and clock tell before anything is measured.

Each function raises ``ConfigurationError`` with the key and its place, or ``InputError`` where the recording
contradicts itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from wentry_cli.config.blame import wrong_key
from wentry_cli.config.models import ScalePair
from wentry_cli.config.plausible import ROUNDED, too_long
from wentry_cli.errors import InputError
from wentry_cli.frames.reader import RecordingInfo

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

LONGEST_PAUSE = 2.0  # between the clips of both views, in lengths of the longer one
Span = tuple[float, float]


def check_view(drop: Drop, name: str, info: RecordingInfo) -> None:
    """The surface lies in the picture or above it by no more than its height; the shutter closes within a frame.

    And the sphere, as large as a given scale makes it, fits into the picture.
    """
    view = drop.view(name)
    _check_size(drop, name, info)
    row, rows = view.surface_y_px, info.height
    if row != "auto" and not -rows <= row <= rows:
        told = (
            f"{row:g} is far outside of the picture, whose rows are 0 to {rows - 1}; count in the turned, cropped image"
        )
        raise wrong_key(drop, f"views.{name}.surface_y_px", row, told)
    exposure = view.exposure_s or info.exposure_s
    if exposure is None or not info.fps or not info.rate_trusted or exposure * info.fps <= ROUNDED:
        return
    if view.exposure_s is not None:
        raise wrong_key(drop, f"views.{name}.exposure_s", exposure, too_long(exposure, info.fps))
    if view.fps != "from_header":
        told = f"{too_long(exposure, info.fps)}: the exposure is the header's"
        raise wrong_key(drop, f"views.{name}.fps", view.fps, told)
    raise InputError(
        f"{info.path}: its header claims an exposure of {exposure:g} s, longer than a frame at {info.fps:g} frames/s; "
        f"set views.{name}.exposure_s and views.{name}.fps to those of the camera"
    )


def _check_size(drop: Drop, name: str, info: RecordingInfo) -> None:
    view, diameter = drop.view(name), drop.experiment.sphere.diameter_m
    scale = view.scale_pair.air
    if scale == "auto" or scale * diameter <= min(info.width, info.height):
        return
    alike = not isinstance(view.scale_px_per_m, ScalePair)
    told = (
        f"{scale:g} makes the sphere {scale * diameter:.4g} px wide, and the picture is {info.width} x {info.height} "
        "px; correct the scale or sphere.diameter_m"
    )
    raise wrong_key(drop, f"views.{name}.scale_px_per_m" + ("" if alike else ".air"), scale, told)


def check_clocks(drop: Drop, spans: dict[str, Span]) -> None:
    """First and last time of each view, s: one does not begin long after the other has ended."""
    if len(spans) < 2:
        return
    side, top = spans["side"], spans["top"]
    gap = max(top[0] - side[1], side[0] - top[1])
    if gap > LONGEST_PAUSE * max(side[1] - side[0], top[1] - top[0]):
        offset = drop.view("top").offset_s
        told = (
            f"{offset:g} s puts the top view at {top[0]:.4g} to {top[1]:.4g} s, but the side view is filmed from "
            f"{side[0]:.4g} to {side[1]:.4g} s; correct it"
        )
        raise wrong_key(drop, "views.top.offset_s", offset, told)
