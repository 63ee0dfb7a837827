"""Peaks, valleys and periods of the true stretch.

A period ends where the stretch rises through its slowly varying mean. In these dynamics that mean is 1: the network
at rest and the flow of the other network have their one fixed point at stretch 1, a rate of stretch is all that the
impact leaves, the water only slows the clock, and shallow valleys keep 1 where it is. The viscous stretch follows the
swing within a period, so what it adds to the stretch of no force (up to .2) belongs to the swing: it is the lag that
damps. Linearised about rest, the motion is a damped swing and one part that only decays; the mean is 1 plus that
part, and at the end of the first period it is below .005 in every material of the paper, later below .0005.
Water that held the sphere oblate would change this; here it does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.course import Course

Floats = NDArray[np.float64]
PERIOD_DEFINITION = (
    "from one upward crossing of the mean stretch to the next, the first from impact; the mean is 1, the stretch "
    "at rest; where no valley lies below 1: midway between valley and next peak"
)


@dataclass(frozen=True)
class Periods:
    """Peaks and periods of the stretch after impact, in seconds and stretches."""

    peak_times_s: tuple[float, ...]
    peaks: tuple[float, ...]
    valleys: tuple[float, ...]
    starts_s: tuple[float, ...]
    ends_s: tuple[float, ...]


def find_periods(course: Course) -> Periods:
    """Peaks by a parabola on a fine grid; a period ends at the next upward crossing of 1, or midway to the peak."""
    t = np.linspace(0.0, max(course.end_s, 1e-6), 40001)
    stretch, _ = course.motion.stretch(t)

    def extrema(values: Floats) -> list[tuple[float, float]]:
        found = []
        for i in np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])) + 1:
            a, b, c = values[i - 1], values[i], values[i + 1]
            shift = 0.5 * (a - c) / (a - 2.0 * b + c)
            found.append((float(t[i] + shift * (t[1] - t[0])), float(b - 0.25 * (a - c) * shift)))
        return found

    peaks = extrema(stretch)
    valleys = [(s, -v) for s, v in extrema(-stretch)]
    ends = []
    for valley_t, _ in valleys:
        later = [p for p in peaks if p[0] > valley_t]
        if not later:
            break
        inside = (t >= valley_t) & (t <= later[0][0])
        up = np.flatnonzero((stretch[inside][:-1] < 1.0) & (stretch[inside][1:] >= 1.0))
        if up.size:
            s, part = t[inside], stretch[inside]
            i = int(up[0])
            ends.append(float(s[i] + (1.0 - part[i]) / (part[i + 1] - part[i]) * (s[i + 1] - s[i])))
        else:
            ends.append(0.5 * (valley_t + later[0][0]))
    starts = (0.0, *ends[:-1]) if ends else ()
    return Periods(
        tuple(p[0] for p in peaks), tuple(p[1] for p in peaks), tuple(v[1] for v in valleys), tuple(starts), tuple(ends)
    )
