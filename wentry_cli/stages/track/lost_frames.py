"""What is done where frames are lost without a gap, or gaps lose none: it is said, and wrong times are left out."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.tracking.held import since
from wentry_cli.tracking.idle_clock import IdleClock, idle_times, stays_in_sight
from wentry_cli.tracking.lost_frames import LostFrames, lost_in_fall, lost_in_water
from wentry_cli.tracking.seed import detect
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop
    from wentry_cli.imaging.background import Background

Array = NDArray[np.float64]
UNEVEN = 0.01
logger = logging.getLogger(__name__)


def without_lost_time(
    drop: Drop, clip: Clip, sightings: Sequence[Sighting], scale_px_m: float, released_s: float
) -> list[Sighting]:
    """The sightings, those in air before the last loss of frames with the status ``gap``: their time is not known.

    The clock of a drop starts at impact, so that a loss in air falsifies the times before it. One below the surface
    falsifies those after it and is told only. Frames up to ``released_s``, in which the sphere is held, tell of none.
    """
    between = np.diff(clip.time_s)
    if not between.size or np.ptp(between) > UNEVEN * np.median(between):
        return list(sightings)  # frames whose times are told one by one
    good = [item for item in sightings if item.ok and item.fit is not None]
    fall_px = drop.experiment.gravity_m_s2 * scale_px_m * float(np.median(between)) ** 2
    dry = since([item for item in good if not item.wet], clip.time_s, released_s)
    in_air = lost_in_fall(*_path(dry), fall_px)
    _tell(drop, in_air, "what was seen in air before that is left out")
    in_water = lost_in_water(*_path([item for item in good if item.wet]))
    _tell(drop, in_water, "until then all times after it are too early")
    first = in_air[-1].after if in_air else 0
    return [item._replace(status="gap") if item.ok and item.frame < first else item for item in sightings]


def without_idle_time(drop: Drop, clip: Clip, ground: Background, radius_range: tuple[float, float]) -> None:
    """Leave out of ``clip`` the frames of a fall before a time that the clock tells and the sphere does not take.

    As with lost frames, the clock starts at impact: the times before it are wrong, those after it are not. After the
    impact, where the sphere may be seen by itself again, nothing is left out.
    """

    def sphere_in(frame: int) -> tuple[float, float]:
        seen = detect(clip, frame, ground, radius_range)
        return (seen[0].y, seen[0].radius) if seen else (math.nan, math.nan)

    bad = {frame for frame, _ in clip.unreadable}
    frames = [frame for frame in range(clip.count) if frame not in bad]
    idle = [
        item
        for item in idle_times(frames, clip.time_s, lambda frame: sphere_in(frame)[0])
        if stays_in_sight(frames[: frames.index(item.after) + 1], lambda frame: sphere_in(frame)[1])
    ]
    _tell_idle(drop, idle, "what was seen before that is left out")
    if idle:
        clip.leave_out(range(idle[-1].after))


def tell_idle_below(drop: Drop, clip: Clip, sightings: Sequence[Sighting]) -> None:
    """Warn of times below the surface that the clock tells and the sphere does not take."""
    row = {item.frame: item.fit.center_y_px for item in sightings if item.ok and item.wet and item.fit is not None}
    idle = idle_times(sorted(row), clip.time_s, row.__getitem__)
    _tell_idle(drop, idle, "until then all times after it are too late")


def _tell_idle(drop: Drop, idle: Sequence[IdleClock], until_then: str) -> None:
    if not idle:
        return
    first = idle[0]
    others = f", and so in {len(idle) - 1} places after that" if len(idle) > 1 else ""
    logger.warning(
        f"{drop.name}: between frames {first.before} and {first.after} the clock tells {first.intervals:.3g} intervals "
        f"and the sphere moves as far as in one: no frame is missing{others}; number the frames without that gap, or "
        f"set views.side.fps where the recording's stamps are wrong; {until_then}",
        extra=puts_in_doubt("times of the frames"),
    )


def _path(sightings: Sequence[Sighting]) -> tuple[Array, Array, Array]:
    """Number of the frame, row of the centre and its uncertainty, px, (n,) each."""
    path = [(item.frame, item.fit.center_y_px, item.fit.bottom_y_unc_px) for item in sightings if item.fit is not None]
    number, row, unc = np.array(path, dtype=np.float64).reshape(-1, 3).T
    return number, row, unc


def _tell(drop: Drop, losses: Sequence[LostFrames], until_then: str) -> None:
    """Warn of the first loss, and of how many places are like it."""
    if not losses:
        return
    lost = losses[0]
    missing = "a frame is" if lost.steps == 2 else f"{lost.steps - 1} frames are"
    others = f", and so in {len(losses) - 1} places after that" if len(losses) > 1 else ""
    logger.warning(
        f"{drop.name}: between frames {lost.before} and {lost.after} the sphere moves as far as in {lost.steps} frames "
        f"elsewhere: {missing} missing{others}; number the frames as the camera did, or take the clip to one side of "
        f"the gap with views.side.frames; {until_then}",
        extra=puts_in_doubt("times of the frames"),
    )
