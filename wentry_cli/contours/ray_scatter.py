"""Uncertainty of the level "fast" from what its rays scatter, and from what they do not scatter at random."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, J
from wentry_cli.contours.discrepancy import add_discrepancy
from wentry_cli.contours.normal_equations import invert_block
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TUKEY = 4.685
# Neighbouring rays of the fine scan, three lines wide, see the same pixels where they are closer than this.
RAY_WIDTH_PX = 3.5
# Residuals whose variance is beyond this times that of their differences are no noise.
SIGNIFICANT = 2.0
# Cornish-Fisher's series of the 97.5 % point of Student's t over that of the normal distribution, in 1/freedom.
STUDENT = (1.210, 1.438, 1.306)
# With fewer left over Student's t has no fourth moment: nobody knows how well the scale is known.
LEAST_FREEDOM = 4.0


@compiled
def swallowed(independent: float, size: float) -> float:
    """Factor on a variance that was taken from what ``size`` parameters leave of so many ``independent`` residuals.

    NaN where too few are left to judge by.
    """
    freedom = independent - size
    return independent / freedom if freedom >= LEAST_FREEDOM else math.nan


@compiled
def few_rays(independent: float, size: float) -> float:
    """Factor on the variance of ``size`` parameters whose scale was taken from so many ``independent`` residuals.

    What the parameters swallow the residuals do not show, and a scale from few of them may be much too small by chance:
    Student's t, so that 1.96 standard uncertainties hold 95 % of the errors. NaN where too few are left to judge by.
    """
    freedom = independent - size
    student = 1.0 + STUDENT[0] / freedom + STUDENT[1] / freedom**2 + STUDENT[2] / freedom**3
    return swallowed(independent, size) * student**2


@compiled
def ray_noise(off: Floats, apart: int) -> float:
    """Robust standard deviation of what differs between rays ``apart`` from each other, px; NaN where too few."""
    differences = np.empty(off.shape[0])
    number = 0
    for k in range(apart, off.shape[0]):
        difference = abs(off[k, 0] - off[k - apart, 0])
        if not math.isnan(difference):
            differences[number] = difference
            number += 1
    return 1.4826 / math.sqrt(2.0) * median_of(differences, number) if number > 8 else math.nan


@compiled
def rays_that_share(rays: Floats) -> float:
    """How many neighbouring rays see the same pixels, at least 1; from the mean length of arc of each, px."""
    spacing = 0.0
    for k in range(rays.shape[0]):
        spacing += rays[k, LENGTH] / rays.shape[0]
    return max(1.0, RAY_WIDTH_PX / spacing)


@compiled
def independent_rays(off: Floats, scale: float, shared: float) -> float:
    """How many independent residuals ``off[:, 0]`` were kept, of which so many share what they see."""
    kept = 0
    for k in range(off.shape[0]):
        kept += abs(off[k, 0]) < TUKEY * scale
    return kept / shared


@compiled
def scan_covariance(off: Floats, rays: Floats, free: Ints, factor: Floats, scale: float) -> Floats:
    """Covariance of the free parameters from the residuals ``off[:, 0]`` (px) and their robust scale.

    Residuals that are smooth along the arc are an outline that is no ellipse (see `discrepancy`).
    """
    size, number = free.size, rays.shape[0]
    shared = rays_that_share(rays)
    few = few_rays(independent_rays(off, scale, shared), float(size))
    covariance = invert_block(factor, size, scale**2 * shared * few)
    noise = ray_noise(off, 1 + int(shared))
    if not scale * scale > SIGNIFICANT * noise * noise:
        return covariance
    weight, pull = np.zeros(number), np.zeros((number, size))
    for k in range(number):
        z = off[k, 0] / (TUKEY * scale)
        if abs(z) < 1.0:
            weight[k] = (1.0 - z * z) ** 2
            for j in range(size):
                pull[k, j] = weight[k] * rays[k, J + free[j]]
    add_discrepancy(covariance, factor, pull, rays, weight, free, scale * scale - noise * noise)
    return covariance
