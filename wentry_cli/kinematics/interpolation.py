"""Values between tabulated frames, from the values and their derivatives in the table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WIDE_FRAMES = 3.5


def hermite(times: Array, values: Array, slopes: Array, when: float, *, longest_gap: float) -> float:
    """Return the cubic through the two nearest frames around ``when`` with their slopes; NaN where it is not known.

    Frames with NaN are skipped. NaN is returned outside the record and inside a gap of more than ``longest_gap``.
    """
    good = np.isfinite(times) & np.isfinite(values) & np.isfinite(slopes)
    t, y, d = times[good], values[good], slopes[good]
    if t.size < 2 or not t[0] <= when <= t[-1]:
        return float("nan")
    i = min(int(np.searchsorted(t, when, side="right")) - 1, t.size - 2)
    step = t[i + 1] - t[i]
    if step > longest_gap:
        return float("nan")
    s = (when - t[i]) / step
    start = (1 + 2 * s) * (1 - s) ** 2 * y[i] + s * (1 - s) ** 2 * step * d[i]
    return float(start + s**2 * (3 - 2 * s) * y[i + 1] + s**2 * (s - 1) * step * d[i + 1])


def nearest(times: Array, values: Array, when: float) -> float:
    """Return the value of the measured frame nearest to ``when``; NaN where nothing was measured."""
    good = np.isfinite(times) & np.isfinite(values)
    if not good.any():
        return float("nan")
    return float(values[good][np.argmin(np.abs(times[good] - when))])


def lagrange_cubic(times: Array, values: Array, variance: Array, when: Array) -> tuple[Array, Array]:
    """Return the cubic through the four samples around each ``when`` and its variance, NaN beside a missing sample.

    A sample at ``when`` itself (within 1e-3 of a step) is taken as it is.
    """
    out = np.full(when.shape, np.nan)
    spread = np.full(when.shape, np.nan)
    if times.size < 4 or not np.isfinite(values).any():
        return out, spread
    tolerance = 1e-3 * float(np.median(np.diff(times)))
    for k, t in enumerate(when):
        i = int(np.argmin(np.abs(times - t)))
        if abs(times[i] - t) <= tolerance:
            out[k], spread[k] = values[i], variance[i]
            continue
        first = int(np.searchsorted(times, t)) - 2
        if first < 0 or first + 4 > times.size:
            continue
        near = times[first : first + 4]
        weights = np.array([np.prod([(t - b) / (a - b) for b in near if b != a]) for a in near])
        out[k] = weights @ values[first : first + 4]
        spread[k] = weights**2 @ variance[first : first + 4]
    return out, spread


def beside_gap(time: float, measured_s: Array) -> float:
    """Return how far an extremum in or beside a gap may lie off: half of what is uniform over the gap; else 0."""
    before, after = measured_s[measured_s <= time], measured_s[measured_s > time]
    step = float(np.median(np.diff(measured_s)))
    if not before.size or not after.size:
        return 0.0
    # the frame at the edge of a gap is on the extremum itself: what counts is the one behind the gap
    edges = (time - before[-1], after[0] - time)
    beyond = (time - before[-2] if before.size > 1 else 0.0, after[1] - time if after.size > 1 else 0.0)
    reach = max(far if near < 0.5 * step else near for near, far in zip(edges, beyond, strict=True))
    return reach / np.sqrt(12.0) / 2.0 if reach > WIDE_FRAMES * step else 0.0
