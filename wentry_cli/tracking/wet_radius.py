"""The radius below the surface: pooled from frames in which it was left free, then put into every frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.tracking.held_radius import radius_slope, with_radius
from wentry_cli.tracking.scale import NO_RADIUS, PooledRadius, pool_radius
from wentry_cli.tracking.sighting import Sighting

SMALLEST_ARC = 0.30
LARGEST_GATE, HALF_HIDDEN, FEW_TELL = 0.35, 0.5, 4
MANY_TELL, SAME_RADIUS = 16, 0.002
ONE_VALUE_PER = 8
# Relative change of the stretch of half an outline with the radius that is held.
STRETCH_PER_RADIUS = -0.46


def tells_radius(fit: SilhouetteFit) -> bool:
    """Whether enough of the outline agrees with the ellipse for its size to be trusted."""
    return fit.arc_fraction * (1.0 - fit.gated_fraction) >= SMALLEST_ARC and fit.gated_fraction <= LARGEST_GATE


def pool_sightings(sightings: Sequence[Sighting], *, wet: bool) -> PooledRadius:
    """Pool the radii of the sightings in one medium that were fitted with a free radius and see enough of the outline.

    A shape that is no ellipse makes the size oscillate with the sphere, slowly against the frame rate: below the
    surface eight frames count as one independent value.
    """
    free = [
        item.free_fit
        for item in sightings
        if item.ok and item.wet == wet and item.free_fit is not None and item.free_fit.covariance[2, 2] > 0
    ]
    used = [fit for fit in free if tells_radius(fit)]
    if len(used) < FEW_TELL:
        # droplets on half of the outline in nearly every frame: what is left tells the radius, less well
        used = [fit for fit in free if tells_radius(fit) or fit.gated_fraction <= HALF_HIDDEN]
    if len(used) < FEW_TELL and _agree(free):
        used = free
    if not used:
        return NO_RADIUS
    return pool_radius(
        [fit.radius_px for fit in used],
        [fit.radius_unc_px for fit in used],
        correlated_over=ONE_VALUE_PER if wet else 1,
    )


def _agree(free: Sequence[SilhouetteFit]) -> bool:
    """Whether so many fits find the same radius that it is the sphere's, however much of it is hidden in each."""
    radius = np.array([fit.radius_px for fit in free])
    return radius.size >= MANY_TELL and bool(np.median(np.abs(radius / np.median(radius) - 1.0)) < SAME_RADIUS)


def constrain(sightings: Sequence[Sighting], radius: PooledRadius, *, wet: bool) -> list[Sighting]:
    """Put the pooled radius into every sighting of one medium.

    A fit with free radius carries in its covariance how the other parameters answer to the radius: that is exact to
    first order, and the radius moves by parts in a thousand at most. Fits with fixed radius borrow the answer of
    their neighbours in time. Sightings of the other medium, and failed ones, are returned as they are.
    """
    result = list(sightings)
    if not radius.known:
        return result
    places = [n for n, item in enumerate(result) if item.ok and item.wet == wet and item.fit is not None]
    slopes = _slopes([result[n] for n in places])
    fits = with_radius([fit for n in places if (fit := result[n].fit)], radius.value, slopes, radius_unc=radius.unc)
    for n, fit in zip(places, fits, strict=True):
        result[n] = result[n]._replace(fit=fit)
    return result


def _slopes(sightings: Sequence[Sighting]) -> NDArray[np.float64]:
    """How each of the fits answers to the radius (n, 5): its own answer, that of its neighbours, or the usual one."""
    own = np.array([item.free_fit is not None for item in sightings], bool)
    known = np.array([radius_slope(item.free_fit) for item in sightings if item.free_fit is not None]).reshape(-1, 5)
    slopes = np.zeros((len(sightings), 5))
    if len(known):
        frames = np.array([item.frame for item in sightings])
        slopes[:] = np.column_stack([np.interp(frames, frames[own], answer) for answer in known.T])
        slopes[own] = known
        return slopes
    fits = [item.fit for item in sightings if item.fit is not None]
    slopes[:, 2] = 1.0
    slopes[:, 3] = [STRETCH_PER_RADIUS * fit.stretch / fit.radius_px for fit in fits]
    return slopes
