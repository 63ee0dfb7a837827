"""Uncertainty of the level "fast" from what its rays scatter, and from what they do not scatter at random."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import LENGTH, J
from wentry_cli.contours.discrepancy import add_discrepancy
from wentry_cli.contours.normal_equations import substitute
from wentry_cli.imaging.order_statistics import median_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TUKEY = 4.685
# Neighbouring rays of the fine scan, three lines wide, see the same pixels where they are closer than this.
RAY_WIDTH_PX = 3.5
# Residuals whose variance is beyond this times that of their differences are no noise.
SIGNIFICANT = 2.0


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
def scan_covariance(off: Floats, rays: Floats, free: Ints, factor: Floats, scale: float) -> Floats:
    """Covariance of the free parameters from the residuals ``off[:, 0]`` (px) and their robust scale.

    Residuals that are smooth along the arc are an outline that is no ellipse (see `discrepancy`).
    """
    size, number = free.size, rays.shape[0]
    spacing = 0.0
    for k in range(number):
        spacing += max(0.5, rays[k, LENGTH]) / number
    noise = ray_noise(off, 1 + int(RAY_WIDTH_PX / spacing))
    excess = 0.0
    if scale * scale > SIGNIFICANT * noise * noise:
        excess = scale * scale - noise * noise
    inflation = scale**2 * max(1.0, RAY_WIDTH_PX / spacing)
    covariance = np.empty((size, size))
    unit = np.empty(size)
    for j in range(size):
        unit[:] = 0.0
        unit[j] = 1.0
        substitute(factor, unit)
        for i in range(size):
            covariance[i, j] = unit[i] * inflation
    weight, pull = np.zeros(number), np.zeros((number, size))
    for k in range(number):
        z = off[k, 0] / (TUKEY * scale)
        if abs(z) < 1.0:
            weight[k] = (1.0 - z * z) ** 2
            for j in range(size):
                pull[k, j] = weight[k] * rays[k, J + free[j]]
    add_discrepancy(covariance, factor, pull, rays, weight, free, excess)
    return covariance
