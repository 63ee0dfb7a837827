"""Whether a sphere falls before impact as gravity has it, and what its speed is worth where it does not."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics.ballistic import fit_parabola
from wentry_cli.kinematics.entry import fall_speed
from wentry_cli.kinematics.state_pass import Ballistic

Array = NDArray[np.float64]
FEWEST_IN_FALL = 8
SLOW_EDGE_PX = 0.01  # by which a centre may err slowly
# Standard uncertainties, and share of gravity (drag takes half of it), to contradict it.
CLEARLY_OFF, OFF_BY = 5.0, 0.06


@dataclass(frozen=True)
class Fall:
    """Acceleration before impact, m/s² downwards, its uncertainty, and whether gravity explains it (``falls``).

    ``bend`` is what an edge that errs slowly, by a part of a pixel, may add to it. ``falls_early`` says of the earlier
    half that gravity explains it. ``speeds`` at impact, m/s downwards, are those with a free acceleration
    and with that of gravity.
    """

    acceleration: float
    unc: float
    bend: float
    falls: bool
    falls_early: bool
    speeds: tuple[float, float]

    def speed_doubt(self, speed: float) -> float:
        """What a speed at impact, m/s, may be wrong by because the fall contradicts gravity; 0 where it does not.

        Either the scales of length and time are wrong or the frames are, and nobody knows which of the two fits is
        right: a speed is doubted by the farther of them.
        """
        return 0.0 if self.falls else max(abs(speed - other) for other in self.speeds)


def check_fall(
    times_s: Array,
    height_m: tuple[Array, Array],
    gravity_m_s2: float,
    pixel_m: float,
    *,
    released_s: float = -math.inf,
) -> Fall | None:
    """Fit the heights before time 0 with a free acceleration and compare it with gravity; None below eight frames.

    ``height_m`` are heights of the centre and their standard uncertainties, (n,) each, NaN where not measured;
    ``pixel_m`` is what an edge that errs by a part of a pixel is worth. Frames up to ``released_s``, in which the
    sphere is still held, do not count. Where all frames together tell no acceleration, as when the last of them show
    something else than a fall, the earlier half is asked.
    """
    before = np.flatnonzero((times_s > released_s) & (times_s < 0.0) & np.isfinite(height_m[0]))
    if before.size < FEWEST_IN_FALL:
        return None
    whole, early = (
        _fall(times_s[part], (height_m[0][part], height_m[1][part]), gravity_m_s2, pixel_m)
        for part in (before, before[: FEWEST_IN_FALL // 2 + before.size // 2])
    )
    told = early if whole.falls and whole.unc > OFF_BY * gravity_m_s2 else whole
    return replace(told, falls_early=early.falls)


def _fall(times: Array, height: tuple[Array, Array], gravity: float, pixel_m: float) -> Fall:
    fit = fit_parabola(times, *height, relative=True)
    found, unc = -float(fit.parameters[2]), math.sqrt(float(fit.covariance[2, 2]))
    # an edge that errs by a part of a pixel, slowly, looks like the bend of a parabola
    bend = 8.0 * SLOW_EDGE_PX * pixel_m / float(np.ptp(times)) ** 2
    falls = abs(found - gravity) <= max(CLEARLY_OFF * unc + bend, OFF_BY * gravity)
    free = -float(fit.evaluate(np.zeros(1))[0][0, 1])
    held, _ = fall_speed(times, *height, Ballistic(-gravity))
    return Fall(found, unc, bend, falls, falls, (free, held))
