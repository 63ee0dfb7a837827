"""Free flight: a constant acceleration by weighted least squares, without any prior on gravity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]
DEGREE = 2
ROUNDS = 4
REJECT = 5.0


@dataclass(frozen=True)
class Parabola:
    """y = p + v (t − t₀) + a (t − t₀)²/2 with covariance (3, 3) of (p, v, a), already scaled to the scatter found.

    ``used`` marks the samples kept; ``residual`` is measured − fitted (NaN where missing); ``noise_scale`` is the
    factor on the stated uncertainties (1 where the scatter is smaller, unless they are only relative); ``status`` is ok
    or too_few.
    """

    origin_s: float
    parameters: Array
    covariance: Array
    used: NDArray[np.bool_]
    residual: Array
    noise_scale: float
    status: str

    def evaluate(self, times_s: Array) -> tuple[Array, Array]:
        """Return states (n, 3) of position, velocity, acceleration and their covariances (n, 3, 3)."""
        t = np.atleast_1d(np.asarray(times_s, dtype=float)) - self.origin_s
        carry = np.zeros((t.size, 3, 3))
        carry[:, 0, 0] = carry[:, 1, 1] = carry[:, 2, 2] = 1.0
        carry[:, 0, 1] = carry[:, 1, 2] = t
        carry[:, 0, 2] = 0.5 * t**2
        return carry @ self.parameters, carry @ self.covariance @ carry.transpose(0, 2, 1)


def fit_parabola(
    times_s: Array, position_m: Array, position_unc_m: Array | float, *, relative: bool = False
) -> Parabola:
    """Fit a constant acceleration to positions (n; NaN = missing) with standard uncertainties.

    The uncertainty is the larger of what is stated and what scatters (where only the ratios of the stated ones can be
    trusted, ``relative``: what scatters), the latter widened by Student's t so that ± 1.96 standard uncertainties hold
    95 % with few frames too. Samples beyond five robust standard deviations are left
    out. Fewer than four measured frames: NaN and ``too_few``.
    """
    times = np.asarray(times_s, dtype=float)
    position = np.asarray(position_m, dtype=float)
    spread = np.broadcast_to(np.asarray(position_unc_m, dtype=float), times.shape)
    used = np.isfinite(position) & np.isfinite(spread) & (spread > 0)
    if used.sum() <= DEGREE + 1:
        nothing = np.full(3, np.nan)
        return Parabola(np.nan, nothing, np.full((3, 3), np.nan), used, position * np.nan, np.nan, "too_few")
    origin = float(np.mean(times[used]))
    length = float(np.ptp(times[used]))
    t = (times - origin) / length
    design = np.stack([np.ones_like(t), t, 0.5 * t**2], axis=1)
    for _ in range(ROUNDS):
        weighted = design[used] / spread[used, None]
        solution = np.linalg.lstsq(weighted, position[used] / spread[used], rcond=None)[0]
        score = np.abs(position - design @ solution) / spread
        limit = REJECT * max(1.4826 * float(np.median(score[used])), 1e-12)
        keep = used & (score <= limit)
        if keep.sum() <= DEGREE + 1 or keep.sum() == used.sum():
            break
        used = keep
    free = int(used.sum()) - design.shape[1]
    scatter = float(np.sqrt(np.sum(score[used] ** 2) / free))
    scale = max(0.0 if relative else 1.0, scatter * float(stdtrit(free, 0.975)) / 1.959964)
    units = 1.0 / length ** np.arange(3)
    covariance = np.linalg.inv(weighted.T @ weighted) * np.outer(units, units) * scale**2
    return Parabola(origin, solution * units, covariance, used, position - design @ solution, scale, "ok")
