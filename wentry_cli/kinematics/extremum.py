"""A peak or valley of the stretch, and how clearly it differs from another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wentry_cli.kinematics.smoother import SmoothTrack

SIGNIFICANT = 4.0
NO_TIME = float("nan")


@dataclass(frozen=True)
class Extremum:
    """A peak or valley: time after impact and stretch, each with its standard uncertainty.

    ``common_unc`` is the part of ``stretch_unc`` that the frames around have in common.
    """

    time_s: float
    time_unc_s: float
    stretch: float
    stretch_unc: float
    peak: bool
    common_unc: float = 0.0


UNSEEN = Extremum(NO_TIME, NO_TIME, NO_TIME, NO_TIME, True)


def ends(track: SmoothTrack) -> tuple[Extremum, ...]:
    """The first and last state of the track, for a lone extremum to be compared with."""
    frames = track.frames
    return tuple(
        Extremum(float(frames.times_s[i]), 0.0, float(frames.position[i]), float(frames.position_unc[i]), False)
        for i in (0, -1)
    )


def swing(a: Extremum, b: Extremum, minimum_swing: float) -> float:
    """How far two extrema lie apart, over what they must: four standard uncertainties and ``minimum_swing``."""
    needed = max(minimum_swing, SIGNIFICANT * float(np.hypot(a.stretch_unc, b.stretch_unc)))
    return abs(a.stretch - b.stretch) / needed
